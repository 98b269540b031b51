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
# # What makes learning work?
#
# The trainings of the learned policies: transfer learning, and the effect of each method.

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

table = ablation.ablation(last, final, baseline)

# %%
html.answer(ablation.answer(table, baseline))

# %%
html.lead(
    figures.ablation(table, last, final, baseline),
    "The product that the trainings of every variant reach",
    "A dot is a training; a diamond is the mean of n trainings with its 95 % interval (Student's "
    f"t). Dashed: the mean of {baseline}. An arrow: all trainings are left of the axis.",
)

# %% [markdown]
# ## Why: the effect of each method
#
# Every variant is the config `quick` with one change and the same number of updates, evaluated on
# missions that were used neither for training nor for selecting weights.
#
# - **guard**: the return guard masks actions after which it is too late to return for charging.
# - **low-battery starts**: some missions begin in the zone, with little battery left.
# - **early returns**: some UAVs return to charge as soon as they may.
# - **none of the three**: only the methods of the paper.
# - **transfer**: phase I without battery decrease comes first.
# - **nodes**, **maps**: another observation and network; **maps** is the paper's.
# - **environments**: missions simulated in parallel.

# %% [markdown]
# ## <a id="fig-3"></a>Transfer learning: the paper's Fig. 3
#
# With transfer learning, phase I (left of the vertical line) trains without battery decrease. The
# paper claims a higher reward at every step, and a higher product in the end.


# %%
def with_and_without(name: str, metric: str) -> tuple[Figure, str, str]:
    labels = dict(zip(pairs[name], ("with transfer", "without"), strict=True))
    caption = figures.trainings_caption(last.groupby("variant").size()[[*labels]])
    alt = f"{figures.NAMES[metric]} against training step, {name}, with and without transfer"
    return figures.trainings(trainings, metric, labels), alt, f"Trainings with {name}. {caption}"


metrics = (learning.REWARD, learning.PRODUCT)
drawn = dict.fromkeys([[*pairs][0], [*pairs][-1]])
html.gallery([with_and_without(name, metric) for name in drawn for metric in metrics])

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

# %% [markdown]
# ## How far to trust it
#
# Trainings of a variant differ only in their seed. A variant that was trained once has neither
# interval nor mean; only large differences of it can be significant. P-values are corrected for the
# number of tests (Holm).

# %%
transfers = learning.transfers(trainings, metrics, shortest=paper.CROSSING)
by_metric = dict(zip(metrics, (claims.RULES["throughout"], claims.RULES["passes"]), strict=True))
verdicts = {key: by_metric[key[1]].judge(compared) for key, compared in transfers.items()}
best = last.groupby("variant")[final].max().map(numbers.percent)

# %%
html.say(
    "The trainings have {steps:,} steps; in the paper the curves cross at {paper:,}, and shorter "
    "trainings are inconclusive. With {name}, the best training with transfer reaches a product of "
    "{ends[0]}, the best without {ends[1]}.",
    steps=last["updates"].max(),
    paper=paper.CROSSING,
    name=[*pairs][-1],
    ends=[best[variant] for variant in pairs[[*pairs][-1]]],
)

# %% [markdown]
# ## Tables

# %%
html.table(
    ablation.ablation_table(table, last, baseline),
    "Means over n trainings with 95 % intervals, the prediction interval of one new training, "
    "and differences with Welch's t interval. ▲ better, ▼ worse, ≈ inconclusive",
)

# %%
html.table(
    learning.transfer_table(transfers, verdicts),
    "With transfer against without: the last difference with its 99 % interval (of the product "
    "in points)",
)

# %%
html.table(policies.settings_table(shipped), "The settings of the shipped policies")

# %% [markdown]
# ## How this page was made

# %%
html.say(
    "Each training makes {updates} updates and simulates {slots} million UAV-slots. From which "
    "step on the moving average of the product does not improve any more:\n\n{courses}",
    updates=numbers.span(last["updates"]),
    slots=numbers.span(last["uav_slots"] / 1e6, "{:.1f}"),
    courses=html.composed(
        "\n".join(policies.course_in_words(policy, verdict_rules.MARGIN) for policy in shipped)
    ),
)

# %% [markdown]
# The curves are shipped with the policies, in `policies/trained`. These commands make them again:

# %%
curves = "python -m reports.tools.learning_curves --out runs/learning"
html.say("{lines}", lines=html.commands([curves, *policies.commands(shipped)]))

# %%
html.weights(folder)
