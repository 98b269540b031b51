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
# # Explorer
#
# Change the parameters of the paper with sliders and see their effect: the three metrics of every
# policy at every setting of a grid, with confidence intervals, and curves along each parameter.

# %% tags=["parameters"]
results = "../../results"  # folder with the results folder of explorer

# %%
from pathlib import Path

from analysis import load_results, names, numbers
from analysis.figures.settings import performance
from analysis.questions.settings import in_words
from analysis.stats.intervals import LEVEL
from reports.explorer import Grid, explorer
from reports.pages import html

# %%
study = load_results(Path(results) / "explorer")
grid = Grid(study)
start = grid.at_start()

# %%
explorer(study)

# %%
html.say(
    "A dot is a mean, and the bar is its {level} confidence interval. At every setting, each "
    "policy is simulated in the same {missions} replications.",
    level=numbers.level(LEVEL),
    missions=numbers.span(start["n"]),
)

# %% [markdown]
# The thin lines are at 0, 50 and 100 %. All replications have the same random initial data,
# arrivals and shadowing. Therefore two settings, or two policies, may differ significantly although
# their intervals overlap. A [what-if question](what-if.html) compares two settings mission by
# mission.

# %%
html.say(
    "All other fields are those of the scenario {name}, among them {nodes} sensor nodes on "
    "{s.grid} x {s.grid} cells, {s.charging_pads} charging pads, a quota of {s.quota:,} "
    "communication slots for each UAV, and on average {s.arrival_rate:g} data units that arrive "
    "per node and mission slot.",
    s=study.scenario(),
    nodes=len(study.scenario().nodes),
    name=study.manifest["study"]["scenario"],
)

# %% [markdown]
# ## The setting in the middle

# %%
caption = f"at {in_words(study)[grid.start]}. n = {numbers.span(start['n'])} missions per policy."
html.gallery(
    [
        (performance(start, metric), f"{name} of every policy", f"{name} {caption}")
        for metric, name in names.METRICS.items()
    ]
)

# %%
table = numbers.wide(start, "policy").rename(columns=names.METRICS).reset_index(names="Policy")
html.table(table, "The same in numbers; the CSV file has all settings", data=grid.table())

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([study])
