# ---
# jupyter:
#   dess:
#     studies: [verification]
#     optional: ["*"]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Verification
#
# This page compares the simulator with exact theory: the random draws, the channel, queues and the
# age of information, the conservation of data, the batteries, both engines, and the coverage of all
# confidence intervals. It also describes the model according to the STRESS-DES checklist.

# %% tags=["parameters"]
results = "../../results"  # folder of the results folder verification and of those beside it
block = 100  # missions of a block, for the coverage of confidence intervals

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
band = f"the band below, which contains all dots in {level} of such figures."

# %% [markdown]
# ## What was checked
#
# An exact check fails if an error is above its bound: zero or the largest possible rounding error.
# A statistical one fails if its p-value, corrected for their number (Holm), is too small.

# %%
display(html.say("{text}", text=html.composed(checks.overall(judged))))
caption = "Every check: the value known from theory, the value observed, and the verdict"
html.table(checks.as_text(judged), caption, wrap=True)

# %% [markdown]
# ## Arrivals
#
# The data units that arrive at a node in a slot are Poisson distributed, and independent of other
# nodes and slots: so are those at all nodes in a slot, and at a node over many slots. The counts
# come from one event log per replication, since all policies meet the same arrivals.

# %%
html.say(
    "{verdicts} There are {n:,} logs; the mean is {rate:g} data units per node and slot.",
    verdicts=html.composed(checks.on_topics(judged, checks.ARRIVALS)),
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
# A UAV serves the node with the highest SNR, so its data are not a random sample of the channel.
# First, therefore, a single UAV hovers near a single node; its mean rate must equal the integral of
# δ log<sub>2</sub>(1 + SNR) over the distribution of shadowing. Second, every communication in the
# event logs is computed again with the shadowing of that communication slot for every node: which
# node has the highest SNR, and how much data it sends.

# %%
verdicts = html.composed(checks.on_topics(judged, checks.CHANNEL))
n = sum((log.events["event"] == "communication").sum() for log in suite.logs)
display(html.say("{verdicts} The logs have {n:,} communications.", verdicts=verdicts, n=n))
html.figure(
    drawings.rates(suite.rates, space),
    "Mean rate of a lone UAV against its distance from the node",
    f"Dots should lie on the curve, and inside {band} n = {suite.rates['n'].min():,} communication "
    "slots per distance.",
)

# %% [markdown]
# ## Queues and the age of information
#
# UAVs come to the charging zone as a Poisson process, and charge for exponential (M/M/c) or fixed
# times (M/D/1). Packets fill a node's buffer, which a server empties in exponential times (M/M/1;
# with K places, M/M/1/K), or a UAV of a mission at fixed times (M/D/1). The age is known for M/M/1
# and for visits at fixed or exponential gaps. Thinned arrivals must fit the integrated rate.

# %%
html.say("{verdicts}", verdicts=html.composed(checks.on_topics(judged, checks.QUEUES)))

# %% [markdown]
# ## Conservation, batteries and engines
#
# Data are neither created nor lost, every battery follows its rules in every slot of the logs, the
# logs add up to the records, all policies meet the same random draws in a replication, and missions
# simulated again with SimPy give the same records.

# %%
kept = checks.on_topics(judged, *checks.BOOKKEEPING)
verdicts, names = map(html.composed, (kept, suite.names))
html.say("{verdicts} The missions are those of {names}.", verdicts=verdicts, names=names)

# %% [markdown]
# ## The draws of a mission
#
# Every mission draws its parameters and the initial data of every node from uniform distributions.

# %%
display(html.say("{text}", text=html.composed(checks.on_topics(judged, checks.DRAWS))))
figures = [
    (
        drawings.fit(fit, parameter(field).label, "value"),
        f"How often each value of the {parameter(field).within} was drawn",
        f"All values should be drawn equally often, so the dots should lie inside {band} "
        f"n = {fit.n:,} missions.",
    )
    for field, fit in draws.parameter_fits(suite.missions, space).items()
]

# %%
if space.initial_data[0] < space.initial_data[1]:
    initial = suite.missions["initial"].to_numpy()
    caption = "The bars should follow the curve, the density of a sum of uniform variables."
    alt = "Initial data per mission, and the density of their sum"
    caption += f" n = {len(initial):,} missions."
    figures.append((drawings.initial_data(initial, space), alt, caption))
html.gallery(figures)

# %% [markdown]
# ## Coverage of the confidence intervals
#
# An interval is computed from each block of missions. The share of intervals that contain the mean
# of all missions is their coverage. For Student's t it should be a little above the level, because
# a block is itself a part of all missions. For Wilson's interval, used for success, the exact
# coverage is known from the hypergeometric distribution, and is compared here.

# %%
verdicts = html.composed(checks.on_topics(judged, checks.COVERAGE))
html.say("{verdicts} The blocks have missions of {best}.", verdicts=verdicts, best=suite.best)

# %%
figures = [
    (
        drawings.caterpillar(rows, name),
        f"{name}: intervals of blocks of missions",
        f"The first {min(len(rows), drawings.SHOWN)} of {len(rows):,} blocks; the line is the mean "
        f"of all missions, which {rows['holds'].sum():,} of the {len(rows):,} intervals contain. "
        f"n = {block:,} missions per interval, at {level}.",
    )
    for metric, name in METRICS.items()
    if len(rows := suite.blocks(metric, block))
]
html.gallery(figures)

# %% [markdown]
# ## The model, described by the STRESS-DES checklist
#
# Monks, Currie, Onggo, Robinson, Kunc and Taylor (2019), *Strengthening the reporting of empirical
# simulation studies: Introducing the STRESS guidelines*, Journal of Simulation 13(1), 55–67. Every
# number is read from the scenario and the manifests of the studies.

# %%
model = stress_des.describe(suite.study.manifest, [s.manifest for s in suite.others.values()])
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
