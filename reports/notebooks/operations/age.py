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
# # How old are the data?
#
# The age of information against the number of UAVs and the rate at which data arrive.

# %% tags=["parameters"]
results = "../../results"  # folder with the results folder of the study age

# %%
from dess.analysis import load_results, numbers, tables
from dess.analysis.answers import operations
from dess.analysis.metrics import AGE, RATIO, metric_of
from dess.reports.pages import study as page
from dess.reports.pages.markdown import write_markdown
from dess.reports.pages.parts import lead_figure, make_answer, make_gallery
from dess.reports.pages.provenance import provenance_table
from dess.reports.pages.tables import make_table

# %%
study = load_results(f"{results}/age")
means = operations.means_of_metrics(study, [AGE, "peak_age", "age_p99", RATIO])
against = "the number of UAVs, by arrival rate"
lead, *others = operations.draw_means(means, "uavs", "arrival_rate", "policy", against).values()

# %%
make_answer(operations.age_sentence(study))

# %%
lead_figure(*lead)

# %%
page.make_panel_of(study, AGE)

# %% [markdown]
# ## Why
#
# The age of a node grows until a UAV empties it. A node without new data cannot be emptied: its age
# grows until data arrive and are collected. Such a node has no peak, but counts in the mean age: so
# the peak age may be lower than the mean.

# %%
make_gallery(others)

# %% [markdown]
# ## How far to trust it
#
# Another model differs in scenario, channel and trajectories: only the size of the effect compares.

# %%
write_markdown(
    "Mathematics 13(21) 3564 reports, for another model, {published}.",
    published=operations.published_age_in_words(),
)

# %%
change = operations.age_changes(study)
write_markdown("{why}", why=operations.allowance_in_words(change, "the age"))

# %%
make_table(
    tables.estimate_cells(
        change, ["policy", "uavs", "n"], "arrival_rate", operations.format_relative_change
    ),
    "Change of the age from one UAV, with intervals of the ratio of means, by arrival rate",
    data=change,
)

# %% [markdown]
# ## Tables

# %%
of_age = means[means["metric"] == AGE]
make_table(
    tables.estimate_cells(
        of_age, ["policy", "uavs", "n"], "arrival_rate", numbers.format_quantities
    ),
    f"{metric_of(AGE).label}, by arrival rate",
    data=means,
)

# %% [markdown]
# ## How this page was made
#
# The quota is larger than what a UAV can fill. The zone is in the middle of the grid of 25 nodes;
# the rest is the paper's scenario. The age of a mission is the mean over time and nodes, the peak
# age that just before nodes are emptied. `greedy` weighs the data of nodes against the distance,
# `age` their age.

# %%
write_markdown("{lengths}", lengths=operations.mission_lengths_sentence(study))

# %%
provenance_table([study])
