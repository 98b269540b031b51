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
# This page shows how the learned policies were trained: with and without transfer learning as in
# the paper's Fig. 3, the effect of each method of learning, and the curves of the shipped policies.

# %% tags=["parameters"]
trained = None  # folder with curves.parquet and a folder per policy; None for the shipped ones

# %%
from pathlib import Path

from matplotlib.figure import Figure

from analysis import numbers
from analysis.figures import learning as figures
from analysis.names import PRODUCT
from analysis.questions.learning import ablation
from analysis.questions.learning import curves as learning
from analysis.questions.learning import trained as policies
from analysis.questions.learning.files import read_curves
from analysis.replication import claims, paper, verdict_rules
from policies.registry import TRAINED
from reports.pages import html

# %%
folder = Path(trained or TRAINED)
trainings = read_curves(folder / "curves.parquet")
last, final = ablation.finals(trainings), f"final_{PRODUCT}"
baseline, pairs = ablation.BASELINE, learning.pairs_in(trainings)

# %% [markdown]
# ## <a id="fig-3"></a>With and without transfer learning: the paper's Fig. 3
#
# With transfer learning, phase I trains without battery decrease, and phase II begins with the
# weights of phase I (the paper's Algorithm 1). Without it, all steps belong to phase II. The paper
# claims that the agent with transfer learning has a higher reward at every step, overtakes the
# other one in product, and ends higher, and that training without
# transfer learning levels off early at a low value.

# %%
html.say(
    "Each training makes {updates} updates and simulates {slots} million UAV-slots.",
    updates=numbers.span(last["updates"]),
    slots=numbers.span(last["uav_slots"] / 1e6, "{:.1f}"),
)

# %% [markdown]
# Trainings of a variant differ only in their seed. The curves show the policy without exploration
# on evaluation missions. Left of the vertical line, in phase I, these have no battery decrease.


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
by_metric = dict(zip(metrics, (claims.RULES["throughout"], claims.RULES["passes"]), strict=True))
verdicts = {key: by_metric[key[1]].judge(compared) for key, compared in transfers.items()}
html.say(
    "**The rules here**, with Welch's t over the trainings:\n\n"
    "- of the reward: {rules[0]}\n- of product: {rules[1]}",
    rules=[rule.in_words(verdict_rules.MARGIN) for rule in by_metric.values()],
)

# %%
html.table(
    learning.transfer_table(transfers, verdicts),
    "The verdicts follow from the mean curves and from the last difference with its 99 % interval "
    "(for product, in percentage points)",
)

# %%
best = last.groupby("variant")[final].max().map(numbers.percent)
html.say(
    "The trainings here have {steps:,} steps. In the paper, the curves cross at {paper:,} steps; "
    "by the rules, shorter trainings are inconclusive. With {name}, the best training with "
    "transfer reaches {ends[0]} in product, the best without {ends[1]}.",
    steps=last["updates"].max(),
    paper=paper.CROSSING,
    name=[*pairs][-1],
    ends=[best[variant] for variant in pairs[[*pairs][-1]]],
)

# %% [markdown]
# ## The effect of each method of learning
#
# These are trainings of the config `quick`, each with one change and the same number of updates.
# The selected weights are evaluated on the same missions, which were used neither for training nor
# for selecting weights.
#
# - **guard**: the return guard masks actions after which it is too late to return for charging.
# - **low-battery starts**: some missions begin in the zone, with little battery left.
# - **early returns**: some UAVs return to charge as soon as they may.
# - **none of the three**: none of these methods; only those of the paper.
# - **transfer**: phase I without battery decrease comes first.
# - **nodes**, **maps**: another observation and network; **maps** is the paper's.
# - **environments**: missions simulated in parallel; with fewer, an update has less new experience.

# %%
table = ablation.ablation(last, final, baseline)
html.figure(
    figures.ablation(table, last, final, baseline),
    "Product that the trainings of every variant reach",
    "A dot is a training; a diamond is the mean of n trainings with its 95 % interval (Student's t "
    "over the trainings). A single training has neither interval nor diamond. The dashed line is "
    f"the mean of {baseline}. An arrow means that all trainings are left of the axis.",
)

# %%
html.table(
    ablation.ablation_table(table, last, baseline),
    "Means over n trainings with 95 % confidence intervals of the expected result, then the 95 % "
    "prediction interval of one new training, except for single or equal trainings. Differences "
    "have Welch's t interval. For a single training it is Student's t with the variance of "
    f"{baseline}; it contains 0 if the training could be one more training of {baseline}. "
    "▲ the interval is above 0 (better), ▼ below 0 (worse), ≈ contains 0 (inconclusive)",
)

# %% [markdown]
# With so many intervals, some do not contain the true value by chance; the p-values are corrected
# for the number of tests (Holm). For a variant that was trained once, only large differences can be
# significant.

# %% [markdown]
# ## The shipped policies

# %%
shipped = policies.trained_policies(folder)


def several(group: list[policies.Trained], metric: str) -> tuple[Figure, str, str]:
    names = numbers.words([policy.name for policy in group])
    drawing = figures.trainings(policies.curves_of(group, names), metric, {names: group[0].name})
    caption = figures.trainings_caption([len(group)])
    alt = f"{figures.NAMES[metric]} of {names} against training step"
    return drawing, alt, f"{names}: trainings that differ only in their seed. {caption}"


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
    "From which step on the exponential moving average of product does "
    "not improve any more. Minutes are elapsed time, and other programs may have slowed the "
    "training down.\n\n{courses}",
    courses=html.composed(
        "\n".join(policies.course_in_words(policy, verdict_rules.MARGIN) for policy in shipped)
    ),
)

# %% [markdown]
# ## Where the figures come from
#
# This page reads no study: the curves are shipped with the policies, in `policies/trained`. These
# commands make them again:

# %%
curves = "python -m reports.tools.learning_curves --out runs/learning"
html.say("{lines}", lines=html.commands([curves, *policies.commands(shipped)]))

# %%
html.table(policies.settings_table(shipped))

# %%
html.weights(folder)
