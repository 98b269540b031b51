# ---
# jupyter:
#   dess:
#     studies: [table4, fig4]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Performance
#
# How often every policy fills its communication quota and how much of the data it brings home,
# beside the figures that the paper prints for its learned policy.

# %% tags=["parameters"]
results = "../../results"  # folder that holds the results folders of the studies table4 and fig4

# %%
from pathlib import Path

import pandas as pd
from IPython.display import Markdown, display

from analysis import load_results, numbers, summary
from analysis.figures import policies as figures
from analysis.names import METRICS, PRODUCT
from analysis.replication import paper
from analysis.stats.intervals import wilson
from reports.pages import html

table4, fig4 = (load_results(Path(results) / name) for name in ("table4", "fig4"))
policies = table4.manifest["study"]["policies"]
overall = summary(table4.missions, by=["policy"])
by_fleet = summary(table4.missions, by=["policy", "uavs"])
in_fig4 = summary(fig4.missions, by=["policy", "uavs"])
marks = {paper.ABOVE: "▲", paper.LEVEL: "≈", paper.BELOW: "▼"}


def beside(row, printed):
    """An interval as text, and how it lies to the paper's figure."""
    mark = marks[paper.verdict(row["low"], row["high"], printed)]
    return shown(row), f"{numbers.difference(row['mean'], printed)} {mark}"


def shown(row):
    return numbers.interval(row["mean"], row["low"], row["high"])


# %% [markdown]
# ## <a id="table-4"></a>Random missions: the paper's Table IV

# %%
rows = overall.set_index(["policy", "metric"])
display(
    Markdown(
        f"{overall['n'].min():,} missions per policy, each with a number of UAVs, a flying time, "
        "charging thresholds and initial data of its own (Table II). Every policy meets the same "
        "missions: the same sea, arrivals and shadowing."
    )
)
html.gallery(
    [
        (
            figures.performance(overall, metric, paper.TABLE_IV[metric]),
            f"{name} of every policy, beside the paper's figure",
            f"n = {overall['n'].min():,} missions per policy, bars are 95 % intervals. Dashed: the "
            "paper.",
        )
        for metric, name in METRICS.items()
    ]
)

# %%
printed = ["paper", *(c for p in paper.TABLE_IV.values() for c in (numbers.percent(p), ""))]
lines = [
    [p, *(c for m in METRICS for c in beside(rows.loc[(p, m)], paper.TABLE_IV[m]))]
    for p in policies
]
head = [("", "Policy"), *((n, c) for n in METRICS.values() for c in ("mean", "to paper"))]
html.table(
    pd.DataFrame([printed, *lines], columns=pd.MultiIndex.from_tuples(head)),
    "Means with 95 % intervals, and the difference to the paper in percentage points. "
    "▲ the whole interval is above the paper's figure, ▼ below it, ≈ not distinguishable from it.",
)


# %%
def sorted_out(metric):
    """In words, how every policy compares to the paper in a metric."""
    groups = {verdict: [] for verdict in marks}
    for p in policies:
        low, high = rows.loc[(p, metric), ["low", "high"]]
        groups[paper.verdict(low, high, paper.TABLE_IV[metric])].append(p)
    found = (f"{verdict}: {numbers.words(those)}" for verdict, those in groups.items() if those)
    name, figure = METRICS[metric], numbers.percent(paper.TABLE_IV[metric])
    return f"- **{name}** (paper {figure}), {'; '.join(found)}."


product = PRODUCT
best = rows.xs(product, level="metric")["mean"].idxmax()
spread = wilson(round(paper.TABLE_IV["success"] * paper.TABLE_IV_MISSIONS), paper.TABLE_IV_MISSIONS)
display(
    Markdown(
        f"The best policy by collection ratio and communication is **{best}**: "
        f"{shown(rows.loc[(best, product)])}, with success {shown(rows.loc[(best, 'success')])}. "
        "Against the paper's figures, by the whole interval:\n\n"
        + "\n".join(sorted_out(metric) for metric in METRICS)
        + "\n\nThe paper prints no intervals. Its figures are themselves means of "
        f"{paper.TABLE_IV_MISSIONS:,} missions: a success of that size alone has a 95 % interval "
        f"of {numbers.interval(*spread)}. And where the paper is silent, such as on the place of the "
        "charging zone or the transmit power, the scenario here decides."
    )
)

# %% [markdown]
# ## By number of UAVs
#
# The same missions, split by the size of the fleet that they drew.

# %%
html.gallery(
    [
        (
            figures.by_fleet(by_fleet, metric),
            f"{name} against the number of UAVs",
            f"n = {by_fleet['n'].min():,} to {by_fleet['n'].max():,} missions per policy and size, "
            "bars are 95 % intervals.",
        )
        for metric, name in METRICS.items()
    ]
)

# %%
fleets = by_fleet.set_index(["policy", "uavs", "metric"])
lines = [
    [p, uavs, f"{fleets.loc[(p, uavs, product), 'n']:,}"]
    + [shown(fleets.loc[(p, uavs, m)]) for m in METRICS]
    for p in policies
    for uavs in sorted(by_fleet["uavs"].unique())
]
html.table(
    pd.DataFrame(lines, columns=["Policy", "UAVs", "Missions", *METRICS.values()]),
    "Means with 95 % intervals",
)

# %% [markdown]
# ## <a id="fig-4"></a>One setting: the paper's Fig. 4

# %%
setting = fig4.manifest["scenario"]
display(
    Markdown(
        f"C<sub>S</sub> {setting['charge_start'][0]} %, C<sub>C</sub> "
        f"{setting['charge_complete'][0]} %, {setting['initial_data'][0]:g} data units per node, "
        f"flying time {setting['flying_time'][0]}; {in_fig4['n'].min():,} missions per policy and "
        "fleet size. The paper does not say over how many missions its figures are means."
    )
)
printed_metrics = {m: METRICS[m] for m in paper.FIG_4[1]}
html.gallery(
    [
        (
            figures.by_fleet(in_fig4, metric, {i: p[metric] for i, p in paper.FIG_4.items()}),
            f"{name} against the number of UAVs, beside the paper's figures",
            f"n = {in_fig4['n'].min():,} missions per policy and size, bars are 95 % intervals. "
            "Diamonds: the paper.",
        )
        for metric, name in printed_metrics.items()
    ]
)

# %%
cases = in_fig4.set_index(["policy", "uavs", "metric"])
columns = [(metric, uavs) for metric in printed_metrics for uavs in paper.FIG_4]


def with_mark(p, metric, uavs):
    text, distance = beside(cases.loc[(p, uavs, metric)], paper.FIG_4[uavs][metric])
    return f"{text} {distance[-1]}"


lines = [
    ["paper", *(numbers.percent(paper.FIG_4[uavs][metric]) for metric, uavs in columns)],
    *([p, *(with_mark(p, *column) for column in columns)] for p in policies),
]
head = [("", "Policy"), *((printed_metrics[metric], f"I = {uavs}") for metric, uavs in columns)]
html.table(
    pd.DataFrame(lines, columns=pd.MultiIndex.from_tuples(head)),
    "Means with 95 % intervals; ▲ wholly above the paper's figure, ▼ below it, ≈ around it",
)

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([table4, fig4])
