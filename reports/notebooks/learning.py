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

from dess.analysis import numbers
from dess.analysis.answers import learning as answers
from dess.analysis.paper import measures, scorecard, values
from dess.policies.registry import TRAINED
from dess.reports.pages import html

# %%
folder = Path(str(trained or TRAINED))
trainings = answers.read_curves(folder / "curves.parquet")
last = answers.last_rows(trainings)
baseline = answers.BASELINE
rungs = answers.rows_of_ladder(last)
equal = answers.of_equal_budget(last, baseline)

# %%
html.make_answer(answers.methods_sentence(rungs))

# %%
html.lead_figure(*answers.draw_method_ladder(rungs))

# %% [markdown]
# ## Why: the effect of each method
#
# Every variant is the config `quick` with the changes of its name, and as many updates. The
# **guard** masks actions after which it is too late to return for charging. With **low-battery
# starts** some missions begin in the zone with little battery, and with **early returns** some UAVs
# return as soon as they may. **Transfer**: phase I, without battery decrease, comes first. **maps**
# is the paper's network.

# %%
table = answers.compare_variants(equal, baseline)
html.make_figure(
    *answers.draw_variants(table, equal, baseline, "The product that every variant reaches")
)

# %% [markdown]
# What a method adds depends on the methods that are there before it.
#
# <a id="reward"></a>The paper says that its small reward for charging and its large one for a
# filled quota balance collecting and charging. "None of the three" has these rewards, and none of
# our methods.

# %%
html.write_markdown("{text}", text=answers.without_each(last))

# %% [markdown]
# ## <a id="fig-3"></a>Transfer learning: the paper's Fig. 3
#
# The paper claims a higher reward at every step, and a higher product in the end. A training learns
# to charge from transitions in which a UAV enters the zone with a low battery and waits there.

# %%
lines = [
    f"- {name}: {answers.learning_to_charge(last, using)} with transfer, "
    f"{answers.learning_to_charge(last, without)} without"
    for name, (using, without) in answers.pairs_in(trainings).items()
]
html.write_markdown(
    "Trainings that learn to charge:\n\n{lines}", lines=html.escape_sentences("\n".join(lines))
)

# %%
html.make_gallery(answers.transfer_drawings(trainings), answers.TRAININGS)

# %% [markdown]
# ## The shipped policies

# %%
shipped = answers.trained_policies(folder)
html.make_gallery(answers.shipped_drawings(shipped), answers.TRAININGS)

# %% [markdown]
# ## How far to trust it
#
# Trainings of a variant differ only in their seed. A variant that was trained once has no interval.
# P-values are corrected for the number of tests (Holm). The result of a training is the plain mean
# of missions that draw the number of UAVs. Other pages have other missions, and give each number of
# UAVs the same weight, so their mean of the same policy may differ by about a point.

# %%
transfers = answers.compare_all_transfers(trainings, answers.SHOWN, shortest=values.CROSSING)
rules = dict(zip(answers.SHOWN, ("throughout", "passes"), strict=True))
verdicts = {key: scorecard.RULES[rules[key[1]]].judge(t) for key, t in transfers.items()}
best = last.groupby("variant")[answers.FINAL].max().map(numbers.format_percent)
pair, variants = [*answers.pairs_in(trainings).items()][-1]

# %%
html.write_markdown(
    "The longest of these pairs have {steps:,} steps; in the paper the curves cross at {paper:,}, "
    "and shorter trainings are inconclusive. With {name}, the best training with transfer reaches "
    "a product of {ends[0]}, the best without {ends[1]}.",
    steps=max(compared.length for compared in transfers.values()),
    paper=values.CROSSING,
    name=pair,
    ends=[best[variant] for variant in variants],
)

# %% [markdown]
# ## Tables

# %%
html.make_table(
    answers.ablation_table(table, equal, baseline),
    "Means over n trainings with 95 % intervals, the prediction interval of one new training, "
    "and differences with Welch's t interval. ▲ better, ▼ worse, ≈ inconclusive, by the "
    "interval, which is not corrected for the number of variants",
    table,
)

# %%
compared = answers.transfer_table(transfers, verdicts)
html.make_table(
    compared,
    "With transfer against without: the last difference with its 99 % interval (of the product "
    "in points)",
    compared,
)

# %% [markdown]
# ## How this page was made

# %%
html.write_markdown(
    "Where the moving average of the product ends, and from when on it is near:\n\n{courses}",
    courses=html.escape_sentences(
        "\n".join(answers.course_in_words(policy, measures.MARGIN) for policy in shipped)
    ),
)

# %% [markdown]
# The curves are shipped with the policies, in `policies/trained`. These commands make them again:

# %%
again = "python -m benchmarks.learning_curves --out runs/learning"
html.write_markdown(
    "{lines}", lines=html.command_block([again, *answers.training_commands(shipped)])
)

# %%
html.weights_table(folder)
