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
from IPython.display import Markdown, display

from analysis import numbers
from analysis.figures import verification as drawings
from analysis.names import METRICS, parameter
from analysis.stats.intervals import LEVEL
from analysis.verification import checks, draws
from analysis.verification.suite import Suite
from reports.pages import html, stress_des

# %%
suite = Suite.load(results)
space, level = suite.space, numbers.level(LEVEL)
judged = checks.judge(suite.checks(block))
band = f"the band below, which holds all dots of {level} of such figures."

# %% [markdown]
# ## What was checked
#
# An exact check fails if its error is above its bound, which is zero or what rounding can do. A
# check of chance has a p-value, corrected by Holm for the number of these checks.

# %%
display(Markdown(checks.overall(judged)))
caption = "Every check: what is known, what was seen, and what follows"
html.table(checks.as_text(judged), caption, wrap=True)

# %% [markdown]
# ## Arrivals
#
# Every node receives Poisson packets, independently of the others and of all before. Counts of a
# node in a slot tell the distribution; counts of a slot over all nodes also whether nodes depend on
# each other, and counts of a node over many slots whether slots do. They come from event logs, one
# per replication, since policies share its arrivals.

# %%
html.say(
    "{verdicts} There are {n:,} logs, and {rate:g} packets per node and slot on average.",
    verdicts=checks.on_topics(judged, checks.ARRIVALS),
    rate=space.arrival_rate,
    n=len(suite.realisations),
)

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
#
# UAVs choose the node that they hear best, so what they collect is no fair sample of the channel.
# Two ways lead around that. A lone UAV that hovers within reach of a single node has no choice: its
# mean rate must be the integral of δ log<sub>2</sub>(1 + SNR) over all shadowing. And each of the
# communications in the logs can be computed once more from the formula, with the shadowing that was
# drawn in that communication slot for every node: which one is heard best, and what it gives.

# %%
html.say(
    "{verdicts} The logs have {n:,} communications.",
    verdicts=checks.on_topics(judged, checks.CHANNEL),
    n=sum((log.events["event"] == "communication").sum() for log in suite.logs),
)

# %%
html.figure(
    drawings.rates(suite.rates, space),
    "Mean rate of a lone UAV against its distance from the node",
    f"Dots should lie on the curve, and inside {band} n = {suite.rates['n'].min():,} communication "
    "slots per distance.",
)

# %% [markdown]
# ## Conservation, batteries and engines
#
# Data are neither made nor lost. Event logs also hold every battery to its rules, slot by slot, and
# add up to the records. Policies share the realisation of a replication. And missions of every
# policy, spread over the study, were simulated again with SimPy.

# %%
verdicts = checks.on_topics(judged, *checks.BOOKKEEPING)
html.say("{verdicts} The missions are those of {names}.", verdicts=verdicts, names=suite.names)

# %% [markdown]
# ## The draws of a mission
#
# Every mission draws its parameters, uniformly and independently, and the initial data of every
# node.

# %%
Markdown(checks.on_topics(judged, checks.DRAWS))

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

# %%
if space.initial_data[0] < space.initial_data[1]:
    initial = suite.missions["initial"].to_numpy()
    caption = "The bars should follow the curve, the density of a sum of uniform variables."
    figure = drawings.initial_data(initial, space)
    alt = "Initial data per mission, and the density of their sum"
    figures.append((figure, alt, f"{caption} n = {len(initial):,} missions."))
html.gallery(figures)

# %% [markdown]
# ## What intervals promise
#
# Of intervals that are each computed from a block of missions, about as many as their level says
# should hold the mean of all. For Student's t it is a little more, since a block is itself a part
# of all. Wilson's interval, for success, cannot keep to a level: a block has a whole number of
# successes, so what its interval holds jumps with their share. How often it does is known exactly,
# from the hypergeometric distribution, and that is what it is held to.

# %%
verdicts = checks.on_topics(judged, checks.COVERAGE)
html.say("{verdicts} Blocks are those of {best}.", verdicts=verdicts, best=suite.best)

# %%
figures = [
    (
        drawings.caterpillar(rows, name),
        f"{name}: intervals of blocks of missions",
        f"The first {min(len(rows), drawings.SHOWN)} of {len(rows):,} blocks; the line is the mean "
        f"of all missions. Of all blocks {rows['holds'].sum():,} of {len(rows):,} hold it. "
        f"n = {block:,} missions per interval, at {level}.",
    )
    for metric, name in METRICS.items()
    if len(rows := suite.blocks(metric, block))
]
html.gallery(figures)

# %% [markdown]
# ## The model, after the STRESS-DES checklist
#
# Monks, Currie, Onggo, Robinson, Kunc and Taylor (2019), *Strengthening the reporting of empirical
# simulation studies: Introducing the STRESS guidelines*, Journal of Simulation 13(1), 55–67. Every
# number is read from the scenario and the manifests of the studies.

# %%
others = [study.manifest for study in suite.others.values()]
model = stress_des.describe(suite.study.manifest, others)
display(Markdown("\n\n".join(model.sections[number] for number in "12")))
html.figure(
    drawings.slot(*model.overview),
    "Boxes, one below the other: what happens before the first mission slot and in each",
    "The base model (2.1): a mission slot from top to bottom; the arrow back is the next one. "
    f"n = {space.max_slots:,} slots at most.",
)

# %%
display(Markdown(model.sections["3"]))
display(html.table(model.parameters, "All input parameters (3.3)", wrap=True))
Markdown("\n\n".join(model.sections[number] for number in "456"))

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance(suite.studies.values())
