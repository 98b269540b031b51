# ---
# jupyter:
#   dess:
#     studies: [planning, gap]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Does planning beat learning?
#
# A policy that plans and one that has learned, in the same missions, and the time that they take.

# %% tags=["parameters"]
results = "../../results"  # folder that holds the results folders planning and gap
planner = "planner"  # the policy that plans
longer = "planner-long"  # the same with a longer search, if the study has it
learner = "ddqn"  # the policy that has learned

# %%
from dess.analysis import load_results, numbers, tables
from dess.analysis.answers import optimality, summary
from dess.analysis.answers import planner as answers
from dess.analysis.answers.policies import comparisons
from dess.analysis.answers.policies.decision_times import (
    decision_time_sentences,
    read_decision_times,
    time_table,
)
from dess.analysis.answers.policies.pairs import pair_missions, pair_of
from dess.analysis.answers.policies.parameter_bins import (
    LEAST,
    colours_in_words,
    differences_along_parameters,
    draw_differences_along_parameters,
)
from dess.analysis.figures import Drawing
from dess.analysis.figures.comparison import plot_gaps
from dess.reports.pages.markdown import escape_sentences, write_markdown
from dess.reports.pages.parts import lead_figure, make_answer, make_gallery, show_parts
from dess.reports.pages.provenance import provenance_table
from dess.reports.pages.tables import make_table

# %%
study, bounded = (load_results(f"{results}/{name}") for name in ("planning", "gap"))
times = read_decision_times(study)
planners = [planner, *(name for name in [longer] if name in study.policies)]
differences = answers.compare_with_learner(study, planners, learner)
pair = pair_of(study, planner, learner)
missions = pair_missions(study, pair)
logged = study.manifest["study"]["logged"]

# %%
make_answer(*answers.planner_sentences(differences, planner))

# %%
lead_figure(*answers.by_fleet(differences))

# %% [markdown]
# ## Why: where each of them is ahead

# %%
lead = differences_along_parameters(missions, pair.candidates)
write_markdown("{colours}", colours=colours_in_words(lead, pair))

# %%
too_few = write_markdown("Too few missions for bins of n = {least} or more.", least=LEAST)
show_parts(draw_differences_along_parameters(missions, lead, pair, f"{pair.title}, ") or too_few)

# %%
make_gallery(answers.draw_coverage(study, planner, learner))

# %%
mission = answers.first_logged_mission(study, planner)
make_gallery(
    [
        answers.at_home(study, [planner, learner]),
        answers.draw_plan(study, mission),
        answers.draw_prices(bounded, mission.replication),
    ]
)

# %% [markdown]
# ## How far to trust it
#
# All policies meet the same missions. The study gap has an upper bound for some of them. The best
# possible policy is between the best one here and this bound.

# %%
write_markdown(
    "{gap} {weights} {why}",
    gap=escape_sentences(optimality.in_words(bounded, planners[-1])),
    weights=summary.weights_in_words(study),
    why=comparisons.allowance_for_difference(
        differences[differences["uavs"] == optimality.ALL], "policy"
    ),
)

# %%
bounds = optimality.by_fleet(bounded)
counted = f"n = {len(missions):,} missions per policy."
front = answers.draw_decision_time_front(study, times)
drawn = [front._replace(caption=f"{front.caption} {counted}")]
if len(useful := optimality.fleets_with_useful_bound(bounds)):
    alt = "The product of every policy and the upper bound, by number of UAVs"
    counted = (
        f"{optimality.nearest_sentence(useful)} n = {numbers.format_span(useful['n'])} missions. "
        "The band is the interval of the bound."
    )
    drawn.append(Drawing(plot_gaps(useful), alt, counted))
make_gallery(drawn, "Bars are 95 % intervals.")

# %% [markdown]
# ## Tables

# %%
means = differences.assign(mean=differences["difference"])
make_table(
    tables.estimate_cells(means, ["policy", "uavs", "n"], write=numbers.format_points),
    f"Paired differences from {learner} in points, with 95 % intervals",
    data=differences,
)

# %%
caption = "Means, the upper bound, and the gap in points"
make_table(optimality.fleet_bound_table(bounds), caption, data=bounds)

# %%
make_table(
    answers.return_table(study, [planner, learner]),
    f"Means over charging sessions of the same {logged} missions",
)

# %%
make_table(time_table(times), "Time of a decision for the UAVs of a mission")

# %% [markdown]
# ## How this page was made

# %%
write_markdown("{remarks}", remarks=decision_time_sentences(times, study, pair))

# %%
provenance_table([study, bounded])
