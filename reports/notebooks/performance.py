# ---
# jupyter:
#   dess:
#     studies: [table4, fig4]
#     optional: [gap]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # How good are the policies, and the paper's?
#
# Success, collection ratio and product of every policy, beside the paper's numbers.

# %% tags=["parameters"]
results = "../../results"  # folder with the results folders of table4, fig4 and, if run, gap

# %%
from pathlib import Path

from IPython.display import display

from dess.analysis import load_results, numbers, summary, tables
from dess.analysis.answers import optimality
from dess.analysis.answers import summary as questions
from dess.analysis.answers.policies import performance, ranks
from dess.analysis.answers.policies.performance import plot_by_fleet, plot_performance
from dess.analysis.figures import comparison
from dess.analysis.metrics import METRICS, PRODUCT, RATIO, SUCCESS
from dess.analysis.paper import values
from dess.reports.pages.markdown import escape_sentences, write_markdown
from dess.reports.pages.parts import lead_figure, make_answer, make_figure, make_gallery
from dess.reports.pages.provenance import provenance_table
from dess.reports.pages.tables import make_table

# %%
table4, fig4 = (load_results(Path(results) / name) for name in ("table4", "fig4"))
policies = ranks.rank_policies(table4.missions)
overall = summary(table4.missions, by=["policy"]).set_index("policy").loc[policies].reset_index()
fleets = questions.means_by_fleet(table4.missions)
fig4_fleets = questions.means_by_fleet(fig4.missions)
paper = values.printed_intervals(table4, "table4")
fig4_paper = {uavs: values.exact(figures) for uavs, figures in values.FIG_4.items()}
bounded = optimality.results_in(Path(results) / "gap")
caption = f"n = {numbers.format_span(overall['n'])} missions per policy; bars are 95 % intervals."
dashed = "Dashed: the paper's number, with the interval that its missions and our spread give."

# %%
make_answer(
    performance.paper_sentence(overall, policies[0], values.TABLE_IV),
    performance.metrics_of_policy(overall, policies[0])[PRODUCT].partition(" [")[0],
)

# %%
lead_figure(
    plot_performance(overall, PRODUCT, paper[PRODUCT]),
    "The product of every policy, and the paper's number",
    f"{caption} {dashed}",
    overall,
)

# %% [markdown]
# ## Why

# %%
write_markdown("{text}", text=escape_sentences(performance.guard_sentences(overall)))

# %%
make_gallery(
    [
        (
            plot_performance(overall, metric, paper[metric]),
            f"{METRICS[metric]} of every policy, and the paper's number",
        )
        for metric in (SUCCESS, RATIO)
    ],
    f"{caption} {dashed}",
)

# %% [markdown]
# ## By number of UAVs
#
# The same missions, grouped by the number of UAVs that each drew.

# %%
make_gallery(
    [
        (plot_by_fleet(fleets, metric), f"{name} against the number of UAVs")
        for metric, name in METRICS.items()
    ],
    f"n = {numbers.format_span(fleets['n'])} missions per dot; bars are 95 % intervals.",
)

# %% [markdown]
# ## <a id="fig-4"></a>One setting: the paper's Fig. 4

# %%
make_gallery(
    [
        (
            plot_by_fleet(fig4_fleets, m, {i: p[m] for i, p in values.FIG_4.items()}),
            f"{METRICS[m]} against the number of UAVs, and the paper's numbers",
            f"n = {numbers.format_span(fig4_fleets['n'])} missions per dot; diamonds: the paper's "
            "numbers.",
            fig4_fleets[fig4_fleets["metric"] == m],
        )
        for m in values.FIG_4[1]
    ]
)

# %% [markdown]
# ## How far to trust it
#
# Every policy has the same missions. The paper's numbers are means over missions as well, without
# intervals. Those of Table IV have one here: from its number of missions and our spread of the
# collection ratio, where a mission that fails counts 0 in the product. Fig. 4 does not say over how
# many missions its numbers are means, so they count as exact. The paper's product is the product of
# two means, ours is the mean of products per mission. The paper does not give all constants, such
# as the place of the charging zone.

# %%
write_markdown(
    "{snr} {weights} {text}",
    snr=values.SNR_IN_WORDS,
    weights=questions.weights_in_words(table4),
    text=escape_sentences(optimality.in_words(bounded) if bounded else optimality.NOT_RUN),
)

# %%
if bounded and len(gaps := optimality.fleets_with_useful_bound(optimality.by_fleet(bounded))):
    caption = (
        f"n = {numbers.format_span(gaps['n'])} missions of the study gap, with 95 % intervals."
    )
    display(
        make_figure(
            comparison.plot_gaps(gaps), "The product of every policy, and the bound", caption
        ),
        make_table(
            optimality.fleet_bound_table(gaps), "Means, the upper bound, and the gap", data=gaps
        ),
    )

# %% [markdown]
# ## <a id="table-4"></a>Tables

# %%
marks = "▲ ours is above the paper's number by the interval of the difference, ▼ below, ≈ neither"
make_table(
    performance.compare_with_paper(overall, {None: paper}),
    f"Table IV: means with 95 % intervals, and the difference in points; {marks}",
    overall,
)

# %%
write_markdown("{text}", text=escape_sentences(performance.way_home_in_words(overall)))

# %%
make_table(
    performance.compare_with_paper(fig4_fleets, fig4_paper),
    f"Fig. 4: means with 95 % intervals, and the difference in points; {marks}",
    fig4_fleets,
)

# %%
make_table(
    tables.estimate_cells(fleets[fleets["metric"].isin(METRICS)], ["policy", "uavs", "n"]),
    "Means with 95 % intervals, by number of UAVs",
    fleets,
)

# %% [markdown]
# ## How this page was made

# %%
write_markdown(
    "Every mission of Table IV draws its parameters from Table II. Those of Fig. 4 have C_S "
    "{charge_start[0]} %, C_C {charge_complete[0]} %, {initial_data[0]:g} data units per node and "
    "a flying time of {flying_time[0]}.",
    **fig4.manifest["scenario"],
)

# %%
provenance_table([table4, fig4, *([bounded] if bounded else [])])
