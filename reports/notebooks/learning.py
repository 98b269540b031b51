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
# # Learning
#
# How the learned policies came about: with and without transfer learning as in the paper's Fig. 3,
# what each means of learning is worth, and the curves of the policies that are shipped.

# %% tags=["parameters"]
trained = None  # folder with curves.parquet and a folder per policy; None for those shipped

# %%
import json
from importlib.resources import files
from pathlib import Path

import pandas as pd
from IPython.display import Markdown, display

from analysis import numbers
from analysis.figures import learning as learning_figures
from analysis.names import METRICS, PRODUCT
from analysis.questions import learning as curves
from analysis.replication import rules as claims
from analysis.replication.claims import curve_verdict
from analysis.replication.paper import CROSSING
from analysis.stats.intervals import LEVEL
from policies.ddqn.config import config_of, learner_of
from reports.pages import html

folder = Path(trained or str(files("policies") / "trained"))
trainings = pd.read_parquet(folder / "curves.parquet")
each = trainings.groupby(["variant", "seed"]).last()  # the end of every training
seeds = each.groupby("variant").size()
level, band_level = numbers.level(LEVEL), numbers.level(curves.BAND)
baseline = "quick"

pairs = {  # what a training has besides -> the variants with and without transfer learning
    "all means of this project": (baseline, "no transfer"),
    "no return guard": ("no guard", "no guard, no transfer"),
    "the paper's means alone": ("none of the three", "none of the three, no transfer"),
}
pairs = {name: pair for name, pair in pairs.items() if {*pair} <= {*seeds.index}}


def spread(numbers, form):
    """The least and the largest number as text, or the one that all are."""
    return " to ".join(dict.fromkeys(form.format(n) for n in (numbers.min(), numbers.max())))


# %% [markdown]
# ## <a id="fig-3"></a>With and without transfer learning: the paper's Fig. 3

# %%
display(
    Markdown(
        "With transfer learning, phase I trains without any battery decrease, and phase II begins "
        "with its weights (the paper's Algorithm 1); without, every step is one of phase II. Each "
        f"training makes {spread(each['updates'], '{:,}')} updates and sees "
        f"{spread(each['uav_slots'] / 1e6, '{:.1f}')} million UAV-slots; those of one variant "
        "differ in their seed alone. What is shown is the greedy policy on evaluation missions, "
        "which in phase I have no battery decrease either: left of the vertical line the curve is "
        "no measure of what is right of it."
    )
)


# %%
def captioned(name, metric):
    using, without = pairs[name]
    labels = {using: "with transfer", without: "without"}
    figure = learning_figures.trainings(trainings, metric, labels)
    fewest = seeds[[using, without]].min()
    band = (
        f"Bands: {band_level} by Student's t over n = {seeds[using]} and "
        f"{seeds[without]} trainings."
        if fewest >= curves.FEWEST
        else f"No band: over n = {fewest}, one of {band_level} would be of no use."
    )
    caption = (
        f"{name[0].upper() + name[1:]}. Thick: mean of the exponential moving averages (weight of "
        f"the newest evaluation {curves.ALPHA:g}); thin: single trainings; dotted: phase I. {band}"
    )
    title = learning_figures.NAMES[metric]
    return figure, f"{title} against training step, {name}, with and without transfer", caption


fig3 = ("evaluation_reward", f"evaluation_{PRODUCT}")
shown = [*pairs][:1] + [*pairs][1:][-1:]
for name in shown:
    display(html.gallery([captioned(name, metric) for metric in fig3]))

# %%
averages = {metric: curves.smoothed(trainings, metric) for metric in fig3}
found = {
    (name, metric): curves.transfer(averages[metric], *pair)
    for name, pair in pairs.items()
    for metric in fig3
}
verdicts = {key: curve_verdict(key[1], comparison) for key, comparison in found.items()}
given = [*verdicts.values()]
counted = [
    f"**{verdict}** in {given.count(verdict)}" for verdict in claims.VERDICTS if verdict in given
]


def told(metric, transfer):
    """Where the curve with transfer learning lies, in words."""
    scale = numbers.points if metric != fig3[0] else "{:+.0f} [{:+.0f}, {:+.0f}]".format
    gap = scale(*transfer.last).replace("-", "−")
    if transfer.last.low == transfer.last.high:
        gap = f"{gap.split()[0]}, the same in all trainings"
    if transfer.since is None:
        where = "ends below, or level"
    elif transfer.throughout:
        where = "is above in all of phase II"
    else:
        where = f"is above from step {transfer.since:,} on"
    return f"{where}; at the end {gap}"


