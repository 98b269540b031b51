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
# # What do failures of UAVs cost?
#
# How the performance of a fleet falls with the failure rate, with repairs and without.

# %% tags=["parameters"]
results = "../../results"  # folder with the results folder of the study failures

# %%
from pathlib import Path

from IPython.display import display

from analysis import load_results, numbers, tables
from analysis.answers import operations
from analysis.figures.settings import lines
from analysis.metrics import PRODUCT, RATIO, SUCCESS, metric_of
from analysis.stats.intervals import LEVEL
from reports.pages import html

# %%
study = load_results(Path(results) / "failures")
columns = [c for c in ("failures", "slots_grounded", "lost") if c in study.missions]
counts = [c for c in columns if study.missions[c].max() > 0]
metrics = [PRODUCT, SUCCESS, RATIO]
means = operations.means(study, [*metrics, *counts])
rate, repair = operations.RATE, operations.REPAIR

# %%
caption = (
    f"n = {numbers.span(means.loc[means['metric'].isin(metrics), 'n'])} missions per dot; bars are "
    f"{numbers.level(LEVEL)} intervals."
)
drawn = [
    (
        lines(means[means["metric"] == metric], rate, "uavs", metric, repair),
        f"{metric_of(metric).name} against the failure rate, by number of UAVs",
        caption,
    )
    for metric in metrics
]

# %%
html.answer(operations.failures(study))

# %%
html.lead(*drawn[0])

# %% [markdown]
# ## Why
#
# A mission succeeds only if every UAV fills its quota, so one lost UAV makes it fail. What it has
# collected still counts in the collection ratio, which shows how far the others make up for it.

# %%
html.gallery(drawn[1:])

# %% [markdown]
# ## How far to trust it
#
# All rates meet the same random draws, so the differences are paired.

# %%
display(
    *(
        html.table(
            tables.estimates(change, ["policy", "uavs", repair, "n"], rate, numbers.points),
            f"{metric_of(metric).name} minus that without failures, in points, by failure rate",
            data=change,
        )
        for metric in metrics
        for change in [operations.changes(study, rate, 0.0, metric)]
    )
)

# %% [markdown]
# ## Tables

# %%
display(
    *(
        html.table(
            tables.estimates(rows, ["policy", "uavs", repair, "n"], rate, numbers.quantities),
            f"{metric_of(metric).label} per mission, by failure rate; empty: nothing can fail",
        )
        for metric in counts
        for rows in [means[means["metric"] == metric]]
    )
)

# %% [markdown]
# ## How this page was made
#
# The mission is that of the paper. In every slot, each UAV fails with the same probability; then it
# is lost, or grounded and repaired after a random time.

# %%
html.provenance([study])
