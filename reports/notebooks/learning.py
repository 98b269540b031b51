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
from dess.analysis.answers.training.curves import BASELINE, SHOWN, TRAININGS, pairs_in, read_curves
from dess.analysis.answers.training.trained import (
    course_in_words,
    shipped_drawings,
    trained_policies,
    training_commands,
)
from dess.analysis.answers.training.transfer import (
    compare_all_transfers,
    transfer_drawings,
    transfer_table,
)
from dess.analysis.answers.training.variants import (
    FINAL,
    ablation_table,
    compare_variants,
    draw_method_ladder,
    draw_variants,
    last_rows,
    learning_to_charge,
    methods_sentence,
    of_equal_budget,
    rows_of_ladder,
    without_each,
)
from dess.analysis.paper import measures, scorecard, values
from dess.policies.registry import TRAINED
from dess.reports.pages.markdown import command_block, escape_sentences, write_markdown
from dess.reports.pages.parts import lead_figure, make_answer, make_figure, make_gallery
from dess.reports.pages.provenance import weights_table
from dess.reports.pages.tables import make_table

# %%
folder = Path(str(trained or TRAINED))
trainings = read_curves(folder / "curves.parquet")
last = last_rows(trainings)
baseline = BASELINE
rungs = rows_of_ladder(last)
equal = of_equal_budget(last, baseline)

# %%
make_answer(methods_sentence(rungs))

# %%
lead_figure(*draw_method_ladder(rungs))

# %% [markdown]
# ## Why: the effect of each method
#
# Every variant is the config `quick` with the changes of its name, and as many updates. The
# **guard** masks actions after which it is too late to return for charging. With **low-battery
# starts** some missions begin in the zone with little battery, and with **early returns** some UAVs
# return as soon as they may. **Transfer**: phase I, without battery decrease, comes first. **maps**
# is the paper's network.

# %%
table = compare_variants(equal, baseline)
make_figure(*draw_variants(table, equal, baseline, "The product that every variant reaches"))

# %% [markdown]
# What a method adds depends on the methods that are there before it.
#
# <a id="reward"></a>The paper says that its small reward for charging and its large one for a
# filled quota balance collecting and charging. "None of the three" has these rewards, and none of
# our methods.

# %%
write_markdown("{text}", text=without_each(last))

# %% [markdown]
# ## <a id="fig-3"></a>Transfer learning: the paper's Fig. 3
#
# The paper claims a higher reward at every step, and a higher product in the end. A training learns
# to charge from transitions in which a UAV enters the zone with a low battery and waits there.

# %%
lines = [
    f"- {name}: {learning_to_charge(last, using)} with transfer, "
    f"{learning_to_charge(last, without)} without"
    for name, (using, without) in pairs_in(trainings).items()
]
write_markdown(
    "Trainings that learn to charge:\n\n{lines}", lines=escape_sentences("\n".join(lines))
)

# %%
make_gallery(transfer_drawings(trainings), TRAININGS)

# %% [markdown]
# ## The shipped policies

# %%
shipped = trained_policies(folder)
make_gallery(shipped_drawings(shipped), TRAININGS)

# %% [markdown]
# ## How far to trust it
#
# Trainings of a variant differ only in their seed. A variant that was trained once has no interval.
# P-values are corrected for the number of tests (Holm). The result of a training is the plain mean
# of missions that draw the number of UAVs. Other pages have other missions, and give each number of
# UAVs the same weight, so their mean of the same policy may differ by about a point.

# %%
transfers = compare_all_transfers(trainings, SHOWN, shortest=values.CROSSING)
rules = dict(zip(SHOWN, ("throughout", "passes"), strict=True))
verdicts = {key: scorecard.RULES[rules[key[1]]].judge(t) for key, t in transfers.items()}
best = last.groupby("variant")[FINAL].max().map(numbers.format_percent)
pair, variants = [*pairs_in(trainings).items()][-1]

# %%
write_markdown(
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
make_table(
    ablation_table(table, equal, baseline),
    "Means over n trainings with 95 % intervals, the prediction interval of one new training, "
    "and differences with Welch's t interval. ▲ better, ▼ worse, ≈ inconclusive, by the "
    "interval, which is not corrected for the number of variants",
    table,
)

# %%
compared = transfer_table(transfers, verdicts)
make_table(
    compared,
    "With transfer against without: the last difference with its 99 % interval (of the product "
    "in points)",
    compared,
)

# %% [markdown]
# ## How this page was made

# %%
write_markdown(
    "Where the moving average of the product ends, and from when on it is near:\n\n{courses}",
    courses=escape_sentences(
        "\n".join(course_in_words(policy, measures.MARGIN) for policy in shipped)
    ),
)

# %% [markdown]
# The curves are shipped with the policies, in `policies/trained`. These commands make them again:

# %%
again = "python -m benchmarks.learning_curves --out runs/learning"
write_markdown("{lines}", lines=command_block([again, *training_commands(shipped)]))

# %%
weights_table(folder)
