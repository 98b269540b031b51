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
# # What if
#
# A question to the simulator, answered now: a baseline of the scenario and a variation of it,
# simulated in the same realisations and compared mission by mission, with a typical and a bad
# mission to look at.

# %% tags=["parameters"]
results = "../../results"  # folder in which the results of the question are kept
settings = {"uavs": 5}  # fields of the scenario that the variation sets
baseline = {"uavs": 3}  # fields that are set in both, where the variation does not set its own
scenario = "paper"  # a shipped scenario, or a TOML file
policies = ["ddqn", "greedy"]  # each is compared with itself
missions = 500  # of every policy, in the baseline and in the variation
seed = 0  # of the missions
workers = 1  # processes; more take seconds to start, and pay from thousands of missions on
shown = None  # the policy whose missions are drawn; None for the best in the variation

# %%
from IPython.display import display

from analysis import names, what_if
from reports.pages import html

# %%
asked = what_if(settings, baseline, scenario, policies, missions, seed, results, workers, shown)

# %% [markdown]
# ## The question
#
# What if a mission had the settings of the variation in place of those of the baseline? The table
# has the fields of the scenario that the variation changes; then those that are set in both, and
# those that every mission draws for itself, in both alike. Every policy acts in as many missions of
# the baseline as of the variation. Replication by replication, all that the variation does not set
# is equal: initial data, arrivals and shadowing.

# %%
html.table(asked.fields(), f"Scenario {asked.scenario}, {asked.missions:,} missions of each policy")

# %% [markdown]
# ## The answer

# %%
html.say("{answer}", answer=asked.answer())

# %% [markdown]
# These are paired differences, each with its 95 % interval; what is inconclusive has 0 in it. A
# learned policy acts as it was trained: in a setting unlike that of its training, which its model
# card describes, a new training may do better.
#
# Means of the two sides may have overlapping intervals where their paired difference is clear:

# %%
caption = f"n = {asked.missions:,} missions per dot, bars are 95 % intervals of the means."
html.gallery(
    [
        (asked.plot_means(metric), f"{name}, baseline and variation", f"{name}. {caption}")
        for metric, name in names.METRICS.items()
    ]
)

# %% [markdown]
# The answer, and what single missions gain or lose in collection ratio and communication. A mission
# that fails counts 0: pairs of which one failed lie far out.

# %%
pairs = f"n = {asked.missions:,} pairs per policy"
spread = f"{pairs}: {asked.winners()}. Below: between the quantiles of 5 % and 95 %."
html.gallery(
    [
        (asked.plot(), "Paired differences of the metrics", f"{pairs}, 95 % intervals."),
        (asked.plot_spread(), "Distribution of the paired differences", spread),
    ]
)

# %% [markdown]
# ### In absolute terms
#
# Means per mission, data in data units, and the mean paired differences with their 95 % intervals,
# each by itself: ▲ the whole interval is above 0, ▼ below it, ≈ around it. A UAV waits while it
# asks for a charging pad and none is free. Its battery is depleted if it is empty before the quota
# is filled.

# %%
for policy in asked.policies:
    display(html.table(asked.amounts(policy), policy))

# %% [markdown]
# ### What common random numbers gained
#
# Baseline and variation meet the same realisations, so what a realisation gives or takes from both
# drops out of the difference. A failed mission counts 0 in collection ratio and communication:
# where failures come in different realisations, there is little to drop out. The table sets the
# pairs beside independent missions: the variance as a share of theirs, by how much the interval is
# narrower, and how many of them the pairs are worth.

# %%
html.table(asked.pairing(), f"Differences of n = {asked.missions:,} pairs")

# %% [markdown]
# ## Two missions to look at
#
# They are of the best policy in the variation, unless the parameter `shown` names another. Each is
# one example (n = 1), simulated in the same realisation of the baseline and of the variation.

# %% [markdown]
# ### A typical one
#
# Of all differences in collection ratio and communication, that of this replication is the median.

# %%
typical = asked.typical()
html.say("{effect}\n\n{lines}", effect=typical.effect(), lines=html.commands(typical.commands()))

# %%
html.gallery(typical.drawings())

# %% [markdown]
# ### A bad one
#
# Of all missions of the variation, this is the worst by collection ratio and communication, of
# those alike by collection ratio.

# %%
worst = asked.worst()
html.say("{effect}\n\n{lines}", effect=worst.effect(), lines=html.commands(worst.commands()))

# %%
html.gallery(worst.drawings())

# %% [markdown]
# **How to read the map.** Every sensor node has a colour. An arrow is the move of one mission slot,
# in the colour of the node that was served in most of its communication slots; grey where none was.
# A cross is a slot of hovering, a star a slot of charging. A numbered diamond is where a UAV
# starts, a dot where its mission ends. UAVs that share a path are drawn side by side. y grows
# south.

# %% [markdown]
# ## Ask again, ask more
#
# The first lines make this page. The same question asked again reuses its missions; with more
# `missions` only the others are simulated. `--set` and the parameter `baseline` take every field of
# the scenario, in TOML syntax. In Jupyter, the page's notebook asks what its first cell says.
#
# To turn the question into a sweep, save the other lines as `my-sweep.toml`, add rows (each is a
# variation; the first is the baseline) and run `dess study run my-sweep.toml --out
# results/my-sweep`. With `kind = "grid"` and a table `values` of lists in place of the rows it
# visits every combination.

# %%
command = html.commands([asked.command()])
html.say("{command}\n\n```toml\n{study}```", command=command, study=asked.as_toml())

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([asked.results])

# %% [markdown] tags=["jupyter"]
# ## Sliders
#
# Move the sliders, choose policies, and press *Simulate*. A side that stays where the scenario has
# it is not set; a range is drawn from, mission by mission.

# %% tags=["jupyter"]
from reports.widgets import what_if_panel

what_if_panel(scenario, policies, settings, baseline, results, missions, seed)
