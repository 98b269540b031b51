# ---
# jupyter:
#   dess:
#     studies: [seas, seas-landing, seas-horizon]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # How good are the policies on any sea?
#
# Every policy on seas of seven families that no policy has learned on, beside its time.

# %% tags=["parameters"]
results = "../../results"  # folder that holds the results folders seas, seas-landing, seas-horizon
policy = "generalist"  # the learned policy for any sea
reference = None  # a slow policy that is hard to beat; None for a planner of the study
heuristic = "greedy"  # a fast policy without learning

# %%
from dess.analysis import load_results, tables
from dess.analysis.answers import seas
from dess.analysis.answers.policies.decision_times import read_decision_times
from dess.analysis.metrics import METRICS, SUCCESS
from dess.reports.pages.parts import lead_figure, make_answer, make_gallery
from dess.reports.pages.provenance import provenance_table
from dess.reports.pages.tables import make_table

# %%
study, landing, horizon = (
    load_results(f"{results}/{name}") for name in ("seas", "seas-landing", "seas-horizon")
)
reference = reference or seas.reference_of(study)
for name in (policy, reference, heuristic):
    study.check_policy(name)
times = read_decision_times(study)

# %%
make_answer(seas.unseen_seas_sentence(study, times, policy, reference, heuristic))

# %%
lead_figure(*seas.draw_decision_time_front(study, times))

# %% [markdown]
# ## Why: what each family asks for

# %%
make_gallery(seas.by_group(study, reference))

# %% [markdown]
# ## How far to trust it
#
# A sea counts once, with the mean of its missions, and all policies meet the same missions. The
# seas are drawn with seeds that no training and no selection of weights has used.

# %%
make_table(
    seas.worst_seas_table(study, policy, reference),
    f"The seas on which {policy} is the farthest behind {reference}",
)

# %% [markdown]
# ## Tables

# %%
make_table(
    seas.policies_table(study, times),
    f"Every policy over all seas, and the time of a decision in batches on one core; "
    f"{seas.count_seas_in_words(study)}",
)

# %% [markdown]
# ### Missions that end on the ground
#
# Every UAV must have landed at the end, with its quota filled or, without a quota, after eight
# hours of flying and charging. No shipped policy has learned on such missions.

# %%
counted = seas.count_seas_in_words(landing)
make_table(
    seas.policies_table(landing, times), f"Missions with a quota that end on the ground; {counted}"
)

# %%
make_table(
    seas.policies_table(horizon, times),
    f"Eight hours without a quota; {seas.count_seas_in_words(horizon)}",
)

# %%
rows = seas.means_over_seas(study, "family", SUCCESS)
make_table(
    tables.estimate_cells(rows, ["family"], "policy"),
    f"{METRICS[SUCCESS]} by family: means over seas with 95 % intervals",
    data=rows,
)

# %%
gains = seas.differences_from_baseline(study, heuristic, "family")
gains = gains.assign(mean=gains["difference"])
make_table(
    tables.estimate_cells(gains, ["family"], "policy", tables.numbers.format_points),
    f"Points of the product more than {heuristic}, paired, with 95 % intervals",
    data=gains,
)

# %% [markdown]
# ## How this page was made

# %%
provenance_table([study, landing, horizon])
