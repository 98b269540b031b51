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

from IPython.display import display

from analysis import load_results, names, numbers
from analysis.figures import parameters as figures
from analysis.figures.policies import performance
from analysis.questions import main_effects, sensitivity, summary
from analysis.replication import paper, scorecard, sweet_spot
from analysis.replication.claims import FIG_5
from analysis.replication.verdict_rules import NO_RESULTS
from analysis.stats.intervals import LEVEL
from reports.pages import html

# %%
folder = Path(results)
fig5, sweet, sobol = (load_results(folder / n) for n in ("fig5", "sweet-spot", "sensitivity"))
policies = main_effects.leading_policies(fig5, learned, heuristic)
leading = policies[0]
effects = main_effects.effects(fig5)
effects = effects[effects["policy"].isin(policies)]
changes = main_effects.changes_by_field(fig5, effects)
ratios = main_effects.changes_by_field(fig5, effects, names.RATIO)
level = numbers.level(LEVEL)
rule, checks = sweet.manifest["study"]["selection"], summary.checks(sweet)

# %% [markdown]
# ## <a id="fig-5"></a>One by one: the paper's Fig. 5

# %%
html.say(
    "Of the best learned policy of the study, if there is one, and the best heuristic: "
    "{policies}. Every value of a parameter was simulated in {n:,} missions per policy, everything "
    "else drawn from Table II. All values, and all policies, have the same realisation of all "
    "other random draws. So the lowest panel shows more than the others: the change from the "
    "first value on, mission by mission, without what the missions have in common. Its axis is "
    "its own; those of the metrics are the same for all parameters. Both policies act under the "
    "return guard, which allows only actions after which a UAV can still reach the charging zone "
    "in time: that is why nearly all missions succeed whatever the values are.",
    policies=numbers.words([f"**{policy}**" for policy in policies]),
    n=effects["n"].min(),
)

# %%
html.gallery(
    [
        (
            figures.effect(effects, field, pairs, fig5.policies),
            f"The three metrics against the {names.parameter(field).within}",
            f"n = {effects.groupby('field')['n'].min()[field]:,} missions per point, bars are "
            f"{level} intervals.",
        )
        for field, pairs in changes.items()
    ]
)

# %% [markdown]
# ### What one sees
#
# Two values differ if they do mission by mission, at the 5 % level after Holm's correction for the
# number of pairs. Along the values, a metric *rises* if some values differ and all that do go up,
# *falls* if all go down, *stays level* if none differ; *rises, then falls* if nothing before a
# value falls and nothing behind it rises.
#
# A value that is the highest may be one of several that do not differ. The largest difference is
# that of any two values.

# %%
html.table(
    main_effects.listed(effects, changes, ratios),
    f"Collection ratio and communication; differences in percentage points, with {level} "
    "intervals. Beside the last minus the first value stands the same difference of the collection "
    "ratio alone, which failed missions do not lower",
)

# %% [markdown]
# ### What the paper sees

# %%
studies = {"fig5": fig5, "sweet-spot": sweet}
rows = scorecard.of_policy(studies, leading, FIG_5)
rows = [row for row in rows if row.findings[0].verdict != NO_RESULTS]
html.say(
    "The claims of the paper on its Fig. 5, and their verdicts for {leading}, by the rules of the "
    "replication scorecard. One is inconclusive where the missions are too few for either "
    "answer. They overlap, so their number is no score.\n\n{claims}",
    leading=leading,
    claims=scorecard.listed(rows),
)

# %% [markdown]
# ## <a id="sweet-spot"></a>All together: the sweet spot

# %%
html.say(
    "Of {n:,} settings, the one with the highest mean of {metric} was selected for every policy, "
    "by `{rule[procedure]}` with an indifference of {margin}. A winner's mean is too high, because "
    "it won for it; so it was simulated in {rule[check]:,} further missions that had no part in "
    "the selection, and only these are shown beside the paper's figures (means of {paper:,} "
    "missions, all parameters at their best).",
    n=len(sweet.manifest["points"]),
    metric=names.METRICS[rule["metric"]].lower(),
    rule=rule,
    margin=numbers.margin(scorecard.margin(studies)),
    paper=paper.SWEET_SPOT_MISSIONS,
)

# %%
caption = "The check: n = {:,} missions per policy, bars are {} intervals. Dashed: the paper."
html.gallery(
    [
        (
            performance(checks, metric, paper.SWEET_SPOT[metric]),
            f"{name} of every policy at its best setting, beside the paper's figure",
            caption.format(checks["n"].min(), level),
        )
        for metric, name in names.METRICS.items()
        if len(checks)
    ]
)

# %%
html.table(
    sweet_spot.table(sweet),
    f"The setting selected, and its check: means with {level} intervals, ▲ wholly above "
    "the paper's figure, ▼ below it, ≈ around it. Then the missions that the selection took, and "
    "the settings that were not ruled out, itself among them",
)

# %%
html.say(
    "What is known of the selections:\n\n{guarantees}", guarantees=sweet_spot.guarantees(sweet)
)

# %%
contrary = sweet_spot.against_main_effects(sweet, effects, changes)
if contrary:
    display(
        html.say(
            "Where a selected value is lower than another by its main effect above:\n\n{contrary}",
            contrary=contrary,
        )
    )

# %% [markdown]
# ## What matters at all: sensitivity

# %%
html.say(
    "Here all parameters are drawn together: {ranges}. A Sobol index is the share of a metric's "
    "variance that a parameter accounts for: *alone*, or *with all interactions* that it takes "
    "part in. The replication, which is the realisation of all random draws, is a parameter too: "
    "what it accounts for, no setting removes.",
    ranges=sensitivity.ranges_in_words(sobol.manifest["study"]["design"]["ranges"]),
)

# %% [markdown]
# The figures are about the collection ratio: the product differs from it in failed missions alone,
# and these are too few here to take shares of. The intervals come from a bootstrap over the blocks
# of the design, a block being a mission of each base sample and those between them; they are wider
# than need be where the parameters rule. Estimates are not cut: that of a small share may be
# negative, an interval may go beyond 100 %. Below the dotted line: noise.

# %%
indices = summary.sensitivities(sobol)
of_ratio = indices[indices["metric"] == names.RATIO].dropna()
failed = sensitivity.failures_in_words(sobol.missions)
caption = f"n = {indices['n'].min():,} missions; lines: {level} intervals, bootstrap over blocks."
html.gallery(
    [
        (figures.sensitivity(rows, policy), f"Sobol indices of {policy}", f"{policy}: {caption}")
        for policy, rows in of_ratio.groupby("policy", sort=False)
    ]
)

# %%
html.table(
    sensitivity.index_table(indices),
    f"Sobol indices as shares of the variance, with {level} intervals (bootstrap over the blocks "
    "of the design). A metric that is the same in all missions of both base samples has no "
    f"variance to take shares of, and no row. Rows of success and of the product rest on {failed}",
)

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([fig5, sweet, sobol])
