# ---
# jupyter:
#   dess:
#     studies: [table4, fig4, fig5, sweet-spot]
#     optional: [gap]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Replication scorecard
#
# Each claim of the paper's Section V is compared with the simulations of this project. A stated
# rule computes the verdict on the claim from the results.

# %% tags=["parameters"]
results = "../../results"  # folder with the results of table4, fig4, fig5, sweet-spot (and gap)
trained = None  # folder with the learning curves; None for the shipped ones

# %%
from importlib.resources import files
from pathlib import Path

from IPython.display import display

from analysis import load_results
from analysis.questions.learning.files import read_curves
from analysis.questions.optimality import gap
from analysis.replication.scorecard import PAPERS_NETWORK, departures, scorecard
from dess.files.reading import paths_in
from policies.ddqn.description import read_description
from reports.pages import html
from reports.pages.scorecard import as_html

# %%
folder = Path(trained or str(files("policies") / "trained"))
names = ("table4", "fig4", "fig5", "sweet-spot")
studies = {name: load_results(Path(results) / name) for name in names}
rows = scorecard(studies, read_curves(folder / "curves.parquet"))
papers = [read_description(c.parent) for c in paths_in(folder, f"{PAPERS_NETWORK}/config.json")]
as_html(rows, departures=[words for one in papers for words in departures(one.training)])

# %% [markdown]
# ## How far the policies are from the best possible

# %%
bounded = gap.results_in(Path(results) / "gap")
html.say("{text}", text=html.composed(gap.in_words(bounded) if bounded else gap.NOT_RUN))

# %%
if bounded:
    far = gap.at_most(gap.by_fleet(bounded))
    display(html.table(far, "The mean product is at most so many points from the best possible"))

# %% [markdown]
# ## Where the figures come from

# %%
html.weights(folder)

# %%
html.provenance([*studies.values(), *([bounded] if bounded else [])])
