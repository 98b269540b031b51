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
# This page shows the effects of the number of UAVs, the charging thresholds, the initial data and
# the flying time: one parameter at a time as in the paper's Fig. 5, the best setting of all
# parameters, and the share of the variance that each parameter explains.

# %% tags=["parameters"]
results = "../../results"  # folder with the results folders of fig5, sweet-spot and sensitivity
learned = None  # the learned policy to show; None for the best of the study, if there is one
heuristic = None  # the other policy to show; None for the best that is not learned

# %%
from pathlib import Path

from analysis import load_results, names, numbers
from analysis.figures import settings as figures
from analysis.questions import main_effects, sensitivity, summary
from analysis.replication import paper, scorecard, sweet_spot
from analysis.replication.claims import SECTIONS
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
    "The policies are the best learned one of the study, if there is one, and the best heuristic: "
    "{policies}. Every value of a parameter was simulated in {n:,} missions per policy, with all "
    "other parameters drawn from Table II. All values and policies have the same other random "
    "draws (common random numbers).",
    policies=html.composed(numbers.words([f"**{policy}**" for policy in policies])),
    n=effects["n"].min(),
)

# %% [markdown]
# Therefore the paired difference from the first value, in the lowest panel, shows most. This panel
# has its own axis. Nearly all missions succeed, since both policies act under the return guard,
# which allows only actions after which a UAV can still reach the charging zone in time.

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
# ### The effects in words
#
# Two values differ significantly if their paired difference does, at the 5 % level after Holm's
# correction for the number of pairs. A metric *rises* if some values differ significantly and all
# these differences are increases, *falls* if all are decreases, and *stays level* if no values
# differ. It *rises, then falls* if there is a value with no decrease before it and no increase
# after it. Several values may have the highest mean if they do not differ significantly.

# %%
html.table(
    main_effects.listed(effects, changes, ratios),
    f"Collection ratio and communication; differences in points with {level} intervals. The last "
    "minus the first value is also shown for the collection ratio, which failures do not lower",
)

# %% [markdown]
# ### The paper's claims

# %%
studies = {"fig5": fig5, "sweet-spot": sweet}
rows = scorecard.of_policy(studies, leading, SECTIONS["fig-5"])
rows = [row for row in rows if row.findings[0].verdict != NO_RESULTS]
html.say(
    "The paper's claims about its Fig. 5, and the verdicts for {leading}:\n\n{claims}",
    leading=leading,
    claims=html.composed(scorecard.listed(rows)),
)

# %% [markdown]
# Verdicts follow from the rules of the scorecard: *inconclusive* means too few missions. Claims
# overlap, so the number of verdicts is not a score.

# %% [markdown]
# ## <a id="sweet-spot"></a>All together: the sweet spot

# %%
html.say(
    "Of {n:,} settings, the one with the highest mean of {metric} was selected for every policy, "
    "by <code>{rule[procedure]}</code> with an indifference of {margin}. The mean of a selected "
    "setting tends to be too high, because it was selected for its high mean. So each selected "
    "setting was simulated in {rule[check]:,} additional missions, and only these are compared "
    "with the paper's numbers (means of {paper:,} missions, with all parameters at their best).",
    n=len(sweet.manifest["points"]),
    metric=names.METRICS[rule["metric"]].lower(),
    rule=rule,
    margin=numbers.margin(scorecard.margin(studies)),
    paper=paper.SWEET_SPOT_MISSIONS,
)

# %%
caption = "The check: n = {:,} missions per policy, bars are {} intervals. Dashed line: the paper."
html.gallery(
    [
        (
            figures.performance(checks, metric, paper.SWEET_SPOT[metric]),
            f"{name} of every policy at its best setting, and the paper's number",
            caption.format(checks["n"].min(), level),
        )
        for metric, name in names.METRICS.items()
        if len(checks)
    ]
)

# %%
html.table(
    sweet_spot.table(sweet),
    f"The selected setting and its check: means with {level} intervals, and the difference from "
    "the paper in percentage points (▲ above the paper's number, ▼ below, ≈ contains it), the "
    "number of missions of the selection, and the number of settings that were not ruled out, the "
    "selected one included",
)

# %%
html.say(
    "The guarantees of the selections:\n\n{known}\n\nA selected value may be lower than another "
    "by its main effect above, which is a mean over everything else that the missions draw; at the "
    "selected setting all else is fixed.",
    known=html.composed(sweet_spot.guarantees(sweet)),
)

# %% [markdown]
# ## Sensitivity: which parameters matter

# %%
ranges = sensitivity.ranges_in_words(sobol.manifest["study"]["design"]["ranges"])
html.say("Here all parameters are drawn together: {ranges}.", ranges=ranges)

# %% [markdown]
# A Sobol index is the share of a metric's variance that a parameter explains, *alone* or *with all
# interactions* that it takes part in. The replication, which determines all random draws, counts as
# a parameter: its share is noise that no setting removes.
#
# The figures show the collection ratio. The product differs from it only in failed missions, which
# are too few here. The intervals come from a bootstrap over the blocks of the design; they are too
# wide where the parameters dominate. Estimates are not limited to 0 to 100 %; that of a small share
# may be negative. Below the dotted line is the noise.

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
    f"Sobol indices as shares of the variance, with {level} intervals (bootstrap over blocks). A "
    f"metric without variance has no row. Rows of success and the product depend on only {failed}",
)

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([fig5, sweet, sobol])
