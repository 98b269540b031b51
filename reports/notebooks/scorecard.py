# ---
# jupyter:
#   dess:
#     studies: [table4, fig4, fig5, sweet-spot]
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
import json
from importlib.resources import files
from pathlib import Path

import pandas as pd
from IPython.display import display

from analysis import load_results
from analysis.questions.optimality import gap
from analysis.replication.scorecard import PAPERS_NETWORK, departures, scorecard
from reports.pages import html
from reports.pages.scorecard import as_html

# %%
folder = Path(trained or str(files("policies") / "trained"))
names = ("table4", "fig4", "fig5", "sweet-spot")
studies = {name: load_results(Path(results) / name) for name in names}
rows = scorecard(studies, pd.read_parquet(folder / "curves.parquet"))
config = folder / PAPERS_NETWORK / "config.json"
training = json.loads(config.read_text("utf-8"))["training"] if config.exists() else {}
as_html(rows, departures=departures(training) if training else [])

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
