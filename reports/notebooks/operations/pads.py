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
# # How many charging pads does a fleet need?
#
# The fewest pads that are enough for fleets of different sizes, and the waits with fewer.

# %% tags=["parameters"]
results = "../../results"  # folder with the results folder of the study pads
margin = 0.02  # a loss of the product that does not matter, as a share

# %%
from IPython.display import display

from dess.analysis import load_results, numbers, tables
from dess.analysis.answers import operations
from dess.analysis.answers.settings.home import way_home_range_sentence
from dess.analysis.metrics import PRODUCT, SUCCESS, metric_of
from dess.reports.pages import study as page
from dess.reports.pages.markdown import escape_sentences, write_markdown
from dess.reports.pages.parts import lead_figure, make_answer, make_figure, make_gallery
from dess.reports.pages.provenance import provenance_table
from dess.reports.pages.tables import make_table

# %%
study = load_results(f"{results}/pads")
uses = ["waiting", "queue", "utilisation"]
means = operations.means_of_metrics(study, [PRODUCT, SUCCESS, *uses])
against = "the number of pads, by number of UAVs"
drawn = operations.draw_means(means, "pads", "uavs", "policy", against, linked=True)

# %%
make_answer(operations.enough_pads_sentence(study, margin))

# %%
lead_figure(*drawn[PRODUCT])

# %%
page.make_panel_of(study, PRODUCT)

# %% [markdown]
# ## Why
#
# Pads are given in the order of requests; a UAV that waits flies in place and uses its battery. The
# return guard plans for waits and sends UAVs home earlier. What the fewest pads cost:

# %%
write_markdown("{lines}", lines=escape_sentences(operations.few_pads_sentence(study)))

# %%
write_markdown("{sentence}", sentence=way_home_range_sentence(study))

# %%
make_figure(*operations.draw_queues(study, margin))

# %%
make_gallery([drawn[metric] for metric in (*uses, SUCCESS)])

# %% [markdown]
# ## How far to trust it

# %%
write_markdown(
    "Pads are enough if the interval of the loss against a pad for every UAV is above −{margin}, "
    "here and with more pads. They are too few if it is below −{margin}. Between the two, more "
    "missions or other numbers of pads would decide.",
    margin=numbers.format_margin(margin),
)

# %%
lost = operations.changes_from_reference(study, "pads", study.missions["pads"].max(), PRODUCT)
write_markdown("{why}", why=operations.allowance_in_words(lost, "the product"))

# %%
make_table(
    tables.estimate_cells(lost, ["policy", "pads", "n"], "uavs", numbers.format_points),
    "Product minus that with the most pads: paired differences in points, by number of UAVs",
    data=lost,
)

# %% [markdown]
# ## Tables

# %%
display(
    *(
        make_table(
            tables.estimate_cells(rows, ["policy", "pads", "n"], "uavs", metric_of(metric).written),
            f"{metric_of(metric).label}, by number of UAVs",
        )
        for metric in uses
        for rows in [means[means["metric"] == metric]]
    )
)

# %% [markdown]
# ## How this page was made
#
# The mission is that of the paper, with a zone of 16 cells. It ends in the air: not all UAVs have
# the battery for the way home. The README's questions have missions that end on the ground
# (`landing = true`): there, all UAVs of a successful mission have landed. So do not compare their
# shares with these.
# A waiting time ends when the UAV is given a pad or gives up. Queue and utilisation are means over
# the time of the mission.

# %%
provenance_table([study])
