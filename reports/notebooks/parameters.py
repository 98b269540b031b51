# ---
# jupyter:
#   dess:
#     studies: [fig5, sweet-spot, sensitivity]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Scenario parameters
#
# What the number of UAVs, the charging thresholds, the initial data and the flying time do to a
# mission: one by one as in the paper's Fig. 5, all together at the best setting, and as shares of
# the variance.

# %% tags=["parameters"]
results = "../../results"  # folder with the results folders of fig5, sweet-spot and sensitivity
learned = None  # the learned policy to show; None for the best of the study, if there is one
heuristic = None  # the other policy to show; None for the best that has not learned

# %%
from pathlib import Path

import pandas as pd
from IPython.display import Markdown, display

from analysis import load_results, numbers, summary
from analysis.figures import parameters as parameter_figures
from analysis.figures.policies import performance
from analysis.names import METRICS, PRODUCT, parameter, value_text
from analysis.questions import main_effects as effects
from analysis.questions import summary as findings
from analysis.replication import paper
from analysis.replication.claims import FIG_5
from analysis.replication.rules import NO_RESULTS, margin_in_words
from analysis.replication.scorecard import counted, listed, margin, of_policy
from analysis.stats.intervals import LEVEL
from analysis.study.design import NOISE
from reports.pages import html

folder = Path(results)
level = numbers.level(LEVEL)
fig5, sweet, sobol = (load_results(folder / n) for n in ("fig5", "sweet-spot", "sensitivity"))

means = summary(fig5.missions, by=["policy"])
ranked = means[means["metric"] == PRODUCT].sort_values("mean", ascending=False)["policy"]
taught = {policy for those in findings.learners(fig5).values() for policy in those}
learned = learned or next((policy for policy in ranked if policy in taught), None)
heuristic = heuristic or next((policy for policy in ranked if policy not in taught), None)
drawn = [policy for policy in (learned, heuristic) if policy]
leading = drawn[0]

table = effects.effects(fig5)
table = table[table["policy"].isin(drawn)]
fields = [f for f, own in table.groupby("field", sort=False) if own["position"].nunique() > 1]
values = {
    field: table[table["field"] == field].drop_duplicates("position")["value"].tolist()
    for field in fields
}
pairs = {
    (policy, field, metric): effects.changes(fig5, table, policy, field, metric)
    for policy in drawn
    for field in fields
    for metric in ("success", PRODUCT)
}


# %% [markdown]
# ## <a id="fig-5"></a>One by one: the paper's Fig. 5

# %%
display(
    Markdown(
        f"Shown {'are' if len(drawn) > 1 else 'is'} "
        + numbers.words([f"**{policy}**" for policy in drawn])
        + (": the best learned policy of the study, and the best heuristic" if learned else "")
        + f". Every value of a parameter was flown in {table['n'].min():,} missions per policy, "
        "everything else drawn from Table II. All values, and all policies, meet the same "
        "missions otherwise. So the lowest panel shows more than the others: the change from the "
        "first value on, mission by mission, without what the missions have in common. Its axis is "
        "its own; those of the metrics are the same for all parameters."
    )
)


# %%
def captioned(field):
    changes = {policy: pairs[policy, field, PRODUCT] for policy in drawn}
    shapes = [f"{policy} {effects.shape(own).words}" for policy, own in changes.items()]
    caption = (
        f"Collection ratio and communication: {'; '.join(shapes)}. n = "
        f"{table.loc[table['field'] == field, 'n'].min():,} missions per point, bars are "
        f"{level} intervals."
    )
    figure = parameter_figures.effect(table, field, changes, fig5.policies)
    return figure, f"The three metrics against the {parameter(field).within}", caption


html.gallery([captioned(field) for field in fields])

# %% [markdown]
# ### What one sees
#
# Two values differ if they do mission by mission, at the 5 % level after Holm's correction for the
# number of pairs. Along the values, a metric *rises* if some values differ and all that do go up,
# *falls* if all go down, *stays level* if none differ; *rises, then falls* if nothing before a
# value falls and nothing behind it rises.


# %%
def at(policy, field, position):
    rows = table[(table["policy"] == policy) & (table["field"] == field)]
    (row,) = rows[(rows["metric"] == PRODUCT) & (rows["position"] == position)].itertuples()
    return row


