# ---
# jupyter:
#   dess:
#     studies: [verification]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Verification
#
# The simulator beside what is known of it in closed form: the draws, the channel, the conservation
# of data, the batteries, both engines, and what the intervals of all pages promise. Then the model,
# described after the STRESS-DES checklist.

# %% tags=["parameters"]
results = "../../results"  # folder of the results folder verification and of those beside it
block = 100  # missions of a block, whose interval is to hold the mean of all

# %%
import numpy as np
from IPython.display import Markdown, display

from analysis import numbers
from analysis.figures import verification as drawings
from analysis.names import METRICS, parameter
from analysis.stats.intervals import LEVEL
from analysis.verification import checks, closed_forms, draws
from analysis.verification.suite import Suite
from reports.pages import html, stress

# %%
suite = Suite.load(results)
space, level = suite.space, numbers.level(LEVEL)
judged = checks.judge(suite.checks(block))
band = f"the band below, which holds all dots of {level} of such figures."

# %% [markdown]
# ## What was checked

# %%
html.say(
    "{overall} {exact} are exact: an error above its bound, which is zero or what rounding can do, "
    "refutes. {chance} are of chance: they have a p-value, corrected by Holm for their number and "
    "judged at {alpha}. So if all is as it should be, any of them fails for at most one seed in "
    "{seeds:.0f}.",
    overall=checks.overall(judged),
    exact=judged["error"].count(),
    chance=judged["p"].count(),
    alpha=numbers.level(checks.ALPHA),
    seeds=1 / checks.ALPHA,
)

# %%
caption = "Every check: what is known, what was seen, and what follows"
html.table(checks.as_text(judged), caption, wrap=True)

# %% [markdown]
# ## Arrivals

# %%
html.say(
    "{verdicts} Every node receives Poisson packets, {rate:g} per mission slot on average. The "
    "counts come from {n:,} event logs, one per replication, since policies share its arrivals.",
    verdicts=checks.on_topics(judged, checks.ARRIVALS),
    rate=space.arrival_rate,
    n=len(suite.realisations),
)

# %% [markdown]
# Packets are independent of those at other nodes and of all before. Counts of a node in a slot tell
# the distribution; counts of a slot over all nodes also whether nodes depend on each other, and
# counts of a node over many slots whether slots do.

# %%
figures = [
    (
        drawings.fit(fit, name, "data units that arrived"),
        f"{name}: observed and expected numbers",
        f"Dots should lie on the bars, and inside {band} n = {fit.n:,} counts; expected: Poisson "
        f"with mean {mean:g}.",
    )
    for name, fit, mean in draws.arrival_fits(suite.arrivals, space.arrival_rate)
    if len(fit.table) > 1
]
html.gallery(figures)

# %% [markdown]
# ## The channel

# %%
html.say(
    "{verdicts} The logs have {n:,} communications.",
    verdicts=checks.on_topics(judged, checks.CHANNEL),
    n=sum((log.events["event"] == "communication").sum() for log in suite.logs),
)

# %% [markdown]
# UAVs choose the node that they hear best, so what they collect is no fair sample of the channel.
# Two ways lead around that. A lone UAV that hovers within reach of a single node has no choice: its
# mean rate must be the integral of δ log<sub>2</sub>(1 + SNR) over all shadowing. And each of the
# communications in the logs can be computed once more from the formula, with the shadowing that was
# drawn in that communication slot for every node: which one is heard best, and what it gives.

# %%
html.figure(
    drawings.rates(suite.rates, space),
    "Mean rate of a lone UAV against its distance from the node",
    f"Dots should lie on the curve, and inside {band} n = {suite.rates['n'].min():,} communication "
    "slots per distance.",
)

# %% [markdown]
# ## Conservation, batteries and engines

