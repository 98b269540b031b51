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
from IPython.display import display

from dess.analysis import load_results, numbers, tables
from dess.analysis.answers import operations
from dess.analysis.answers.settings.home import way_home_range_sentence
from dess.analysis.metrics import PRODUCT, RATIO, SUCCESS, metric_of
from dess.reports.pages import study as page
from dess.reports.pages.markdown import write_markdown
from dess.reports.pages.parts import lead_figure, make_answer, make_gallery
from dess.reports.pages.provenance import provenance_table
from dess.reports.pages.tables import make_table

# %%
study = load_results(f"{results}/failures")
rate = operations.RATE
repair = operations.REPAIR
metrics = [PRODUCT, SUCCESS, RATIO]
counts = [c for c in ("failures", "slots_grounded", "lost") if c in study.missions]
counts = [c for c in counts if study.missions[c].max() > 0]
means = operations.means_of_metrics(study, metrics)
against = "the failure rate, by number of UAVs"
lead, *others = operations.draw_means(means, rate, "uavs", repair, against).values()

# %%
make_answer(operations.failures_sentence(study))

# %%
lead_figure(*lead)

# %%
page.make_panel_of(study, PRODUCT)

# %% [markdown]
# ## Why
#
# A mission succeeds only if every UAV fills its quota, so one that is lost before makes it fail.
# What it has collected still counts in the collection ratio, which shows how far the others make up
# for it.

# %%
write_markdown("{sentence}", sentence=way_home_range_sentence(study))

# %%
make_gallery(others)

# %% [markdown]
# ## How far to trust it
#
# All rates meet the same random draws, so the differences are paired.

# %%
display(
    *(
        make_table(
            tables.estimate_cells(
                change, ["policy", "uavs", repair, "n"], rate, numbers.format_points
            ),
            f"{metric_of(metric).name} minus that without failures, in points, by failure rate",
            data=change,
        )
        for metric in metrics
        for change in [operations.changes_from_reference(study, rate, 0.0, metric)]
    )
)

# %% [markdown]
# ## Tables

# %%
display(
    *(
        make_table(
            tables.estimate_cells(
                rows, ["policy", "uavs", repair, "n"], rate, numbers.format_quantities
            ),
            f"{metric_of(metric).label} per mission, by failure rate; empty: nothing can fail",
        )
        for metric in counts
        for rows in [operations.means_of_metrics(study, [metric])]
    )
)

# %% [markdown]
# ## How this page was made
#
# The mission is that of the paper. In every slot, each UAV fails with the same probability; then it
# is lost, or grounded and repaired after a random time.

# %%
provenance_table([study])
