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
from analysis.answers import learning as answers
from analysis.answers.learning import read_curves
from analysis.figures import learning as figures
from analysis.metrics import PRODUCT
from analysis.paper import measures, scorecard, values
from policies.registry import TRAINED
from reports.pages import html

# %%
folder = Path(str(trained or TRAINED))
trainings = read_curves(folder / "curves.parquet")
last, final = answers.finals(trainings), f"final_{PRODUCT}"
baseline, pairs = answers.BASELINE, answers.pairs_in(trainings)

rungs, equal = answers.ladder(last), answers.of_equal_budget(last, baseline)

# %%
html.answer(answers.answer(rungs))

# %%
DOTS = (
    "A dot is a training; a diamond is the mean of n trainings with its 95 % interval (Student's "
    "t). Dashed: the mean of {}. An arrow: all trainings are left of the axis."
)
top = rungs["variant"].iloc[-1]
steps = answers.ablation(rungs, final, top).set_index("variant")
steps = steps.loc[rungs["variant"].unique()].reset_index()
drawing = figures.ablation(steps, rungs, final, top)
html.lead(drawing, "The product that trainings reach, method by method", DOTS.format(top))

# %% [markdown]
# ## Why: the effect of each method
#
# Every variant is the config `quick` with one change and the same number of updates. The **guard**
# masks actions after which it is too late to return for charging. With **low-battery starts** some
# missions begin in the zone with little battery, and with **early returns** some UAVs return as
# soon as they may. **Transfer**: phase I, without battery decrease, comes first. **maps** is the
# paper's network.

# %%
table = answers.ablation(equal, final, baseline)
drawing = figures.ablation(table, equal, final, baseline)
html.figure(drawing, "The product that every variant reaches", DOTS.format(baseline))

# %% [markdown]
# ## <a id="fig-3"></a>Transfer learning: the paper's Fig. 3
#
# The paper claims a higher reward at every step, and a higher product in the end. With its methods
# alone most trainings do not learn to charge: hardly a UAV enters the zone with a low battery and
# waits there, so the replay memory has no transition that shows what a charge is worth.


# %%
def with_and_without(name: str, metric: str) -> tuple[Figure, str, str]:
    labels = dict(zip(pairs[name], ("with transfer", "without"), strict=True))
    alt = f"{figures.NAMES[metric]} against training step, {name}, with and without transfer"
    caption = f"Trainings with {name}."
    return figures.trainings(trainings, metric, labels), alt, caption


metrics = (answers.LEARNED_REWARD, answers.LEARNED_PRODUCT)
drawn = dict.fromkeys([[*pairs][0], [*pairs][-1]])
drawings = [with_and_without(name, metric) for name in drawn for metric in metrics]
html.gallery(drawings, figures.TRAININGS)

# %% [markdown]
# ## The shipped policies

# %%
shipped = answers.trained_policies(folder)
curves = answers.curves_by_learner(shipped)
labels = {name: name for name in curves["variant"].unique()}
html.gallery(
    [
        (figures.trainings(curves, m, labels), f"{figures.NAMES[m]} of the shipped policies")
        for m in metrics
    ],
    figures.TRAININGS,
)

# %% [markdown]
# ## How far to trust it
#
# Trainings of a variant differ only in their seed. A variant that was trained once has no interval.
# P-values are corrected for the number of tests (Holm).

# %%
transfers = answers.transfers(trainings, metrics, shortest=values.CROSSING)
by_metric = dict(
    zip(metrics, (scorecard.RULES["throughout"], scorecard.RULES["passes"]), strict=True)
)
verdicts = {key: by_metric[key[1]].judge(compared) for key, compared in transfers.items()}
best = last.groupby("variant")[final].max().map(numbers.percent)

# %%
html.say(
    "The longest of these pairs have {steps:,} steps; in the paper the curves cross at {paper:,}, "
    "and shorter trainings are inconclusive. With {name}, the best training with transfer reaches "
    "a product of {ends[0]}, the best without {ends[1]}.",
    steps=max(compared.length for compared in transfers.values()),
    paper=values.CROSSING,
    name=[*pairs][-1],
    ends=[best[variant] for variant in pairs[[*pairs][-1]]],
)

# %% [markdown]
# ## Tables

# %%
html.table(
    answers.ablation_table(table, equal, baseline),
    "Means over n trainings with 95 % intervals, the prediction interval of one new training, "
    "and differences with Welch's t interval. ▲ better, ▼ worse, ≈ inconclusive",
)

# %%
html.table(
    answers.transfer_table(transfers, verdicts),
    "With transfer against without: the last difference with its 99 % interval (of the product "
    "in points)",
)

# %% [markdown]
# ## How this page was made

# %%
html.say(
    "Where the moving average of the product ends, and from when on it is near:\n\n{courses}",
    courses=html.composed(
        "\n".join(answers.course_in_words(policy, measures.MARGIN) for policy in shipped)
    ),
)

# %% [markdown]
# The curves are shipped with the policies, in `policies/trained`. These commands make them again:

# %%
again = "python -m benchmarks.learning_curves --out runs/learning"
html.say("{lines}", lines=html.commands([again, *answers.commands(shipped)]))

# %%
html.weights(folder)
