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
# # Performance
#
# This page shows how often every policy fills its communication quota, and how much of the data it
# collects, and compares both with the numbers that the paper prints for its learned policy.

# %% tags=["parameters"]
results = "../../results"  # folder with the results folders of table4, fig4 and, if run, gap

# %%
from pathlib import Path

from IPython.display import display

from analysis import load_results, numbers, summary
from analysis.figures import comparison
from analysis.figures import settings as figures
from analysis.names import METRICS, PRODUCT, SUCCESS
from analysis.questions import summary as questions
from analysis.questions.optimality import gap
from analysis.replication import paper
from reports import tables
from reports.pages import html

# %%
table4, fig4 = (load_results(Path(results) / name) for name in ("table4", "fig4"))
overall = summary(table4.missions, by=["policy"])
fleets, fig4_fleets = questions.by_fleet(table4.missions), questions.by_fleet(fig4.missions)
bounded = gap.results_in(Path(results) / "gap")

# %% [markdown]
# ## <a id="table-4"></a>Random missions: the paper's Table IV

# %%
html.say("There are {n:,} missions per policy.", n=overall["n"].min())

# %% [markdown]
# Each mission has a number of UAVs, a flying time, charging thresholds and initial data of its own
# (Table II). Every policy has the same missions: the same initial data, arrivals and shadowing.

# %%
caption = f"n = {overall['n'].min():,} missions per policy, bars are 95 % intervals."
html.gallery(
    [
        (
            figures.performance(overall, metric, paper.TABLE_IV[metric]),
            f"{name} of every policy, and the paper's number",
            f"{caption} The dashed line is the paper's number.",
        )
        for metric, name in METRICS.items()
    ]
)

# %%
html.table(
    questions.beside_paper(overall, {None: paper.TABLE_IV}),
    "Means with 95 % intervals, and the difference from the paper in percentage points. ▲ the "
    "interval is above the paper's number, ▼ it is below, ≈ it contains the number (inconclusive).",
)

# %%
html.say("{text}", text=html.composed(questions.guard_in_words(overall)))

# %%
best = questions.best_policy(table4.missions)
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
    "The paper prints no intervals, although its numbers are means over {n:,} missions. For its "
    "success, for example, the 95 % interval is {interval}.",
    n=paper.TABLE_IV_MISSIONS,
    interval=numbers.interval(*paper.spread(paper.TABLE_IV[SUCCESS], paper.TABLE_IV_MISSIONS)),
)

# %% [markdown]
# The paper does not give all constants, such as the place of the charging zone or the transmit
# power; for these, the scenario here has its own values.
#
# ## By number of UAVs
#
# These are the same missions, grouped by the number of UAVs that each mission drew.

# %%
caption = f"n = {numbers.span(fleets['n'])} missions per policy and size, bars are 95 % intervals."
html.gallery(
    [
        (figures.by_fleet(fleets, metric), f"{name} against the number of UAVs", caption)
        for metric, name in METRICS.items()
    ]
)

# %%
rows = fleets[fleets["metric"].isin(METRICS)]
html.table(tables.estimates(rows, ["policy", "uavs", "n"]), "Means with 95 % intervals")

# %% [markdown]
# ## <a id="fig-4"></a>One setting: the paper's Fig. 4

# %%
html.say(
    "C<sub>S</sub> {charge_start[0]} %, C<sub>C</sub> {charge_complete[0]} %, {initial_data[0]:g} "
    "data units per node, flying time {flying_time[0]}; {n:,} missions per policy and fleet size. "
    "The paper does not say over how many missions its numbers are means.",
    n=fig4_fleets["n"].min(),
    **fig4.manifest["scenario"],
)

# %%
caption = f"n = {numbers.span(fig4_fleets['n'])} missions per policy and size"
html.gallery(
    [
        (
            figures.by_fleet(fig4_fleets, m, {i: p[m] for i, p in paper.FIG_4.items()}),
            f"{METRICS[m]} against the number of UAVs, and the paper's numbers",
            f"{caption}, bars are 95 % intervals. Diamonds are the paper's numbers.",
        )
        for m in paper.FIG_4[1]
    ]
)

# %%
html.table(
    questions.beside_paper(fig4_fleets, paper.FIG_4),
    "Means with 95 % intervals, and the difference from the paper in percentage points. ▲ the "
    "interval is above the paper's number, ▼ below, ≈ contains it",
)

# %% [markdown]
# ## How far from the best possible

# %%
html.say("{text}", text=html.composed(gap.in_words(bounded) if bounded else gap.NOT_RUN))

# %%
if bounded:
    gaps = gap.by_fleet(bounded)
    caption = f"n = {numbers.span(gaps['n'])} missions of the study gap, with 95 % intervals."
    display(
        html.table(gap.at_most(gaps), "Scorecard: at most so many points from the best possible"),
        html.figure(comparison.gaps(gaps), "The product of every policy, and the bound", caption),
        html.table(gap.listed(gaps), "Means, the upper bound, and the gap", data=gaps),
    )

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([table4, fig4, *([bounded] if bounded else [])])
