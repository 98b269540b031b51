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
results = "../../results"  # folder that holds the results folder of the study verification
again = 50  # missions of every policy to fly again with the SimPy engine
block = 100  # missions of a block, whose interval is to hold the mean of all

# %%
from pathlib import Path

import numpy as np
import pandas as pd
from IPython.display import Markdown, display

from analysis import load_results, numbers
from analysis.figures import verification as drawings
from analysis.names import METRICS, parameter
from analysis.questions import summary as findings
from analysis.stats.intervals import LEVEL
from analysis.stats.verdict import HOLDS, INCONCLUSIVE, REFUTED
from analysis.verification import chance as fits
from analysis.verification import closed_forms
from analysis.verification import exact as audits
from analysis.verification import lone_uav as hover
from analysis.verification.checks import ALPHA, judge
from reports.pages import html, stress

study = load_results(Path(results) / "verification")
others, damaged = audits.studies_in(Path(results), but="verification")
studies = {"verification": study, **others}
space, seed = study.scenario(), study.manifest["seed"]
logs = audits.logs_of(study)
seas = audits.longest(logs)
best = findings.best_policy(study.missions)

# Replications share what they draw, so the missions of one policy have all of it.
missions = study.missions.query("policy == @study.policies[0] and point == 0")
of_best = study.missions.query("policy == @best and point == 0")
counts = audits.arrivals(seas, space)
starts = np.array([log.initial for log in seas]).reshape(-1, len(space.nodes))
cells = np.array([log.first_cell for log in seas])
rates, deviates = hover.rates(space, seed), hover.deviates(space, seed)

table = judge(
    [
        *fits.arrival_checks(counts, space.arrival_rate),
        fits.arrived_check(missions, space),
        fits.rate_check(rates),
        *fits.shadowing_checks(deviates),
        *audits.channel_checks(logs, seed),
        audits.conservation_check(studies),
        audits.balance_check(logs),
        audits.battery_check(logs),
        audits.record_check(logs),
        *audits.sea_checks(study, logs),
        audits.engine_check(study, again),
        *fits.parameter_checks(missions, space),
        *fits.initial_checks(starts, missions["initial"].to_numpy(), space),
        fits.start_check(cells, space),
        *(
            fits.coverage_check(name, of_best[metric].to_numpy(), block, metric == "success")
            for metric, name in METRICS.items()
        ),
    ]
)


def told(row):
    """The p-value and its correction, or the error and its bound."""
    if not np.isnan(row.p):
        return f"p {numbers.p_value(row.p)}, Holm {numbers.p_value(row.p_adjusted)}"
    if np.isnan(row.error):
        return ""
    return (
        f"error {row.error:.2g}, allowed {row.bound:.2g}" if row.bound else f"error {row.error:g}"
    )


def verdicts(*topics):
    """The verdicts of some topics, in words."""
    rows = table[table["topic"].isin(topics)]
    sorted_out = [
        f"{verdict}: {numbers.words(rows.loc[rows['verdict'] == verdict, 'test'].tolist())}"
        for verdict in (REFUTED, INCONCLUSIVE)
        if (rows["verdict"] == verdict).any()
    ]
    holding = (rows["verdict"] == HOLDS).sum()
    return f"**{holding} of {len(rows)} checks hold**" + "".join(f"; {s}" for s in sorted_out) + "."


# %% [markdown]
# ## What was checked

# %%
chance, exact = table["p"].notna(), table["error"].notna()
refuted = table.loc[table["verdict"] == REFUTED, "test"].tolist()
unknown = table.loc[table["verdict"] == INCONCLUSIVE, "test"].tolist()
display(
    Markdown(
        (
            f"**{len(refuted)} of {len(table)} checks do not hold**: {numbers.words(refuted)}."
            if refuted
            else f"**{(table['verdict'] == HOLDS).sum()} of {len(table)} checks hold"
            + ("**; the others cannot be told." if unknown else "**.")
        )
        + f" {exact.sum()} are exact: an error above its bound, which is zero or what rounding can "
        f"do, refutes. {chance.sum()} are of chance: they have a p-value, corrected by Holm for "
        f"their number and judged at {numbers.level(ALPHA)}. So if all is as it should be, any of "
        f"them fails for at most one seed in {1 / ALPHA:.0f}."
        + (f" Too few observations for: {numbers.words(unknown)}." if unknown else "")
    )
)
html.table(
    pd.DataFrame(
        {
            "Test": table["test"],
            "Verdict": table["verdict"],
            "Known": table["known"],
            "Seen": table["seen"],
            "p-value or error": [told(row) for row in table.itertuples()],
            "n": table["n"].map("{:,}".format),
        }
    ),
    "Every check: what is known, what was seen, and what follows",
    wrap=True,
)

# %% [markdown]
# ## Arrivals

