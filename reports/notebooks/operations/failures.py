# ---
# jupyter:
#   dess:
#     studies: [failures]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # What failures of UAVs cost
#
# This page shows how the performance of a fleet degrades with the failure rate of its UAVs, if they
# are lost, and if they are repaired.

# %% tags=["parameters"]
results = "../../results"  # folder with the results folder of the study failures

# %%
from pathlib import Path

from IPython.display import display

from analysis import load_results, names, numbers
from analysis.figures.settings import lines
from analysis.questions import operations
from analysis.stats.intervals import LEVEL
from reports import tables
from reports.pages import html

# %%
study = load_results(Path(results) / "failures")
columns = [c for c in ("failures", "slots_grounded", "lost") if c in study.missions]
counts = [c for c in columns if study.missions[c].max() > 0]
metrics = [names.PRODUCT, names.SUCCESS, names.RATIO]
means = operations.means(study, [*metrics, *counts])
missions = numbers.span(means.loc[means["metric"].isin(metrics), "n"])
level = numbers.level(LEVEL)
rate, repair = operations.RATE, operations.REPAIR

# %%
html.say("{answer}", answer=html.composed(operations.failures(study)))

# %% [markdown]
# ## What was simulated
#
# The mission is that of the paper. In every mission slot, each UAV fails with the same probability.
# A failed UAV is lost for the rest of the mission, or is grounded and repaired after a random time.
# The data that a lost UAV has collected count. A mission succeeds only if every UAV fills its
# quota, so a single lost UAV makes it fail; the collection ratio shows how far the others make up
# for it. All rates meet the same random draws (common random numbers).

# %% [markdown]
# ## Product, success and collection ratio

# %%
html.gallery(
    [
        (
            lines(means[means["metric"] == metric], rate, "uavs", metric, repair),
            f"{names.metric_name(metric)} against the failure rate, by number of UAVs",
            f"n = {missions} missions per point; bars are {level} intervals. A mean time of a "
            "repair of 0 means that a failed UAV is lost.",
        )
        for metric in metrics
    ]
)

# %%
display(
    *(
        html.table(
            tables.estimates(change, ["policy", "uavs", repair], rate, numbers.points),
            f"{names.metric_name(metric)} minus that without failures: paired differences in "
            f"percentage points with {level} intervals, by failure rate per mission slot",
            data=change,
        )
        for metric in metrics
        for change in [operations.changes(study, rate, 0.0, metric)]
    )
)

# %% [markdown]
# ## How often UAVs fail

# %%
display(
    *(
        html.table(
            tables.estimates(rows, ["policy", "uavs", repair], rate, numbers.quantities),
            f"{names.metric_label(metric)} per mission: means with {level} intervals, by failure "
            "rate per mission slot; nothing where nothing can fail",
        )
        for metric in counts
        for rows in [means[means["metric"] == metric]]
    )
)

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([study])
