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
# # Which parameters matter?
#
# The effect of every parameter alone, the best setting of all, and the shares of the variance.

# %% tags=["parameters"]
results = "../../results"  # folder with the results folders of fig5, sweet-spot and sensitivity
learned = None  # the learned policy to show; None for the best of the study, if there is one
heuristic = None  # the other policy to show; None for the best that is not learned

# %%
from pathlib import Path

from dess.analysis import load_results, metrics, names, numbers
from dess.analysis.answers import summary
from dess.analysis.answers.policies import ranks
from dess.analysis.answers.policies.performance import plot_performance
from dess.analysis.answers.settings import shapes
from dess.analysis.answers.settings.effects import means_by_field
from dess.analysis.answers.settings.figures import plot_effect, plot_one_by_one
from dess.analysis.answers.settings.sobol import (
    index_table,
    plot_indices,
    ranges_in_words,
    sobol_indices_of,
)
from dess.analysis.paper import scorecard, values
from dess.analysis.stats.kinds import LEVEL
from dess.reports.pages.markdown import write_markdown
from dess.reports.pages.panel import make_panel
from dess.reports.pages.parts import lead_figure, make_answer, make_gallery
from dess.reports.pages.provenance import provenance_table
from dess.reports.pages.tables import make_table

# %%
folder = Path(results)
fig5, sweet, sobol = (load_results(folder / n) for n in ("fig5", "sweet-spot", "sensitivity"))
policies = ranks.leading_policies(fig5, learned, heuristic)
leading = policies[0]
effects = means_by_field(fig5)
effects = effects[effects["policy"].isin(policies)]
changes = shapes.compare_values_by_field(fig5, effects)
ratios = shapes.compare_values_by_field(fig5, effects, metrics.RATIO)
level = numbers.format_level(LEVEL)
checks = summary.means_of_check(sweet)
paper = values.printed_intervals(sweet, "sweet-spot")

# %%
make_answer(shapes.strongest_fields_sentence(effects, policies, changes))

# %%
most = effects[effects["field"].isin(shapes.strongest_fields(effects, leading))]
lead_figure(
    plot_one_by_one(effects, fig5.policies),
    "The product against every parameter",
    f"n = {numbers.format_span(effects['n'])} missions per dot, with all other parameters drawn "
    f"from Table II; bars are {level} intervals.",
    data=effects,
    narrow=plot_one_by_one(most, fig5.policies),
)

# %% [markdown]
# ## <a id="fig-5"></a>Why: the paper's Fig. 5
#
# All values meet the same random draws, so the paired differences in the lowest panels show most.
# They have an axis of their own.

# %%
make_gallery(
    [
        (
            plot_effect(effects, field, pairs, fig5.policies),
            f"The three metrics against the {names.field_named(field).within}",
            "",
            effects[effects["field"] == field],
        )
        for field, pairs in changes.items()
    ],
    f"n = {numbers.format_span(effects['n'])} missions per dot; bars are {level} intervals.",
)

# %% [markdown]
# ## <a id="sweet-spot"></a>The best setting of all

# %%
rule = sweet.manifest["study"]["selection"]
write_markdown(
    "Of {n:,} settings, the best by product was selected for every policy by "
    "<code>{rule[procedure]}</code>, with an indifference of {margin}, and simulated in "
    "{rule[check]:,} further missions. Only these are compared with the paper's means over "
    "{paper:,}.",
    n=len(sweet.manifest["points"]),
    rule=rule,
    margin=numbers.format_margin(scorecard.indifference_margin({"sweet-spot": sweet})),
    paper=values.SWEET_SPOT_MISSIONS,
)

# %%
make_gallery(
    [
        (
            plot_performance(checks, metric, paper[metric]),
            f"{name} of every policy at its best setting, and the paper's number",
            f"n = {numbers.format_span(checks['n'])} missions; bars are {level} intervals. Dashed: "
            "the paper's number, with the interval that its missions and our spread give.",
        )
        for metric, name in metrics.METRICS.items()
        if len(checks)
    ]
)

# %%
space = fig5.scenario()
make_panel(space, space, fig5.study.scenario, policies, fig5.store.manifest.seed)

# %% [markdown]
# ## The shares of the variance
#
# All parameters are drawn together. A Sobol index is the share of the variance of the collection
# ratio that a parameter explains, alone or with its interactions. The replication counts as a
# parameter: its share, below the dotted line, is noise that no setting removes.

# %%
indices = sobol_indices_of(sobol)
of_ratio = indices[indices["metric"] == metrics.RATIO].dropna()
caption = f"n = {indices['n'].min():,} missions; bars are {level} intervals, bootstrap over blocks."
make_gallery(
    [
        (plot_indices(rows, policy), f"Sobol indices of {policy}", f"{policy}: {caption}")
        for policy, rows in of_ratio.groupby("policy", sort=False)
    ]
)

# %% [markdown]
# ## How far to trust it
#
# Two values differ if their paired difference does, at the 5 % level after Holm's correction for
# all pairs of values. A metric *rises* if all differences that are significant are increases.
# Estimates of small Sobol indices may be negative.

# %% [markdown]
# ## Tables

# %%
make_table(
    shapes.shape_table(effects, changes, ratios),
    f"Product; differences in points with {level} intervals, also of the collection ratio",
    effects,
)

# %%
make_table(
    values.best_settings_table(sweet),
    f"The selected settings and their checks: means with {level} intervals, the difference "
    "from the paper in points (▲ above, ▼ below, ≈ contains it), missions, settings not ruled "
    "out, and what the selection guarantees",
    checks,
    wrap=True,
)

# %%
make_table(
    index_table(of_ratio).cells,
    f"Sobol indices of the collection ratio, with {level} intervals (bootstrap over blocks)",
    data=indices,
)

# %% [markdown]
# The [scorecard](scorecard.html) judges what the paper claims about its Fig. 5.

# %% [markdown]
# ## How this page was made

# %%
ranges = ranges_in_words(sobol.manifest["study"]["design"]["ranges"])
write_markdown(
    "The policies are the best learned one and the best heuristic of the study. For the Sobol "
    "indices all parameters are drawn together: {ranges}.",
    ranges=ranges,
)

# %%
provenance_table([fig5, sweet, sobol])