# %%
panels = fits.arrival_fits(counts, space.arrival_rate) if space.arrival_rate else []
display(
    Markdown(
        f"{verdicts(fits.ARRIVALS)} Every node receives Poisson packets, {space.arrival_rate:g} "
        "per mission slot on average, independently of the others and of all before. Counts of a "
        "node in a slot tell the distribution; counts of a slot over all nodes also whether nodes "
        "depend on each other, and counts of a node over many slots whether slots do. They come "
        f"from {len(seas):,} event logs, one per replication, since policies share its arrivals."
    )
)
html.gallery(
    [
        (
            drawings.fit(
                fit,
                name,
                "data units that arrived",
                logarithmic=fit.table["expected"].max() > 100 * fit.table["expected"].min(),
            ),
            f"{name}: observed and expected numbers",
            f"Dots should lie on the bars, and inside the band below, which holds all dots of "
            f"{numbers.level(LEVEL)} of such figures. n = {fit.n:,} counts; expected: Poisson with "
            f"mean {mean:g}.",
        )
        for name, fit, mean in panels
        if len(fit.table) > 1
    ]
)

# %% [markdown]
# ## The channel

# %%
communications = sum((log.events["event"] == "communication").sum() for log in logs)
display(
    Markdown(
        f"{verdicts(fits.CHANNEL)} UAVs choose the node that they hear best, so what they collect "
        "is no fair sample of the channel. Two ways lead around that. A lone UAV that hovers "
        "within reach of a single node has no choice: its mean rate must be the integral of "
        "δ log<sub>2</sub>(1 + SNR) over all shadowing. And each of the "
        f"{communications:,} communications in the logs can be computed once more from the "
        "formula, with the shadowing that was drawn in that communication slot for every node: "
        "which one is heard best, and what it gives."
    )
)
html.figure(
    drawings.rates(rates, space),
    "Mean rate of a lone UAV against its distance from the node",
    f"Dots should lie on the curve, and inside the band below, which holds all dots of "
    f"{numbers.level(LEVEL)} of such figures. n = {rates['n'].min():,} communication slots per "
    "distance.",
)

# %% [markdown]
# ## Conservation, batteries and engines

# %%
topics = [audits.CONSERVATION, audits.ENERGY, audits.RECORDS, audits.SEA, audits.ENGINES]
unread = f" (not read, incomplete or of other code: {numbers.words(damaged)})" if damaged else ""
display(
    Markdown(
        f"{verdicts(*topics)} Data are neither made nor lost: not in the missions of "
        f"{numbers.words([f'`{name}`' for name in studies])}{unread}, and not at any node in "
        f"{len(logs):,} event logs. The logs also hold every battery to its rules, slot by slot, "
        "and add up to the records. "
        + ("Policies meet the same sea. " if len(study.policies) > 1 else "")
        + "And missions of every policy, spread over the study, were flown again with SimPy."
    )
)

# %% [markdown]
# ## The draws of a mission

# %%
display(
    Markdown(
        f"{verdicts(fits.DRAWS)} Every mission draws its parameters, uniformly and independently, "
        "and the initial data of every node."
    )
)
drawn = [
    (
        drawings.fit(fit, parameter(field).label, "value"),
        f"How often each value of the {parameter(field).within} was drawn",
        f"All values should be drawn equally often. n = {fit.n:,} missions. The band holds all "
        f"dots of {numbers.level(LEVEL)} of such figures.",
    )
    for field, fit in fits.parameter_fits(missions, space).items()
]
if space.initial_data[0] < space.initial_data[1]:
    drawn.append(
        (
            drawings.totals(
                missions["initial"].to_numpy(),
                closed_forms.initial_total(space),
                "Initial data of a mission",
                "data units, all nodes together",
            ),
            "Initial data per mission, and the density of their sum",
            f"The bars should follow the curve, the density of a sum of {len(space.nodes)} uniform "
            f"variables. n = {len(missions):,} missions.",
        )
    )
html.gallery(drawn)

# %% [markdown]
# ## What intervals promise

# %%
blocks = {
    metric: fits.blocks(of_best[metric].to_numpy(), block, metric == "success")
    for metric in METRICS
}
held = {metric: f"{rows['holds'].sum():,} of {len(rows):,}" for metric, rows in blocks.items()}
display(
    Markdown(
        f"{verdicts(fits.COVERAGE)} The {len(of_best):,} missions of {best} in blocks of "
        f"{block:,}: of intervals at {numbers.level(LEVEL)}, each computed from a block, about that "
        "share should hold the mean of all. For Student's t it is a little more, since a block is "
        "itself a part of all. Wilson's interval, for success, cannot keep to a level: a block has "
        "a whole number of successes, so what its interval holds jumps with their share. How often "
        "it does is known exactly, from the hypergeometric distribution, and that is what it is "
        "held to."
    )
)
html.gallery(
    [
        (
            drawings.caterpillar(rows, of_best[metric].head(len(rows) * block).mean(), name),
            f"{name}: intervals of blocks of missions",
            f"The first {min(len(rows), drawings.SHOWN)} of {len(rows):,} blocks; the line is the "
            f"mean of all missions. Of all blocks {held[metric]} hold it. n = {block:,} missions "
            f"per interval, at {numbers.level(LEVEL)}.",
        )
        for metric, name in METRICS.items()
        if len(rows := blocks[metric])
    ]
)

# %% [markdown]
# ## The model, after the STRESS-DES checklist
#
# Monks, Currie, Onggo, Robinson, Kunc and Taylor (2019), *Strengthening the reporting of empirical
# simulation studies: Introducing the STRESS guidelines*, Journal of Simulation 13(1), 55–67. Every
# number is read from the scenario and the manifests of the studies.

# %%
model = stress.describe(study.manifest, [each.manifest for each in others.values()])
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
html.provenance(studies.values())
