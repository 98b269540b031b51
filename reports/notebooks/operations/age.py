# ---
# jupyter:
#   dess:
#     studies: [age]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # How old the data are
#
# This page shows the age of information of the sensor nodes against the number of UAVs and the rate
# at which new data arrive.

# %% tags=["parameters"]
results = "../../results"  # folder with the results folder of the study age

# %%
from pathlib import Path

from analysis import load_results, names, numbers
from analysis.figures.settings import lines
from analysis.questions import operations
from analysis.stats.intervals import LEVEL
from reports import tables
from reports.pages import html

# %%
study = load_results(Path(results) / "age")
ages = [names.AGE, "peak_age", "age_p99"]
means = operations.means(study, [*ages, names.RATIO])
missions, level = numbers.span(means["n"]), numbers.level(LEVEL)
rates = "arrival_rate"

# %%
html.say("{answer}", answer=html.composed(operations.age(study)))

# %% [markdown]
# ## What was simulated
#
# The fleet keeps watch: no UAV can fill its quota, so every mission lasts to its last slot, and
# UAVs collect, charge and collect again. The charging zone is in the middle of the grid, so that a
# battery is enough for every node. The rest is the paper's scenario with 25 nodes. The age of
# a node is the time since it was last emptied (it is 0 at the start of the mission), and the age of
# a mission is its mean over time and nodes, exact from the areas under the sawtooth. The peak age
# is the mean of the ages just before they fall. A node that no UAV empties has no peak, but a
# growing age. A node without new data cannot be emptied, so at low rates no fleet can keep the age
# below the mean time between arrivals.

# %% [markdown]
# ## The age against the number of UAVs

# %%
html.gallery(
    [
        (
            lines(means[means["metric"] == metric], "uavs", rates, metric, "policy"),
            f"{names.metric_name(metric)} against the number of UAVs, by arrival rate",
            f"n = {missions} missions per point; bars are {level} intervals.",
        )
        for metric in (*ages, names.RATIO)
    ]
)

# %% [markdown]
# ## Beside the published effect
#
# Mathematics 13(21) 3564 reports for another model of UAVs that collect data that the average age
# falls by 46 % from one to two UAVs, and by 79 % from one to ten. The comparison is of the size of
# the effect only: scenario, channel and trajectories differ. `greedy` chooses nodes by their data
# for the distance, `age` by their age for the distance.

# %%
change = operations.age_changes(study)
html.table(
    tables.estimates(change, ["policy", "uavs"], rates, operations.relative),
    f"Change of the average age of information from one UAV, with {level} intervals of the ratio "
    "of means over common replications, by arrival rate",
    data=change,
)

# %% [markdown]
# ## All means

# %%
html.table(
    tables.estimates(
        means[means["metric"] == names.AGE], ["policy", "uavs"], rates, numbers.quantities
    ),
    f"{names.metric_label(names.AGE)}: means with {level} intervals, by arrival rate",
    data=means,
)

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([study])
