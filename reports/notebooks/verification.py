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
# # Is the simulator right?
#
# The simulator against exact theory, and the model by the STRESS-DES checklist.

# %% tags=["parameters"]
results = "../../results"  # folder of the results folder verification and of those beside it
block = 100  # missions of a block, for the coverage of confidence intervals

# %%
from IPython.display import Markdown, display

from dess.analysis import numbers
from dess.analysis.names import field_named
from dess.analysis.stats.intervals import LEVEL
from dess.analysis.verification import checks, draws
from dess.analysis.verification import figures as drawings
from dess.analysis.verification.suite import Suite
from dess.reports.pages import html, stress_des

# %%
suite = Suite(results)
space = suite.space
level = numbers.format_level(LEVEL)
judged = checks.judge_checks(suite.checks(block))
band = f"the band below, which contains all dots in {level} of such figures."

# %%
html.make_answer(checks.checks_sentence(judged))

# %%
html.lead_figure(
    drawings.plot_rates(suite.rates, space),
    "Mean rate of a lone UAV against its distance from the node",
    f"One of the checks: dots should lie on the curve of theory, and inside {band} "
    f"n = {suite.rates['n'].min():,} communication slots per distance.",
)

# %% [markdown]
# ## How far to trust it

# %%
html.write_markdown("{text}", text=html.escape_sentences(checks.checks_summary(judged)))

# %% [markdown]
# ## Arrivals
#
# The data units that arrive at a node in a slot are Poisson distributed, and independent of other
# nodes and slots.

# %%
html.write_markdown(
    "{verdicts} There are {n:,} logs; the mean is {rate:g} data units per node and slot.",
    verdicts=html.escape_sentences(checks.on_topics(judged, checks.ARRIVALS)),
    rate=space.arrival_rate,
    n=len(suite.realisations),
)

# %%
figures = [
    (
        drawings.plot_fit(fit, name, "data units that arrived"),
        f"{name}: observed and expected numbers",
        f"n = {fit.n:,} counts; expected: Poisson with mean {mean:g}.",
    )
    for name, fit, mean in draws.arrival_fits(suite.arrivals, space.arrival_rate)
    if len(fit.table) > 1
]
html.make_gallery(figures, f"Dots should lie on the bars, and inside {band}")

# %% [markdown]
# ## The channel
#
# The mean rate of a UAV that hovers near one node must equal the integral of δ log<sub>2</sub>(1 +
# SNR) over the shadowing (Figure 1). Every communication in the logs is computed again.

# %%
verdicts = html.escape_sentences(checks.on_topics(judged, checks.CHANNEL))
n = sum((log.events["event"] == "communication").sum() for log in suite.logs)
html.write_markdown("{verdicts} The logs have {n:,} communications.", verdicts=verdicts, n=n)

# %% [markdown]
# ## Conservation, batteries and engines
#
# Data are neither created nor lost, batteries follow their rules, logs add up to the records, and
# missions simulated again with SimPy give the same records.

# %%
kept = checks.on_topics(judged, *checks.BOOKKEEPING)
verdicts, names = map(html.escape_sentences, (kept, suite.names))
html.write_markdown("{verdicts} The missions are those of {names}.", verdicts=verdicts, names=names)

# %% [markdown]
# ## The draws of a mission
#
# Every value is drawn from a uniform distribution.

# %%
display(
    html.write_markdown(
        "{text}", text=html.escape_sentences(checks.on_topics(judged, checks.DRAWS))
    )
)
figures = [
    (
        drawings.plot_fit(fit, field_named(field).label, "value"),
        f"How often each value of the {field_named(field).within} was drawn",
        f"n = {fit.n:,} missions.",
    )
    for field, fit in draws.parameter_fits(suite.missions, space).items()
]
html.make_gallery(
    figures, f"All values should be drawn equally often: dots should lie inside {band}"
)

# %% [markdown]
# ## Coverage of the confidence intervals
#
# The share of intervals of blocks of missions that contain the mean of all missions. Wilson's
# interval of the success is too short where nearly all missions succeed: its exact coverage is the
# known value in the table.

# %%
verdicts = html.escape_sentences(checks.on_topics(judged, checks.COVERAGE))
html.write_markdown(
    "{verdicts} The blocks have missions of {best}.", verdicts=verdicts, best=suite.best
)

# %% [markdown]
# ## Tables

# %%
caption = "Every check: the value known from theory, the value observed, and the verdict"
html.make_table(checks.as_text(judged), caption, wrap=True)

# %% [markdown]
# ## How this page was made
#
# The model by the STRESS-DES checklist (Monks and others 2019, Journal of Simulation 13(1), 55–67).
# Every number is read from the scenario and the manifests of the studies.

# %%
model = stress_des.describe_model(suite.study.manifest, [s.manifest for s in suite.others.values()])
display(Markdown(model.sections["1"]))
display(html.make_table(model.studies, "The studies of these pages (1.3)", wrap=True))
display(Markdown(model.sections["2"]))
html.make_figure(
    drawings.plot_slot(*model.overview),
    "Boxes, one below the other: what happens before the first mission slot and in each",
    "The base model (2.1): a mission slot from top to bottom; the arrow back is the next one. "
    f"n = {space.max_slots:,} slots at most.",
)

# %%
display(Markdown(model.sections["3"]))
display(html.make_table(model.parameters, "All input parameters (3.3)", wrap=True))
Markdown("\n\n".join(model.sections[number] for number in "456"))

# %%
html.provenance_table(suite.studies.values())
