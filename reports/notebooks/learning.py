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
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from analysis import numbers
from analysis.figures import learning as figures
from analysis.names import PRODUCT
from analysis.questions.learning import ablation
from analysis.questions.learning import curves as learning
from analysis.questions.learning import trained as policies
from analysis.replication import paper, verdict_rules
from policies.registry import TRAINED
from reports.pages import html

# %%
folder = Path(trained or TRAINED)
trainings = pd.read_parquet(folder / "curves.parquet")
last, final = ablation.finals(trainings), f"final_{PRODUCT}"
baseline, pairs = ablation.BASELINE, learning.pairs_in(trainings)

# %% [markdown]
# ## <a id="fig-3"></a>With and without transfer learning: the paper's Fig. 3
#
# With transfer learning, phase I trains without any battery decrease, and phase II begins with its
# weights (the paper's Algorithm 1); without, every step is one of phase II. The paper claims that
# the agent with transfer learning has the higher reward throughout, passes the other in collection
# ratio and communication, and ends higher; without it, training levels off early and low.

# %%
html.say(
    "Each training makes {updates} updates and sees {slots} million UAV-slots; those of a variant "
    "differ in their seed alone. The curves show the greedy policy on evaluation missions. Left of "
    "the vertical line, in phase I, these have no battery decrease either.",
    updates=numbers.span(last["updates"]),
    slots=numbers.span(last["uav_slots"] / 1e6, "{:.1f}"),
)


# %%
def with_and_without(name: str, metric: str) -> tuple[Figure, str, str]:
    labels = dict(zip(pairs[name], ("with transfer", "without"), strict=True))
    caption = figures.trainings_caption(last.groupby("variant").size()[[*labels]])
    alt = f"{figures.NAMES[metric]} against training step, {name}, with and without transfer"
    return figures.trainings(trainings, metric, labels), alt, f"Trainings with {name}. {caption}"


metrics = (learning.REWARD, learning.PRODUCT)
drawn = dict.fromkeys([[*pairs][0], [*pairs][-1]])
html.gallery([with_and_without(name, metric) for name in drawn for metric in metrics])

# %%
transfers = learning.transfers(trainings, metrics, shortest=paper.CROSSING)
by_metric = dict(zip(metrics, (verdict_rules.throughout, verdict_rules.passes), strict=True))
verdicts = {key: by_metric[key[1]].judge(compared) for key, compared in transfers.items()}
html.say(
    "**The rules here**, with Welch's t over the trainings:\n\n"
    "- of the reward: {rules[0]}\n- of collection ratio and communication: {rules[1]}",
    rules=[rule.in_words(verdict_rules.MARGIN) for rule in by_metric.values()],
)

# %%
html.table(
    learning.transfer_table(transfers, verdicts),
    "By the mean curves, and by the last difference with its 99 % interval; of the product, "
    "collection ratio and communication, in percentage points",
)

# %%
best = last.groupby("variant")[final].max().map(numbers.percent)
html.say(
    "The trainings here have {steps:,} steps. The paper sees its crossing at {paper:,}: by the "
    "rules shorter ones are inconclusive. With {name}, the best training with transfer reaches "
    "{ends[0]}, the best without {ends[1]} in collection ratio and communication.",
    steps=last["updates"].max(),
    paper=paper.CROSSING,
    name=[*pairs][-1],
    ends=[best[variant] for variant in pairs[[*pairs][-1]]],
)

# %% [markdown]
# ## What each means of learning is worth
#
# Trainings of the config `quick`, each with one thing changed and the same number of updates. The
# weights that were kept are evaluated on the same missions, used by no training or selection.
#
# - **guard**: the return guard masks actions that leave no way back to the charger.
# - **low-battery starts**: some missions begin in the zone, with little battery left.
# - **early returns**: some UAVs come home to charge as soon as they may.
# - **none of the three**: none of these; the paper's means alone.
# - **transfer**: phase I without battery decrease comes first.
# - **nodes**, **maps**: another observation and network; **maps** is the paper's.
# - **environments**: missions side by side; fewer bring less fresh experience per update.

# %%
table = ablation.ablation(last, final, baseline)
html.figure(
    figures.ablation(table, last, final, baseline),
    "Collection ratio and communication that the trainings of every variant reach",
    "Dots are trainings, n of them; a diamond is their mean, with its 95 % interval by Student's t "
    "over the trainings. One training has no interval, and no diamond. Dashed: the mean of "
    f"{baseline}. An arrow: all trainings are left of the axis.",
)

# %%
html.table(
    ablation.ablation_table(table, last, baseline),
    "Means over n trainings with 95 % confidence intervals of the expected result, then the 95 % "
    "prediction interval of one new training; none of one training, or where all are the same. "
    f"Differences: Welch's t; of a single training, Student's t with the spread of {baseline}, so "
    f"the interval holds 0 if one more training of {baseline} might have come out like that. "
    "▲ the whole interval is above 0: better; ▼ below it: worse; ≈ around it: inconclusive",
)

# %% [markdown]
# Of so many intervals some miss by chance; the p-values are corrected for their number (Holm). Of
# a variant that was trained once only large differences show.

# %% [markdown]
# ## The policies that are shipped

# %%
shipped = policies.trained_policies(folder)


def several(group: list[policies.Trained], metric: str) -> tuple[Figure, str, str]:
    names = numbers.words([policy.name for policy in group])
    drawing = figures.trainings(policies.curves_of(group, names), metric, {names: group[0].name})
    caption = figures.trainings_caption([len(group)])
    alt = f"{figures.NAMES[metric]} of {names} against training step"
    return drawing, alt, f"{names}: trainings that differ in their seed alone. {caption}"


learners = policies.several_trainings(shipped)
html.gallery([several(group, metric) for group in learners for metric in metrics])


# %%
def once(policy: policies.Trained) -> tuple[Figure, str, str]:
    caption = figures.training_caption(policy.config.seed, policy.config.evaluation_missions)
    alt = f"Evaluations of {policy.name} against training step"
    return figures.training(policy.curve, policy.name), alt, caption


html.gallery([once(policy) for policy in shipped])

# %%
html.say(
    "Where more training stops paying, by the exponential moving average of collection ratio and "
    "communication. Minutes are those of the clock, whatever else the machine did.\n\n{courses}",
    courses="\n".join(policies.course_in_words(policy, verdict_rules.MARGIN) for policy in shipped),
)

# %% [markdown]
# ## Where the figures come from
#
# No study is read: the curves come with the policies, in `policies/trained`. To make them anew:

# %%
curves = "python -m reports.tools.learning_curves --out runs/learning"
html.say(html.commands([curves, *policies.commands(shipped)]))

# %%
html.table(policies.settings_table(shipped))

# %%
html.weights(folder)
