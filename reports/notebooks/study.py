# ---
# jupyter:
#   dess:
#     studies: [.]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # A study
#
# The name and the description of the study take the place of these lines.

# %% tags=["parameters"]
results = "../../results/charge-limits"  # the results folder of the study
metric = None  # the metric that ranks the settings; None: that of the selection, or the product
baseline = 0  # the number of the design point with which all others are compared

# %%
from pathlib import Path

import numpy as np

from dess.analysis import distribution, load_results, tables
from dess.analysis.answers import decided, distributions, summary
from dess.analysis.answers.fleet import tables as fleet_tables
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.fleet.costs import cost_front_table, cost_parts_table
from dess.analysis.answers.fleet.figures import draw_cost_fronts
from dess.analysis.answers.main_figure import draw_main_figure
from dess.analysis.answers.policies import comparisons, ranks
from dess.analysis.answers.policies.performance import draw_performance
from dess.analysis.answers.settings.baseline import baseline_in_words, baseline_table
from dess.analysis.answers.settings.effects import effect_table
from dess.analysis.answers.settings.figures import (
    draw_curves,
    draw_heat_maps,
    draw_main_effects,
    draw_one_at_a_time,
    draw_scatter,
    draw_small_multiples,
    plot_distribution,
)
from dess.analysis.answers.settings.home import with_way_home
from dess.analysis.answers.settings.points import varied_values
from dess.analysis.answers.settings.ranking import (
    allowance_for_setting,
    best_of_policies_table,
    missions_at_best,
    rank_settings,
    ranked_table,
)
from dess.analysis.answers.settings.sobol import (
    draw_indices,
    index_table,
    sobol_indices_of,
    variance_sentence,
)
from dess.analysis.answers.settings.years import year_table
from dess.analysis.answers.worst_missions import worst_missions, worst_missions_table
from dess.analysis.ask.answer import settings_answer
from dess.analysis.ask.assumptions import assumption_facts
from dess.analysis.metrics import METRICS, SUCCESS, metric_of
from dess.reports.pages import study as page
from dess.reports.pages.markdown import write_markdown
from dess.reports.pages.parts import (
    lead_figure,
    make_answer,
    make_assumptions,
    make_facts,
    make_gallery,
    show_parts,
)
from dess.reports.pages.provenance import provenance_table
from dess.reports.pages.templates import render_part

# %%
study = load_results(Path(results))
by = page.leading_metric(study, metric)
metrics = page.shown_metrics(study, by)
called = metric_of(by).within

# %% tags=["if-cheapest"]
search = search_of(study)

# %% tags=["if-answer"]
ranked = rank_settings(study, by)
best = ranked.iloc[0]

# %% tags=["if-ranked"]
answer = settings_answer(study, metric=by)
make_answer(answer.headline())

# %% tags=["if-sensitivity"]
make_answer(variance_sentence(study, by))

# %%
lead_figure(*draw_main_figure(study, by))

# %% tags=["if-ranked"]
make_facts(answer.facts())

# %% tags=["if-brief"]
show_parts(page.draw_typical_mission(study))

# %% tags=["if-years"]
show_parts(page.draw_years(study, by))

# %% tags=["if-missions"]
page.make_panel_of(study, by)

# %% tags=["if-sheet"]
make_assumptions(assumption_facts(study, by))

# %% [markdown] tags=["if-cheapest"]
# ## Why
#
# An operator decides on the fleet. The other fields are conditions under which it has to work. A
# fleet gets no further missions once a cheaper one is known to meet the requirements.

# %% tags=["if-cheapest"]
show_parts(fleet_tables.fleet_table(study, by if metric else SUCCESS))

# %% tags=["if-conditions"]
show_parts(fleet_tables.condition_table(study))

# %% [markdown] tags=["if-around", "if-missions"]
# ## What if
#
# One more UAV or pad, on the same missions.

# %% [markdown] tags=["if-around", "if-years"]
# ## What decides
#
# The night, each limit of the weather, the fleet and its speed: one change at a time, in the same
# years, as in the figure above.

# %% tags=["if-around"]
from dess.analysis.ask import around
from dess.analysis.ask.falls import draw_falls

# %% tags=["if-around"]
show_parts(around.table_around(study), draw_falls(study))

# %% [markdown] tags=["if-years"]
# ## Year by year

# %% tags=["if-years"]
show_parts(year_table(study, *page.shown_setting(study, by)))

# %% [markdown] tags=["if-cheapest"]
# ## How far to trust it

# %% [markdown] tags=["if-cheapest", "if-missions"]
# The check had no part in the selection, so its means are unbiased.

# %% tags=["if-cheapest", "if-missions"]
no_check = write_markdown("No setting was checked.")
show_parts(no_check if study.checks.empty else fleet_tables.check_table(study))

# %% tags=["if-cheapest"]
write_markdown("{guarantees}", guarantees=page.list_guarantees(study))

# %% [markdown] tags=["if-settings"]
# ## The best settings
#
# A *setting* is a policy at a design point. It *may be the best* (≈) if no other one is
# significantly better in what was seen. With a probability of 95 %, the truly best is among these
# and those that are only *not in what was seen* (▽), where a rare failure is not ruled out (paired
# t tests on common replications, corrected for the number of settings and, after a search, of its
# looks). So a setting of few missions may be the best although its mean is much lower.
# The mean of the first tends to be too high, since it was ranked first for it.

