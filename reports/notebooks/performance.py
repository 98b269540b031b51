# ---
# jupyter:
#   dess:
#     studies: [table4, fig4]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Performance
#
# How often every policy fills its communication quota and how much of the data it brings home,
# beside the figures that the paper prints for its learned policy.

# %% tags=["parameters"]
results = "../../results"  # folder that holds the results folders of the studies table4 and fig4

# %%
from pathlib import Path

from analysis import load_results, numbers, summary
from analysis.figures import policies as figures
from analysis.names import METRICS, PRODUCT, SUCCESS
from analysis.questions import printed
from analysis.questions.summary import best_policy, by_fleet, fleet_table, guard_in_words
from analysis.replication import paper
from reports.pages import html

# %%
table4, fig4 = (load_results(Path(results) / name) for name in ("table4", "fig4"))
overall = summary(table4.missions, by=["policy"])
fleets, fig4_fleets = by_fleet(table4.missions), by_fleet(fig4.missions)

# %% [markdown]
# ## <a id="table-4"></a>Random missions: the paper's Table IV

# %%
html.say(
    "{n:,} missions per policy, each with a number of UAVs, a flying time, charging thresholds and "
    "initial data of its own (Table II). Every policy has the same missions: the same initial "
    "data, arrivals and shadowing.",
    n=overall["n"].min(),
)

# %%
caption = f"n = {overall['n'].min():,} missions per policy, bars are 95 % intervals."
html.gallery(
    [
        (
            figures.performance(overall, metric, paper.TABLE_IV[metric]),
            f"{name} of every policy, beside the paper's figure",
            f"{caption} Dashed: the paper.",
        )
        for metric, name in METRICS.items()
    ]
)

# %%
html.table(
    printed.beside(overall, paper.TABLE_IV),
    "Means with 95 % intervals, and the difference to the paper in percentage points. "
    "▲ the whole interval is above the paper's figure, ▼ below it, ≈ around it: inconclusive.",
)

# %%
html.say(guard_in_words(overall))

# %%
best = best_policy(table4.missions)
rows = overall[overall["policy"] == best].set_index("metric")[["mean", "low", "high"]]
html.say(
    "The best policy by collection ratio and communication is **{best}**: {product}, with success "
    "{success}.",
    best=best,
    product=numbers.interval(*rows.loc[PRODUCT]),
    success=numbers.interval(*rows.loc[SUCCESS]),
)

# %%
html.say(
    "The paper prints no intervals. Its figures are themselves means of {n:,} missions: a success "
    "of that size alone has a 95 % interval of {interval}. And where the paper is silent, such as "
    "on the place of the charging zone or the transmit power, the scenario here decides.",
    n=paper.TABLE_IV_MISSIONS,
    interval=numbers.interval(*paper.spread(paper.TABLE_IV[SUCCESS], paper.TABLE_IV_MISSIONS)),
)

# %% [markdown]
# ## By number of UAVs
#
# The same missions, split by the size of the fleet that they drew.

# %%
caption = f"n = {numbers.span(fleets['n'])} missions per policy and size, bars are 95 % intervals."
html.gallery(
    [
        (figures.by_fleet(fleets, metric), f"{name} against the number of UAVs", caption)
        for metric, name in METRICS.items()
    ]
)

# %%
html.table(fleet_table(fleets), "Means with 95 % intervals")

# %% [markdown]
# ## <a id="fig-4"></a>One setting: the paper's Fig. 4

# %%
html.say(
    "C<sub>S</sub> {charge_start[0]} %, C<sub>C</sub> {charge_complete[0]} %, {initial_data[0]:g} "
    "data units per node, flying time {flying_time[0]}; {n:,} missions per policy and fleet size. "
    "The paper does not say over how many missions its figures are means.",
    n=fig4_fleets["n"].min(),
    **fig4.manifest["scenario"],
)

# %%
caption = f"n = {numbers.span(fig4_fleets['n'])} missions per policy and size"
html.gallery(
    [
        (
            figures.by_fleet(fig4_fleets, m, {i: p[m] for i, p in paper.FIG_4.items()}),
            f"{METRICS[m]} against the number of UAVs, beside the paper's figures",
            f"{caption}, bars are 95 % intervals. Diamonds: the paper.",
        )
        for m in paper.FIG_4[1]
    ]
)

# %%
html.table(
    printed.beside_by_fleet(fig4_fleets, paper.FIG_4),
    "Means with 95 % intervals; ▲ wholly above the paper's figure, ▼ below it, ≈ around it",
)

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([table4, fig4])
