# ---
# jupyter:
#   dess:
#     studies: [explorer]
#     scripts: true
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # How good is every policy at a setting of our choice?
#
# Sliders for the parameters of the paper, and the metrics of every policy at each setting.

# %% tags=["parameters"]
results = "../../results"  # folder with the results folder of explorer

# %%
from pathlib import Path

from dess.analysis import load_results, numbers
from dess.analysis.answers.settings.home import way_home_range_sentence
from dess.analysis.answers.settings.points import points_in_words
from dess.reports.explorer import Grid, make_explorer
from dess.reports.pages.markdown import write_markdown
from dess.reports.pages.parts import make_answer
from dess.reports.pages.provenance import provenance_table
from dess.reports.pages.tables import make_table

# %%
study = load_results(Path(results) / "explorer")
grid = Grid(study)
start = grid.at_start()

# %%
make_answer(grid.describe_start())

# %%
make_explorer(study)

# %% [markdown]
# ## How far to trust it

# %%
write_markdown(
    "A dot is a mean over n = {missions} missions, its bar the 95 % interval. All settings have "
    "the same random draws, so two settings may differ although their intervals overlap; a "
    "[what-if question](what-if.html) compares them mission by mission.",
    missions=numbers.format_span(start["n"]),
)

# %%
write_markdown("{sentence}", sentence=way_home_range_sentence(study))

# %% [markdown]
# ## The setting at which the sliders start

# %%
table = (
    numbers.estimates_as_text(start, "policy")
    .rename(columns=grid.metrics)
    .reset_index(names="Policy")
)
make_table(
    table,
    f"With {points_in_words(study)[grid.start]}; the CSV file has all settings",
    data=grid.means_table(),
)

# %% [markdown]
# ## How this page was made

# %%
write_markdown(
    "All other fields are those of the scenario {name}, such as {nodes} sensor nodes, {grid} x "
    "{grid} cells and a quota of {quota:,} communication slots.",
    name=study.manifest["study"]["scenario"],
    nodes=len(study.scenario().nodes),
    grid=study.scenario().grid,
    quota=study.scenario().quota,
)

# %%
provenance_table([study])
