# ---
# jupyter:
#   dess:
#     studies: [explorer]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Explorer
#
# Move the paper's parameters and see what becomes of a mission: the three metrics of every policy
# at every setting of a grid, with their intervals, and their course along each parameter.

# %% tags=["parameters"]
results = "../../results"  # folder with the results folder of explorer

# %%
from pathlib import Path

from analysis import load_results, names, numbers
from analysis.figures.policies import performance
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
    "A dot is a mean, with its {level} interval; the thin lines stand at 0, 50 and 100 %. At "
    "every setting, each policy acts in the same {missions} realisations of all that is random: "
    "arrivals, shadowing, the initial data within its range. So two settings, or two policies, "
    "may differ clearly where their intervals overlap; a [what-if question](what-if.html) "
    "compares them mission by mission.",
    level=numbers.level(LEVEL),
    missions=numbers.span(start["n"]),
)

# %%
html.say(
    "Fixed are {nodes} sensor nodes on {s.grid} x {s.grid} cells, {s.charging_pads} charging "
    "pads, a quota of {s.quota:,} communication slots for each UAV, {s.arrival_rate:g} data units "
    "that arrive per node and mission slot, and all else of the scenario {name}.",
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
html.table(table, "The same in numbers. CSV: all settings of the grid", data=grid.table())

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([study])
