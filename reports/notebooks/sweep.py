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
# This page simulates every combination of values of some fields of the scenario, for every policy.
# It shows the best settings and the effect of each field.

# %% tags=["parameters"]
results = "../../results"  # folder in which the sweep is kept
scenario = "paper"  # a shipped scenario, or a TOML file
fields = {"uavs": [1, 2, 3, 4], "pads": [1, 2, 4]}  # a field with one value is fixed
policies = ["greedy", "nearest"]
missions = 200  # number of missions of every setting
seed = 0  # seed of the missions
workers = 1  # processes; more than one is worth its start time from thousands of missions on
yes = False  # True if the missions may take more than an hour

# %%
from analysis import sweep
from analysis.names import METRICS, PRODUCT
from reports.pages import html
from reports.pages.study import tables, words

# %%
answer = sweep(scenario, policies, missions, seed, results, workers, yes=yes, **fields)

# %% [markdown]
# ## What was simulated
#
# A *setting* is a policy together with one value of every swept field. All settings are simulated
# with the same random numbers (common random numbers), so they are compared mission by mission.
# Waits for a pad are planned, unless `charging.plan_waits` is false: the return guard sends a UAV
# home earlier if it must expect to wait.

# %%
html.say("{simulated}", simulated=words.simulated(answer.results))

# %% [markdown]
# ## The best settings
#
# A setting may be the best if no other one is significantly better.

# %%
tables.ranked(answer.results, answer.table(), PRODUCT)

# %% [markdown]
# The best setting of every policy is:

# %%
tables.best_of_policies(answer.results, PRODUCT)

# %% [markdown]
# ## Effects of the fields
#
# The horizontal axis is the first swept field, and there is a curve for each value of the second
# one. Means are taken over the other fields. Bars are 95 % intervals.

# %%
of_fields, each = " and ".join(answer.fields[:2]), f"n = {missions:,} missions per setting"
html.gallery(
    [
        (answer.plot(metric=metric), f"{name} by {of_fields}", f"{name}, {each}.")
        for metric, name in METRICS.items()
    ]
)

# %% [markdown]
# ## Change the question
#
# In Jupyter, change the first cell and run all cells. All missions are stored, so the same sweep is
# answered at once, and with more missions or other values only the new missions are simulated. On
# the command line, the following command runs the same sweep and makes a page with more details:

# %%
html.say("{lines}", lines=html.commands([answer.command]))

# %% [markdown]
# With `prices` and `requirements`, as in the report `own-sea`, a sweep searches for the cheapest
# fleet. `answer.table()` is a tidy table of all settings with their intervals, and
# `answer.results.missions` is a tidy table of all missions:

# %%
html.table(answer.table().iloc[:3, :8], "The first rows and columns of answer.table()")

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([answer.results])