display(
    Markdown(
        "**The paper's claim**: the agent with transfer learning has the higher reward throughout, "
        "passes the other in collection ratio and communication, and ends higher; without it, "
        "training levels off early and low. **The rules here**, with Welch's t over the trainings:"
        f"\n\n- of the reward: {claims.THROUGHOUT}\n- of collection ratio and communication: "
        f"{claims.PASSES}\n\nBy these rules the claim "
        f"{numbers.words(counted)} of {len(found)} comparisons."
    )
)


def judged(name):
    using, without = pairs[name]
    lines = [
        f"- With {name} (n = {seeds[using]} and {seeds[without]}"
        f"{'' if name in shown else ', not drawn'}):"
    ]
    return lines + [
        f"    - {learning_figures.NAMES[metric]} **{verdicts[name, metric]}**: "
        + told(metric, found[name, metric])
        for metric in fig3
    ]


display(
    Markdown(
        f"Where the curve with transfer lies, with {band_level} intervals of the last "
        "difference, of the product in percentage points:\n\n"
        + "\n".join(line for name in pairs for line in judged(name))
    )
)

# %%
unclear = [f for f in found.values() if f.last.low <= 0 <= f.last.high]
alike = sum(f.last.low == f.last.high for f in unclear)
alone = [*pairs][-1]
ends = {v: 100 * each.loc[v, f"final_{PRODUCT}"].max() for v in pairs[alone]}
display(
    Markdown(
        (
            f"The trainings here have {each['updates'].max():,} steps, and the paper sees its "
            f"crossing at {CROSSING:,}: by the rules they are too short to tell. "
            if each["updates"].max() < CROSSING
            else ""
        )
        + f"As far as they go, the interval of the last difference holds 0 in {len(unclear)} of "
        f"{len(found)} comparisons"
        + (f"; in {alike} of these all trainings end alike" if alike else "")
        + f". With {alone}, the best training with transfer reaches "
        f"{ends[pairs[alone][0]]:.1f} %, the best without {ends[pairs[alone][1]]:.1f} % in "
        "collection ratio and communication."
    )
)

# %% [markdown]
# ## What each means of learning is worth
#
# Trainings of the config `quick`, each with one thing changed and the same number of updates. The
# weights that were kept fly missions that no training and no selection has seen, the same for all.
#
# - **guard**: the return guard masks actions that leave no way back to the charger.
# - **low-battery starts**: some missions begin in the zone, with little battery left.
# - **early returns**: some UAVs come home to charge as soon as they may.
# - **none of the three**: none of these; the paper's means alone.
# - **transfer**: phase I without battery decrease comes first.
# - **nodes**, **maps**: another observation and network; **maps** is the paper's.
# - **environments**: missions side by side; fewer bring less fresh experience per update.

# %%
last = curves.finals(trainings)
table = curves.ablation(last, f"final_{PRODUCT}", baseline)
table = table.sort_values("mean", ascending=False, kind="stable").reset_index(drop=True)
single = table[table["n"] == 1]
html.figure(
    learning_figures.ablation(table, last, f"final_{PRODUCT}", baseline),
    "Collection ratio and communication that the trainings of every variant reach",
    f"Dots are trainings, n of them; a diamond is their mean, with its {level} interval "
    "by Student's t over the trainings. One training has no interval, and no diamond. Dashed: the "
    f"mean of {baseline}. An arrow: all trainings are left of the axis.",
)


# %%
def line(row):
    same = row["variant"] == baseline
    ends = row["difference_low"], row["difference_high"]
    others = last[last["variant"] == row["variant"]][["final_success", "final_collection_ratio"]]
    return [
        row["variant"],
        row["n"],
        numbers.interval(row["mean"], row["low"], row["high"])
        if row["low"] < row["high"]
        else numbers.percent(row["mean"]),
        "" if same else numbers.points(row["difference"], *ends),
        "" if same else numbers.p_value(row["p_adjusted"]),
        *map(numbers.percent, others.mean()),
    ]


*others, name = METRICS.values()
head = ["Variant", "n", name, f"To {baseline} [points]", "p (Holm)", *others]
html.table(
    pd.DataFrame([line(row) for _, row in table.iterrows()], columns=head),
    f"Means over n trainings with {level} intervals; none of one training, or where all "
    "are the same. Differences: Welch's t; of a single training, Student's t with the spread of "
    f"{baseline}, so the interval holds 0 if one more training of {baseline} might have come out "
    "like that",
)