def seen(policy, field):
    """How collection ratio and communication goes along a parameter, in words."""
    found = effects.shape(pairs[policy, field, PRODUCT])
    first, last = (at(policy, field, n) for n in (0, len(values[field]) - 1))
    change = pairs[policy, field, PRODUCT].query("first == 0 and second == @last.position").iloc[0]
    ends = numbers.points(change["difference"], change["low"], change["high"])
    text = (
        f"{policy} **{found.words}**: {numbers.percent(first.mean)} at {first.value}, "
        f"{numbers.percent(last.mean)} at {last.value}, {ends} points"
    )
    if found.words == effects.PEAK:
        tops = numbers.words([values[field][n] for n in found.peaks])
        text += f", highest at {tops}{' or so' if len(found.peaks) > 1 else ''}"
    return text


lines = [
    f"- **{parameter(field).name}**" + "".join(f"\n    - {seen(policy, field)}" for policy in drawn)
    for field in fields
]
display(Markdown("Collection ratio and communication, from the first value to the last:"))
display(Markdown("\n".join(lines)))

# %% [markdown]
# ### What the paper sees

# %%
too_little = margin_in_words(margin({"sweet-spot": sweet}))  # to matter
of_leading = of_policy({"fig5": fig5, "sweet-spot": sweet}, leading, FIG_5)
claims = [row for row in of_leading if row.findings[0].verdict != NO_RESULTS]
display(
    Markdown(
        f"The claims of the paper on its Fig. 5, and what they are worth for {leading}; by the "
        "rules of the replication scorecard. One is inconclusive where the missions are too few "
        "for either answer.\n\n" + listed(claims)
    )
)

# %%
sizes = {field: max(pairs[leading, field, PRODUCT]["difference"].abs()) for field in fields}
order = sorted(fields, key=sizes.get, reverse=True)
display(
    Markdown(
        f"So for {leading}, of {len(claims)} claims, {counted(claims)}. They overlap, so their "
        "number is no score. By the largest difference between two values, the "
        "parameters rank: "
        + numbers.words([f"{parameter(f).within} ({100 * sizes[f]:.1f} points)" for f in order])
        + "."
    )
)

# %% [markdown]
# ## <a id="sweet-spot"></a>All together: the sweet spot

# %%
selections = findings.selections(sweet)
checks = findings.checks(sweet)
rule = sweet.manifest["study"]["selection"]
by = checks.set_index(["policy", "metric"])
designs = sweet.manifest["points"]
marks = {paper.ABOVE: "▲", paper.LEVEL: "≈", paper.BELOW: "▼"}
display(
    Markdown(
        f"Of {len(designs):,} settings, the one with the highest mean of "
        f"{METRICS[rule['metric']].lower()} was selected for every policy, by `"
        f"{rule['procedure']}`"
        + (f" with an indifference of {too_little}" if rule["indifference"] else "")
        + ". A winner's mean is too high, because it won for it; so it flew "
        f"{rule['check']:,} further missions that had no part in the selection, and only these "
        "are shown beside the paper's figures "
        f"(means of {paper.SWEET_SPOT_MISSIONS:,} missions, all parameters at their best)."
    )
)
html.gallery(
    [
        (
            performance(checks, metric, paper.SWEET_SPOT[metric]),
            f"{name} of every policy at its best setting, beside the paper's figure",
            f"The check: n = {checks['n'].min():,} missions per policy, bars are {level} "
            "intervals. Dashed: the paper.",
        )
        for metric, name in METRICS.items()
    ]
    if len(checks)
    else []
)


# %%
def beside(policy, metric):
    """A checked mean with its interval, and how it lies to the paper's figure."""
    mean, *ends = by.loc[(policy, metric), ["mean", "low", "high"]]
    return (
        f"{numbers.interval(mean, *ends)} {marks[paper.verdict(*ends, paper.SWEET_SPOT[metric])]}"
    )


def setting_of(point):
    return [value_text(value) for value in designs[point]["values"].values()]


swept = [*designs[0]["values"]]
printed = ["paper", *[""] * len(swept), *map(numbers.percent, paper.SWEET_SPOT.values()), "", ""]
lines = [
    [row.policy, *setting_of(row.point)]
    + ([beside(row.policy, m) for m in METRICS] if len(checks) else [""] * len(METRICS))
    + [f"{row.missions:,}", row.left]
    for row in selections.itertuples()
]
shorts = [parameter(field).short for field in swept]
head = ["Policy", *shorts, *METRICS.values(), "Missions", "Settings left"]
html.table(
    pd.DataFrame([printed, *lines], columns=head),
    f"The setting selected, and its check: means with {level} intervals, ▲ wholly above "
    "the paper's figure, ▼ below it, ≈ around it. Then the missions that the selection took, and "
    "the settings that were not ruled out, itself among them",
)