# %% tags=["if-settings"]
show_parts(
    ranked_table(study, ranked, by),
    best_of_policies_table(study, by),
    write_markdown("{why}", why=allowance_for_setting(study, ranked, by)),
)

# %% tags=["if-one-setting"]
of_policies = metrics if study.study.years else METRICS
show_parts(
    (draw_performance(study, of) for of in of_policies),
    tables.means_table(summary.means_of_points(study), metrics=with_way_home(study, of_policies)),
    write_markdown("{weights}", weights=summary.weights_in_words(study)),
)

# %% [markdown] tags=["if-priced-search"]
# ## Costs

# %% tags=["if-priced-search"]
show_parts(cost_parts_table(study))

# %% [markdown] tags=["if-costs"]
# ## Costs
#
# A setting is on the *Pareto front* if no other one is at most as expensive and at least as good.
# The probability of being on it comes from a Bayesian bootstrap over common replications.

# %% tags=["if-costs"]
show_parts(
    draw_cost_fronts(study),
    cost_front_table(study),
    cost_parts_table(study),
)

# %% [markdown] tags=["if-selection"]
# ## The selection
#
# A ranking-and-selection procedure decided how many missions each setting gets. Those with few
# missions were ruled out early. The check had no part in the selection.

# %% tags=["if-selection"]
show_parts(
    decided.selection_table(study),
    write_markdown("{guarantees}", guarantees=page.list_guarantees(study)),
    tables.means_table(
        summary.means_of_check(study), tables.CHECKED, with_way_home(study, metrics)
    ),
)

# %% [markdown] tags=["if-precision"]
# ## The precision
#
# Missions were simulated until the estimates were precise enough, or the budget was spent.

# %% tags=["if-precision"]
show_parts(decided.precision_table(decided.reached_precisions(study)))

# %% [markdown] tags=["if-fields"]
# ## Effects of the fields

# %% tags=["if-one-field"]
(field,) = varied_values(study)
make_gallery(draw_curves(study, field, metric=of) for of in metrics)

# %% tags=["if-two-fields"]
make_gallery(draw_heat_maps(study, metrics))

# %% tags=["if-many-fields"]
make_gallery(draw_small_multiples(study, by))

# %% tags=["if-one-at-a-time"]
make_gallery(draw_one_at_a_time(study))

# %% tags=["if-sampled"]
make_gallery(draw_scatter(study, of) for of in metrics)

# %% tags=["if-sensitivity"]
show_parts(draw_indices(study, by), index_table(sobol_indices_of(study)))

# %% [markdown] tags=["if-sensitivity"]
# A Sobol index is the share of a metric's variance that a field explains: *alone*, or *with all
# interactions*. The replication counts as a field: its share is noise that no setting removes.

# %% tags=["if-effects"]
show_parts((draw_main_effects(study, of) for of in metrics), effect_table(study, by))

# %% [markdown] tags=["if-settings"]
# ## Comparison with a baseline

# %% tags=["if-settings"]
write_markdown(
    "Every policy is compared with itself at design point "
    "{point}: {words}. The parameter `baseline` names another point.",
    point=baseline,
    words=baseline_in_words(study, baseline),
)

# %% tags=["if-settings"]
show_parts(baseline_table(study, baseline, by))

# %% [markdown] tags=["if-policies"]
# ## Comparison of the policies
#
# The differences are means over all design points, computed replication by replication.

# %% tags=["if-policies"]
compared = comparisons.comparison_table(study)
show_parts(
    compared,
    write_markdown("{why}", why=comparisons.allowance_for_difference(compared.data, "policy")),
)

# %% tags=["if-learned"]
show_parts(comparisons.learner_table(study))

# %% [markdown] tags=["if-missions"]
# ## Single missions

# %% tags=["if-answer", "if-missions"]
missions = missions_at_best(study, ranked)
whose = f"every policy at its best setting by {called}"
worst = worst_missions(study, best["policy"], point=best["point"])

# %% tags=["if-cheapest", "if-missions"]
missions = search.shown_missions
whose = "the fleet of the answer"
worst = worst_missions(study, search.best.policy, point=search.shown_point)

# %% tags=["if-ranked", "if-missions"]
spread = distribution(missions, by, np.random.default_rng(study.store.manifest.seed))
show_parts(
    write_markdown("These figures show {whose}:", whose=whose),
    [plot_distribution(missions, by)],
    distributions.quantile_table(spread, by),
)

# %% tags=["if-sensitivity", "if-missions"]
worst = worst_missions(study, ranks.best_policy(study.missions))

# %% tags=["if-missions"]
show_parts(
    worst_missions_table(study, worst),
    write_markdown("{commands}", commands=page.list_commands(study, worst)),
)

# %% tags=["if-sheet"]
render_part("left_out.html")

# %% [markdown]
# ## How this page was made

# %%
write_markdown("{simulated}", simulated=page.list_simulated(study))

# %%
provenance_table([study])