# %%
compared = table[table["variant"] != baseline]
below, above = compared["difference_high"] < 0, compared["difference_low"] > 0
groups = {
    "worse": compared[below],
    "better": compared[above],
    "not distinguishable": compared[~below & ~above],
}
sure = compared[compared["p_adjusted"] <= 1 - LEVEL]["variant"]
listed = [
    f"- **{words}**: {'; '.join(rows['variant'])}" for words, rows in groups.items() if len(rows)
]
display(
    Markdown(
        f"Against {baseline}, by the whole interval, each for itself:\n\n"
        + "\n".join(listed)
        + f"\n\nOf {len(compared)} such intervals some miss by chance. Corrected for their number "
        "(Holm), what is left to differ is: "
        + (f"**{'; '.join(sure)}**." if len(sure) else "nothing.")
        + f" {len(single)} of {len(table)} variants were trained once: of these only large "
        "differences show."
    )
)

# %% [markdown]
# ## The policies that are shipped

# %%
shipped = {path.parent.name: path.parent for path in sorted(folder.glob("*/training.parquet"))}
ran = {name: pd.read_parquet(path / "training.parquet") for name, path in shipped.items()}
configs = {
    name: json.loads((path / "config.json").read_text("utf-8"))["training"]
    for name, path in shipped.items()
}
learners = {}  # trainings that differ in their seed alone
for name, config in configs.items():
    learners.setdefault(learner_of(config_of(config, name)), []).append(name)
repeated = {names[0]: names for names in learners.values() if len(names) > 1}


def trained_often(first, metric):
    names = repeated[first]
    own = pd.concat(ran[n].assign(variant=first, seed=configs[n]["seed"]) for n in names)
    band = (
        f"the band: {band_level} by Student's t"
        if len(names) >= curves.FEWEST
        else f"no band, one of {band_level} would be of no use"
    )
    caption = (
        f"{numbers.words(names)}, n = {len(names)} trainings that differ in their seed alone. Thick: "
        f"mean of the exponential moving averages (weight of the newest evaluation "
        f"{curves.ALPHA:g}); thin: single trainings; {band}."
    )
    title = learning_figures.NAMES[metric]
    figure = learning_figures.trainings(own, metric, {first: first})
    return figure, f"{title} of {numbers.words(names)} against training step", caption


for first in repeated:
    display(html.gallery([trained_often(first, metric) for metric in fig3]))


# %%
def trained_once(name):
    caption = (
        f"n = 1 training, of seed {configs[name]['seed']}, which has no interval; every "
        f"evaluation is over {configs[name]['evaluation_missions']:,} missions. The star: the "
        "weights that were kept, by the best moving average."
    )
    figure = learning_figures.training(ran[name], name)
    return figure, f"Evaluations of {name} against training step", caption


html.gallery([trained_once(name) for name in ran])


# %%
def course(name):
    curve = ran[name]
    metric = f"evaluation_{PRODUCT}"
    near, end = curves.settled(curve, metric, claims.MARGIN), curve.iloc[-1]
    average = curves.smoothed(curve.assign(variant=name, seed=0), metric)["value"].iloc[-1]
    return (
        f"- **{name}** ends at {numbers.percent(average)} after "
        f"{end['updates']:,} updates, {end['uav_slots'] / 1e6:.1f} million UAV-slots and "
        f"{end['seconds'] / 60:.0f} minutes. From update {near['updates']:,} on "
        f"({near['seconds'] / 60:.0f} minutes) it stays within "
        f"{claims.margin_in_words(claims.MARGIN)} of that: the other "
        f"{numbers.percent(1 - near['updates'] / end['updates'])} of the updates moved it by less."
    )


display(
    Markdown(
        "Where more training stops paying, by the exponential moving average of the collection "
        "ratio and communication of the evaluations. Minutes are those of the clock, whatever "
        "else the machine did.\n\n" + "\n".join(map(course, ran))
    )
)

# %% [markdown]
# ## Where the figures come from

# %%
display(
    Markdown(
        "No study is read: the curves come with the policies, in `policies/trained`. To make them "
        "anew:\n\n- `python -m reports.tools.learning_curves --out runs/learning`"
        + "".join(
            f"\n- `dess train {config['name']} --seed {config['seed']} --out runs/{name}`"
            for name, config in configs.items()
        )
    )
)
html.table(
    pd.DataFrame(
        [
            [
                name,
                config["observation"],
                ", ".join(f"{p['name']} ({p['ticks']:,} ticks)" for p in config["phases"]),
                config["seed"],
                f"{config['discount']:g}",
                config["n_step"],
            ]
            for name, config in configs.items()
        ],
        columns=["Policy", "Observation", "Phases", "Seed", "Discount", "Steps of return"],
    ),
)

# %%
html.weights(folder)
