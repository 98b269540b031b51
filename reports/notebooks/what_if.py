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
# This page answers one question: what changes if some settings of the scenario change? A baseline
# and a variation of it are simulated with the same random numbers and compared mission by mission.
# A typical mission and a bad mission are shown in detail.

# %% tags=["parameters"]
results = "../../results"  # folder in which the results of the question are kept
settings = {"uavs": 5}  # fields of the scenario that the variation sets
baseline = {"uavs": 3}  # fields that are set in both, where the variation does not set its own
scenario = "paper"  # a shipped scenario, or a TOML file
policies = ["ddqn", "greedy"]  # each policy is compared with itself
missions = 500  # number of missions of every policy, in the baseline and in the variation
seed = 0  # seed of the missions
workers = 1  # processes; more than one is worth its start time from thousands of missions on
yes = False  # True if the missions may take more than an hour
shown = None  # the policy whose missions are drawn; None for the best in the variation

# %%
from IPython.display import display

from analysis import names, what_if
from analysis.questions.what_if import answer, question
from reports.pages import html

# %%
asked = what_if(
    settings, baseline, scenario, policies, missions, seed, results, workers, shown, yes=yes
)
found, table = asked.results, asked.table()

# %% [markdown]
# ## The question
#
# What changes if missions have the settings of the variation instead of those of the baseline? The
# table first lists the fields that the variation changes, then the fields that are set to the same
# value in both, and the fields whose values every mission draws at random. Every policy acts in the
# same number of missions of the baseline and of the variation. In each replication, both have the
# same initial data, arrivals and shadowing, and the same values of all fields that the variation
# does not set.

# %%
name = found.manifest["study"]["scenario"]
html.table(question.listed(found), f"Scenario {name}, {missions:,} missions of each policy")

# %% [markdown]
# ## The answer

# %%
html.say("{answer}", answer=html.composed(asked.answer()))

# %% [markdown]
# These are paired differences with their 95 % confidence intervals. A difference is
# inconclusive if its interval contains 0. A learned policy is used as it was trained. In a setting
# that differs from that of its training, which its model card describes, a newly trained policy may
# do better. Where a field of a section is set, both sides measure what belongs to it, such as the
# age of information.
#
# The figures below show the means of both sides. Their intervals may overlap although the paired
# difference is clearly not zero:

# %%
measured = [metric for metric in answer.measured(found) if found.missions[metric].any()]
caption = f"n = {missions:,} missions per dot, bars are 95 % intervals of the means."
html.gallery(
    [
        (asked.plot_means(metric), f"{name}, baseline and variation", f"{name}. {caption}")
        for metric in (*names.METRICS, *measured)
        for name in [names.metric_name(metric)]
    ]
)

# %% [markdown]
# The next figures show the paired differences, and how they are distributed over the
# single missions (product). A failed mission counts 0, so a pair with
# one failed mission has a large difference.

# %%
pairs, better = f"n = {missions:,} pairs per policy", answer.winners(answer.all_differences(found))
spread = f"{pairs}: {better}. The lower panel is limited to the 5 % and 95 % quantiles."
html.gallery(
    [
        (asked.plot(), "Paired differences of the metrics", f"{pairs}, 95 % intervals."),
        (asked.plot_spread(), "Distribution of the paired differences", spread),
    ]
)

# %% [markdown]
# ### In absolute terms
#
# The tables have means per mission and mean paired differences with their 95 % intervals. Data are
# in data units. The signs mean: ▲ the whole interval is above 0, ▼ it is below 0, ≈ it contains 0.
# A UAV waits while it requests a charging pad and none is free. Its battery counts as depleted if
# it becomes empty before the quota is filled. A side that does not measure something has a dash,
# and then there is no difference.

# %%
for policy in found.policies:
    display(html.table(answer.listed(table, policy), policy))

# %% [markdown]
# ### What common random numbers gained
#
# The baseline and the variation use the same random numbers in each replication (common random
# numbers). What a replication adds to both of them cancels in the difference, so the interval is
# narrower. Little cancels where a mission fails on one side only, since it then counts 0 in
# product. The table compares the pairs with independent missions: the
# variance of the difference as a share of that of independent missions, how much narrower the
# interval is, and how many independent missions would give the same precision.

# %%
html.table(answer.pairing(table), f"Differences of n = {missions:,} pairs")

# %% [markdown]
# ## Two missions to look at
#
# The missions are those of the policy that is best in the variation, unless the parameter `shown`
# names another policy. Each is a single example (n = 1): one replication, simulated in the baseline
# and in the variation.

# %% [markdown]
# ### A typical mission
#
# This replication has the median of all differences in product.

# %%
typical = asked.typical()
lines = html.commands(typical.commands())
html.say("{effect}\n\n{lines}", effect=html.composed(typical.effect()), lines=lines)

# %%
html.gallery(typical.drawings())

# %% [markdown]
# ### A bad mission
#
# This is the worst mission of the variation by product; if several are
# equally bad, the one with the lowest collection ratio.

# %%
worst = asked.worst()
lines = html.commands(worst.commands())
html.say("{effect}\n\n{lines}", effect=html.composed(worst.effect()), lines=lines)

# %%
html.gallery(worst.drawings())

# %% [markdown]
# **How to read the map.** Every sensor node has a colour. An arrow is the move of a
# UAV in one mission slot; it has the colour of the node that was served in most communication slots
# of that slot, and is grey if no node was served. A cross is a slot in which the UAV hovered, a
# star a slot in which it charged. A UAV starts at a numbered diamond, and its mission ends at a
# dot. UAVs on the same path are drawn side by side. The y axis points south.

# %% [markdown]
# ## Change the question
#
# The first command below makes this page again. Missions that were simulated before are reused, so
# with more `missions` only the additional ones are simulated. `--set` and the parameter `baseline`
# accept every field of the scenario, in TOML syntax. You can also open the notebook of this page in
# Jupyter, change its first cell and run all cells.
#
# To compare more than one variation, save the TOML lines as `my-sweep.toml` and add rows: the first
# row is the baseline, every other row a variation. Then run `dess study run my-sweep.toml --out
# results/my-sweep`. With `kind = "grid"` and a table `values` of lists in place of the rows, the
# study simulates every combination of the values.

# %%
command = html.commands([question.command(found)])
study = html.block("toml", question.as_toml(found).rstrip("\n"))
html.say("{command}\n\n{study}", command=command, study=study)

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([found])