# %%
topics = ("CONSERVATION", "ENERGY", "RECORDS", "REALISATIONS", "ENGINES")
html.say(
    "{verdicts} Data are neither made nor lost: not in the missions of {studies}, and not at any "
    "node in {n:,} event logs.",
    verdicts=checks.on_topics(judged, *(getattr(checks, topic) for topic in topics)),
    studies=suite.names,
    n=len(suite.logs),
)

# %% [markdown]
# The logs also hold every battery to its rules, slot by slot, and add up to the records. Policies
# share the realisation of a replication. And missions of every policy, spread over the study, were
# simulated again with SimPy.

# %% [markdown]
# ## The draws of a mission

# %%
html.say(
    "{verdicts} Every mission draws its parameters, uniformly and independently, and the initial "
    "data of every node.",
    verdicts=checks.on_topics(judged, checks.DRAWS),
)

# %%
figures = [
    (
        drawings.fit(fit, parameter(field).label, "value"),
        f"How often each value of the {parameter(field).within} was drawn",
        f"All values should be drawn equally often, and dots lie inside {band} n = {fit.n:,} "
        "missions.",
    )
    for field, fit in draws.parameter_fits(suite.missions, space).items()
]
initial = suite.missions["initial"].to_numpy()

# %%
caption = (
    f"The bars should follow the curve, the density of a sum of {len(space.nodes)} uniform "
    f"variables. n = {len(initial):,} missions."
)
if np.ptp(space.initial_data):
    law, axis = closed_forms.initial_total(space), "data units, all nodes together"
    figure = drawings.totals(initial, law, "Initial data of a mission", axis)
    figures.append((figure, "Initial data per mission, and the density of their sum", caption))
html.gallery(figures)

# %% [markdown]
# ## What intervals promise

# %%
html.say(
    "{verdicts} The {n:,} missions of {best} in blocks of {block:,}: of intervals at {level}, each "
    "computed from a block, about that share should hold the mean of all.",
    verdicts=checks.on_topics(judged, checks.COVERAGE),
    n=len(suite.missions),
    best=suite.best,
    block=block,
    level=level,
)

# %% [markdown]
# For Student's t it is a little more, since a block is itself a part of all. Wilson's interval, for
# success, cannot keep to a level: a block has a whole number of successes, so what its interval
# holds jumps with their share. How often it does is known exactly, from the hypergeometric
# distribution, and that is what it is held to.

# %%
blocks = {name: suite.blocks(metric, block) for metric, name in METRICS.items()}
figures = [
    (
        drawings.caterpillar(rows, name),
        f"{name}: intervals of blocks of missions",
        f"The first {min(len(rows), drawings.SHOWN)} of {len(rows):,} blocks; the line is the mean "
        f"of all missions. Of all blocks {rows['holds'].sum():,} of {len(rows):,} hold it. "
        f"n = {block:,} missions per interval, at {level}.",
    )
    for name, rows in blocks.items()
    if len(rows)
]
html.gallery(figures)

# %% [markdown]
# ## The model, after the STRESS-DES checklist
#
# Monks, Currie, Onggo, Robinson, Kunc and Taylor (2019), *Strengthening the reporting of empirical
# simulation studies: Introducing the STRESS guidelines*, Journal of Simulation 13(1), 55–67. Every
# number is read from the scenario and the manifests of the studies.

# %%
manifests = [study.manifest for study in suite.studies.values()]
model = stress.describe(*manifests[:1], manifests[1:])
display(Markdown("\n\n".join(model.sections[number] for number in "12")))
html.figure(
    drawings.slot(*model.overview),
    "Boxes, one below the other: what happens before the first mission slot and in each",
    "The base model (2.1): a mission slot from top to bottom; the arrow back is the next one. "
    f"n = {space.max_slots:,} slots at most.",
)

# %%
display(Markdown(model.sections["3"]))
html.table(model.parameters, "All input parameters (3.3)", wrap=True)

# %%
Markdown("\n\n".join(model.sections[number] for number in "456"))

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance(suite.studies.values())
