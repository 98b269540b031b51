# ---
# jupyter:
#   dess:
#     studies: [comparison]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Is the learned policy better than a heuristic?
#
# The best learned policy and the best heuristic in the same missions.

# %% tags=["parameters"]
results = "../../results"  # folder that holds the results folder comparison
learned = None  # the learned policy to show; None for the best of the study
heuristic = None  # the policy to compare it with; None for the best that is not learned

# %%
from IPython.display import display

from dess.analysis import load_results
from dess.analysis.answers import missions as logged
from dess.analysis.answers import summary
from dess.analysis.answers.policies import comparisons
from dess.analysis.answers.policies.decision_times import (
    decision_time_sentences,
    read_decision_times,
    time_table,
)
from dess.analysis.answers.policies.pairs import (
    compare_pair,
    count_depleted_uavs,
    draw_difference_distribution,
    mission_commands,
    missions_to_draw,
    most_lost,
    outcome_table,
    pair_missions,
    pair_of,
    pair_outcome_table,
    pair_sentence,
    pairing_sentence,
    worst_pair_missions,
)
from dess.analysis.answers.policies.parameter_bins import (
    LEAST,
    colours_in_words,
    dependence_on_parameters,
    dependence_table,
    differences_along_parameters,
    draw_differences_along_parameters,
)
from dess.reports.pages.markdown import command_block, write_markdown
from dess.reports.pages.parts import lead_figure, make_answer, make_gallery, show_parts
from dess.reports.pages.provenance import provenance_table
from dess.reports.pages.tables import make_table

# %%
study = load_results(f"{results}/comparison")
times = read_decision_times(study)
pair = pair_of(study, learned, heuristic)
missions = pair_missions(study, pair)
comparison = compare_pair(study, pair)
worst = worst_pair_missions(missions, 5)
lost = most_lost(missions.drop(worst.index), 5)

# %%
make_answer(pair_sentence(comparison, missions, pair))

# %%
lead_figure(*draw_difference_distribution(missions, pair))

# %% [markdown]
# ## Why: where it is better
#
# Each parameter is divided into at most five bins with about equally many missions.

# %%
lead = differences_along_parameters(missions, pair.candidates)
write_markdown("{colours}", colours=colours_in_words(lead, pair))

# %%
too_few = write_markdown("Too few missions for bins of n = {least} or more.", least=LEAST)
show_parts(
    draw_differences_along_parameters(missions, lead, pair, f"{pair.title}, 95 % intervals, ")
    or too_few
)

# %% [markdown]
# ## Its worst missions
#
# The two missions with the lowest product of the learned policy, with both policies.

# %%
kept = logged.kept_missions(study, missions_to_draw(missions, pair))
make_gallery(
    logged.draw_mission(
        mission, f"Map of mission {mission.replication} by {mission.policy}", mission.caption
    )
    for mission in kept
)

# %% [markdown]
# ## How far to trust it
#
# Every interval has its level alone. A learner with several trainings is judged
# by their mean; *one new training* is a prediction interval. A single training stands for itself
# only.

# %%
pairing = pairing_sentence(comparison)
for table in comparisons.all_comparison_tables(study, comparison, pairing, len(missions)):
    display(make_table(*table))
write_markdown(
    "{correction} {why} {weights}",
    correction=comparisons.correction_in_words(study),
    why=comparisons.allowance_for_difference(comparison, "policy"),
    weights=summary.weights_in_words(study),
)

# %% [markdown]
# ## Tables

# %%
depleted = count_depleted_uavs(study, pair.policy, worst["replication"])
make_table(pair_outcome_table(missions, pair), "Outcomes of the missions")

# %%
make_table(
    dependence_table(lead, dependence_on_parameters(missions)),
    "Lowest and highest mean difference [points] by parameter, the share of the variance that "
    "its bins explain, and the test of equal means (Alexander and Govern, Holm)",
)

# %%
make_table(
    outcome_table(worst, study, pair),
    f"The worst missions of {pair.policy}; {depleted} of its UAVs run out of battery in these",
)

# %%
make_table(outcome_table(lost, study, pair), f"The greatest losses to {pair.baseline}")

# %%
make_table(time_table(times), "Time of a decision for the UAVs of a mission")

# %% [markdown]
# ## How this page was made

# %%
lines = mission_commands(study, pair.policy, [*worst["replication"], *lost["replication"]])
write_markdown(
    "{times} These commands simulate missions of the tables again:\n\n{lines}",
    times=decision_time_sentences(times, study, pair),
    lines=command_block(lines),
)

# %%
provenance_table([study])
