# ---
# jupyter:
#   dess:
#     studies: []
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Sweep
#
# Every combination of values of some fields of the scenario, simulated now for every policy: the
# best settings, and what each field does.

# %% tags=["parameters"]
results = "../../results"  # folder in which the sweep is kept
scenario = "paper"  # a shipped scenario, or a TOML file
fields = {"uavs": [1, 2, 3, 4], "pads": [1, 2, 4]}  # one value is fixed, several are swept
policies = ["greedy", "nearest"]
missions = 200  # of every policy and setting
seed = 0  # of the missions
workers = 1  # processes; more take seconds to start, and pay from thousands of missions on

# %%
from analysis import sweep
from analysis.names import METRICS, PRODUCT
from reports.pages import html
from reports.pages.study import tables, words

# %%
answer = sweep(scenario, policies, missions, seed, results, workers, **fields)

# %% [markdown]
# ## What was simulated
#
# A *setting* is a policy with a value of every field that is swept. All settings meet the same
# replications, which have the same realisations of all random draws, so they are compared mission
# by mission.

# %%
html.say("{simulated}", simulated=words.simulated(answer.results))

# %% [markdown]
# ## The best settings
#
# A setting may be the best if no other one is significantly better.

# %%
tables.ranked(answer.results, answer.table(), PRODUCT)

# %% [markdown]
# Of every policy:

# %%
tables.best_of_policies(answer.results, PRODUCT)

# %% [markdown]
# ## What the fields do
#
# The curves are over the first field that is swept, one for each value of the second; all others
# are averaged. Bars are 95 % intervals.

# %%
of_fields, each = " and ".join(answer.fields[:2]), f"n = {missions:,} missions per setting"
html.gallery(
    [
        (answer.plot(metric=metric), f"{name} by {of_fields}", f"{name}, {each}.")
        for metric, name in METRICS.items()
    ]
)

# %% [markdown]
# ## Ask again, ask more
#
# In Jupyter, change the first cell and run all cells. What was simulated is kept: the same sweep is
# answered at once, and with more missions or other values only what is new is simulated. On the
# command line, this asks the same, and makes a page with more on it:

# %%
html.say("{lines}", lines=html.commands([answer.command]))

# %% [markdown]
# With `prices` and `requirements`, as in the report `own-sea`, a sweep looks for the cheapest
# fleet. `answer.table()` has all settings with their intervals, and `answer.results.missions` all
# missions, as tidy tables:

# %%
html.table(answer.table().iloc[:3, :8], "The first rows and columns of answer.table()")

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([answer.results])