# %%
top = by["mean"].xs(PRODUCT, level="metric").idxmax() if len(checks) else None
if top:
    (point,) = selections[selections["policy"] == top]["point"]
    at_best = numbers.words(
        [f"{short} {value}" for short, value in zip(shorts, setting_of(point), strict=True)]
    )
    mean, *ends = by.loc[(top, PRODUCT), ["mean", "low", "high"]]
    verdict = paper.verdict(*ends, paper.SWEET_SPOT[PRODUCT])
    display(
        Markdown(
            f"The best at its best setting is **{top}**, with {at_best}: "
            f"{numbers.interval(mean, *ends)} in collection ratio and communication, {verdict} "
            f"{'from ' if verdict == paper.LEVEL else ''}"
            f"the paper's {numbers.percent(paper.SWEET_SPOT[PRODUCT])}."
        )
    )

# %%
display(
    Markdown(
        "What is known of the selections:\n\n"
        + "\n".join(f"- **{row.policy}**: {row.guarantee}." for row in selections.itertuples())
    )
)

# %% [markdown]
# ## What matters at all: sensitivity

# %%
indices = findings.sensitivities(sobol)
ranges = sobol.manifest["study"]["design"]["ranges"]
told = indices.dropna()
of_product = told[told["metric"] == PRODUCT]
display(
    Markdown(
        "Here all parameters are drawn together: "
        + numbers.words([f"{parameter(f).within} {value_text(ends)}" for f, ends in ranges.items()])
        + ". A Sobol index is the share of a metric's variance that a parameter accounts for: "
        "*alone*, or *with all interactions* that it takes part in. The replication, which is the "
        "sea, the arrivals and the start, is a parameter too: what it accounts for, no setting "
        "removes."
    )
)
html.gallery(
    [
        (
            parameter_figures.sensitivity(rows, policy),
            f"Sobol indices of {policy}",
            f"{METRICS[PRODUCT]} of {policy}. n = {rows['n'].min():,} missions; lines: "
            f"{level} intervals by bootstrap. Estimates are not cut: that of a small "
            "share may be negative, an interval may go beyond 100 %. Below the dotted line: noise.",
        )
        for policy, rows in of_product.groupby("policy", sort=False)
    ]
)


# %%
def weighed(policy):
    """What the indices of a policy say, in words."""
    rows = of_product[of_product["policy"] == policy].set_index("parameter")
    most = rows.drop(NOISE)["first"].idxmax()
    small = [f for f in rows.drop(NOISE).index if rows.loc[f, "total_high"] < margin_of_share]
    text = (
        f"- **{policy}**: {parameter(most).name} matters most, alone "
        f"{share(rows.loc[most], 'first')} of the variance. The noise leaves "
        f"{share(rows.loc[NOISE], 'total')} that no setting removes."
    )
    few = numbers.words([parameter(f).within for f in small])
    return text + (
        f" Less than {numbers.percent(margin_of_share)} of it has to do with {few}, by the whole "
        "interval, interactions included."
        if small
        else ""
    )


def share(row, index):
    return numbers.interval(row[index], row[f"{index}_low"], row[f"{index}_high"])


margin_of_share = 0.05
flat = indices[indices["first"].isna()]
silent = [
    f"{METRICS[metric].lower()} of {numbers.words(rows['policy'].unique().tolist())}"
    for metric, rows in flat.groupby("metric", sort=False)
]
display(
    Markdown(
        "\n".join(map(weighed, of_product["policy"].unique()))
        + (
            f"\n\nNo shares can be told of {numbers.words(silent)}: it is the same in all missions "
            "of both base samples, from which the variance is taken."
            if silent
            else ""
        )
    )
)

# %%
html.table(
    pd.DataFrame(
        [
            [
                row["policy"],
                METRICS[row["metric"]],
                "noise" if row["parameter"] == NOISE else parameter(row["parameter"]).name,
                share(row, "first"),
                share(row, "total"),
            ]
            for _, row in told.iterrows()
        ],
        columns=["Policy", "Metric", "Parameter", "Alone", "With all interactions"],
    ),
    f"Sobol indices as shares of the variance, with {level} intervals",
)

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([fig5, sweet, sobol])
