# ---
# jupyter:
#   dess:
#     studies: [pads]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # How many charging pads
#
# This page shows how many charging pads fleets of different sizes need, and how long UAVs wait for
# a pad if there are fewer.

# %% tags=["parameters"]
results = "../../results"  # folder with the results folder of the study pads
margin = 0.02  # a loss of the product that does not matter, as a share

# %%
from pathlib import Path

from IPython.display import display

from analysis import load_results, names, numbers
from analysis.figures.learning import courses
from analysis.figures.settings import lines
from analysis.questions import operations
from analysis.stats.intervals import LEVEL
from reports import tables
from reports.pages import html

# %%
study = load_results(Path(results) / "pads")
uses = ["waiting", "queue", names.UTILISATION]
metrics = [names.SUCCESS, names.PRODUCT, *uses]
means = operations.means(study, metrics)
missions = numbers.span(means["n"])
level = numbers.level(LEVEL)

# %%
html.say("{answer}", answer=html.composed(operations.pads(study, margin)))

# %% [markdown]
# ## What was simulated
#
# The mission is that of the paper: UAVs start in a zone of 16 cells, collect data until their quota
# is filled, and return to the zone to charge. Pads are given to UAVs in the order of their requests
# (first come, first served). All numbers of pads meet the same random draws (common random
# numbers). Waits are planned, which is the default of all scenarios (`charging.plan_waits`): the
# return guard sends a UAV home earlier if it must expect to wait for a pad. A UAV that finds all
# pads in use waits, and flying in place takes battery.

# %% [markdown]
# ## Success and product

# %%
drawn = [
    (
        lines(means[means["metric"] == metric], "pads", "uavs", metric, "policy"),
        f"{names.metric_name(metric)} against the number of pads, by number of UAVs",
        f"n = {missions} missions per point; bars are {level} intervals.",
    )
    for metric in metrics
]
html.gallery(drawn[:2])

# %%
lost = operations.changes(study, "pads", study.missions["pads"].max(), names.PRODUCT)
html.table(
    tables.estimates(lost, ["policy", "pads"], "uavs", numbers.points),
    "Collection ratio and communication with fewer pads, minus that with the most pads: paired "
    f"differences in percentage points with {level} intervals, by number of UAVs",
    data=lost,
)

# %% [markdown]
# ## Waiting, queue and use of the pads
#
# The waiting time of a request ends when the UAV is given a pad or gives up. The queue and the
# utilisation are means over the time of the mission: the number of UAVs that wait, and the share of
# the pads in use. A mission in which no UAV asked for a pad has no waiting time.

# %%
html.gallery(drawn[2:])

# %% [markdown]
# ### The queue over time
#
# All UAVs take off together, so their batteries reach the charging threshold at about the same time
# and the queue comes in a wave. The figure shows, for every fleet, a single pad, and the largest
# number of pads that is not enough.

# %%
waves = operations.queues(study, study.policies[0], operations.short_of_pads(study, margin))
low, high = map(numbers.level, operations.BAND)
titles = {uavs: f"UAVs that wait for a pad: {uavs} UAVs" for uavs in waves["uavs"].unique()}
html.figure(
    courses(waves.assign(panel=waves["uavs"]), "pads", "", titles, "Number of charging pads"),
    "The number of UAVs that wait for a pad over the slots of the mission",
    f"The line is the mean of n = {waves['n'].min()} missions, the band has the missions between "
    f"the {low} and the {high} quantile. A mission that is over has no queue.",
    waves,
)

# %%
display(
    *(
        html.table(
            tables.estimates(rows, ["policy", "pads"], "uavs", numbers.written(metric)),
            f"{names.metric_label(metric)}: means with {level} intervals, by number of UAVs",
        )
        for metric in uses
        for rows in [means[means["metric"] == metric]]
    )
)

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([study])
