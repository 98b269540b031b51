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

from analysis import resimulate
from analysis.figures import what_if as figures
from analysis.figures.missions import mission_figure
from analysis.names import METRICS
from analysis.questions.what_if import answer as what_if_answer
from analysis.questions.what_if import question as what_if
from reports.pages import html

# %%
question = what_if.question(settings, baseline, scenario, policies, missions, seed)
what_if.check_policy(question, shown or question.policies[0])
study = what_if.ask(question, results, workers)
sides = what_if.settings_of(study)
policy = shown or what_if_answer.best_policy(study, what_if.VARIATION)
means, answers = what_if_answer.means(study), what_if_answer.answers(study)

# %% [markdown]
# ## The question
#
# What if a mission had the settings of the variation in place of those of the baseline? The table
# has the fields of the scenario that the variation changes; then those that are set in both, and
# those that every mission draws for itself, in both alike. Every policy acts in as many missions of
# the baseline as of the variation. Replication by replication, all that the variation does not set
# is equal: initial data, arrivals and shadowing.

# %%
name = study.manifest["study"]["scenario"]
html.table(what_if.listed(study), f"Scenario {name}, {missions:,} missions of each policy")

# %% [markdown]
# ## The answer

# %%
html.say(
    "{conclusions}\n\nThe highest mean: in the baseline {before}; in the variation {after}.",
    conclusions=what_if_answer.conclusions(answers),
    before=what_if_answer.best_of_side(study, what_if.BASELINE),
    after=what_if_answer.best_of_side(study, what_if.VARIATION),
)

# %% [markdown]
# These are paired differences, each with its 95 % interval; what is inconclusive has 0 in it. A
# learned policy acts as it was trained: in a setting unlike that of its training, which its model
# card describes, a new training may do better.
#
# Means of the two sides may have overlapping intervals where their paired difference is clear:

# %%
html.gallery(
    [
        (
            figures.means(means, metric, sides),
            f"{name}, baseline and variation",
            f"{name}. n = {missions:,} missions per dot, bars are 95 % intervals of the means.",
        )
        for metric, name in METRICS.items()
    ]
)

# %% [markdown]
# The answer, and what single missions gain or lose in collection ratio and communication. A mission
# that fails counts 0: pairs of which one failed lie far out.

# %%
spread = {policy: what_if_answer.differences(study, policy) for policy in study.policies}
pairs = f"n = {missions:,} pairs per policy"
caption = (
    f"{pairs}: {what_if_answer.winners(spread)}. Below: between the quantiles of 5 % and 95 %."
)
html.gallery(
    [
        (figures.gains(answers), "Paired differences of the metrics", f"{pairs}, 95 % intervals."),
        (figures.spread(spread), "Distribution of the paired differences", caption),
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
for policy in study.policies:
    display(html.table(what_if_answer.listed(answers, policy), policy))

# %% [markdown]
# ### What common random numbers gained
#
# Baseline and variation meet the same realisations, so what a realisation gives or takes from both
# drops out of the difference. A failed mission counts 0 in collection ratio and communication:
# where failures come in different realisations, there is little to drop out. The table sets the
# pairs beside independent missions: the variance as a share of theirs, by how much the interval is
# narrower, and how many of them the pairs are worth.

# %%
html.table(what_if_answer.pairing(answers), f"Differences of n = {missions:,} pairs")

# %% [markdown]
# ## Two missions to look at
#
# They are of the best policy in the variation, unless the parameter `shown` names another. Each is
# one example (n = 1), simulated in the same realisation of the baseline and of the variation.


# %%
def pictured(point: int, replication: int) -> tuple:
    """A mission of the policy, simulated again: its drawing, alternative text and caption."""
    mission = resimulate(study, policy, point, replication)
    caption = what_if_answer.outcome(study, policy, point, replication)
    drawing = mission_figure(mission.events, mission.scenario)
    return drawing, "Map of the mission; battery, residual data and charging", caption


def show(replication: int) -> None:
    """A replication in the baseline and in the variation."""
    effect = what_if_answer.effect(study, policy, replication)
    commands = html.commands(what_if_answer.commands(study, policy, replication))
    drawings = [pictured(point, replication) for point in (what_if.BASELINE, what_if.VARIATION)]
    display(html.say(effect), html.say("{lines}", lines=commands), html.gallery(drawings))


# %% [markdown]
# ### A typical one
#
# Of all differences in collection ratio and communication, that of this replication is the median.

# %%
show(what_if_answer.typical(study, policy))

# %% [markdown]
# ### A bad one
#
# Of all missions of the variation, this is the worst by collection ratio and communication, of
# those alike by collection ratio.

# %%
show(what_if_answer.worst(study, policy))

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
command = html.commands([what_if.command(study)])
html.say("{command}\n\n```toml\n{study}```", command=command, study=what_if.as_toml(study))

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([study])
