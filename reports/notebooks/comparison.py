# ---
# jupyter:
#   dess:
#     studies: [comparison]
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
# ---

# %% [markdown]
# # Learned against heuristic
#
# The best learned policy and the best heuristic in the same missions: how far apart they are, where
# in the space of parameters, in which missions the learned one loses, and what a decision costs.

# %% tags=["parameters"]
results = "../../results"  # folder that holds the results folders comparison and timing
learned = None  # the learned policy to show; None for the best of the study
heuristic = None  # the policy to set beside it; None for the best that has not learned

# %%
from functools import cache
from pathlib import Path

import pandas as pd
from IPython.display import Markdown, display

from analysis import fly, load_results, numbers, summary
from analysis.execution import decision_time as timing
from analysis.figures import comparison as drawings
from analysis.figures import missions as figures
from analysis.names import METRICS, PRODUCT, parameter
from analysis.questions import head_to_head as regions
from analysis.questions import summary as findings
from analysis.stats.intervals import LEVEL
from analysis.stats.learners import CHECKPOINT
from reports.pages import html

study = load_results(Path(results) / "comparison")
times = timing.read(Path(results) / "timing")

pair = regions.pair_of(study, learned, heuristic)
policy, baseline = pair.policy, pair.baseline
missions = regions.duels(study, pair)
seed = study.manifest["seed"]
level, risk = numbers.level(LEVEL), numbers.level(1 - LEVEL)
means = summary(study.missions, by=["policy"])
ranked = means[means["metric"] == PRODUCT].sort_values("mean", ascending=False, kind="stable")[
    "policy"
]
members = findings.learners(study)
taught = {name: names for names in members.values() for name in names}


def points(row, mean="mean"):
    return numbers.points(row[mean], row["low"], row["high"])


def plural(n, one, many):
    return f"{n:,} {one if n == 1 else many}"


def span(numbers):
    """``300``, or ``20 to 1,200``."""
    return " to ".join(f"{n:,}" for n in sorted({numbers.min(), numbers.max()}))


def role(name):
    """What a policy is in the study."""
    if name not in taught:
        first = next(other for other in ranked if other not in taught) == name
        return f"{'the best' if first else 'a'} policy of the study that has not learned"
    own = taught[name]
    best = "the best" if regions.pair_of(study).policy in own else "a"
    if len(own) == 1:
        return f"{best} learned policy of the study"
    return f"training {own.index(name) + 1} of {len(own)} of {best} learner of the study"


def metric_name(metric):
    return METRICS[metric].lower()


# %% [markdown]
# ## On the same missions

# %%
chosen = (
    f" Of {pair.candidates} pairs of policies, these data chose this one, and all p-values of the "
    "pair are corrected for that (Bonferroni)."
    if pair.candidates > 1
    else ""
)
display(
    Markdown(
        f"**{policy}** is {role(policy)}, **{baseline}** {role(baseline)}; unless another is "
        "named, the metric is collection ratio and communication, the product of success and "
        f"collection ratio. Both fly the same {len(missions):,} missions, each "
        "with parameters of its own (Table II): the same sea, initial data, arrivals and "
        "shadowing. So they are compared mission by mission, and what follows are differences, "
        f"{policy} minus {baseline}, in percentage points: above 0, {policy} is ahead." + chosen
    )
)

# %%
versus = findings.learned_against_heuristic(study)
shown = (
    [
        (row["learner"], row["baseline"], row["about"])
        for _, row in versus.drop_duplicates("learner").iterrows()
    ]
    if len(versus)
    else []
)


def called(learner):
    """A learner, told from the first of its trainings, which has its name."""
    trainings = len(members[learner])
    return learner if trainings == 1 else f"{learner} ({trainings} trainings)"


covered = any(members[name] == [policy] and base == baseline for name, base, _ in shown)


def told(rows, name, base):
    """How a policy compares in every metric, in words."""
    groups = {"ahead of": [], "behind": [], "not told apart from": []}
    for _, row in rows.iterrows():
        sure = row["p_adjusted"] <= 1 - LEVEL
        verdict = ("ahead of" if row["difference"] > 0 else "behind") if sure else [*groups][2]
        groups[verdict].append(f"{metric_name(row['metric'])} ({points(row, 'difference')} points)")
    parts = [
        f"{verdict} {base} in {numbers.words(those)}" for verdict, those in groups.items() if those
    ]
    return f"**{name}** is {'; '.join(parts)}."


own = regions.overall(missions, pair)
lines = [told(versus[versus["learner"] == name], called(name), base) for name, base, _ in shown]
one = [name for name, _, about in shown if about == CHECKPOINT]
more = [name for name, *_ in shown if name not in one]
caveats = [
    f"Of {numbers.words(one)} there is one training{' each' * (len(one) > 1)}: the claim is about "
    f"{'this checkpoint' if len(one) == 1 else 'these checkpoints'}, and another training of the "
    "same learner may turn out better or worse."
    if one
    else "",
    f"Of {numbers.words(more)} there are several trainings: the claim is about the learner, trainings "
    "to come included."
    if more
    else "",
]
gain = own.set_index("metric").loc[PRODUCT, "variance_reduction"]
several = len(taught.get(policy, [])) > 1
alone = (
    ""
    if covered
    else (f"The rest of this page is about {policy} alone" if several else "The pair of this page")
    + (
        ", the first training, whatever came of it"
        if several and taught[policy][0] == policy
        else ""
    )
    + f": {told(own, policy, baseline)}"
)
worth = (
    f"The common missions are worth much: with missions of its own for each policy, it would "
    f"take {1 / (1 - gain):.0f} times as many for intervals as narrow."
    if 0.5 < gain < 1
    else ""
)
display(
    Markdown(
        f"By the p-values at the {risk} level, after Holm's correction for the number of "
        f"comparisons; the {level} intervals are of one difference each:\n\n"
        + "\n\n".join(
            text
            for text in ("\n".join(f"- {line}" for line in lines), *caveats, alone, worth)
            if text
        )
    )
)


# %%
def by_metric(rows, name):
    """A row per policy, with its differences and p-values in all metrics."""
    head = [("", "Difference")]
    head += [(m, what) for m in METRICS.values() for what in ("points", "p, adjusted")]
    lines = []
    for who, own in rows.groupby(name, sort=False):
        own = own.set_index("metric").loc[[*METRICS]]
        cells = [
            (points(row, "difference"), numbers.p_value(row["p_adjusted"]))
            for _, row in own.iterrows()
        ]
        base = own["baseline"].iloc[0]
        lines.append([f"{who} − {base}", *(text for cell in cells for text in cell)])
    return pd.DataFrame(lines, columns=pd.MultiIndex.from_tuples(head))


how = (
    f"mean differences in points, with {level} intervals of one difference each; p by "
    "Holm over the whole table, and by Bonferroni for the choice of the"
)
if len(versus):
    display(
        html.table(
            by_metric(versus.assign(learner=versus["learner"].map(called)), "learner"),
            f"Every learner against the best heuristic, n = {versus['n'].min():,} missions: {how} "
            "best heuristic",
        )
    )
best = findings.comparisons(study)
if len(best):
    display(
        html.table(
            by_metric(best, "policy"),
            f"Every policy against the best one, n = {best['n'].min():,} missions: {how} best",
        )
    )

# %% [markdown]
# ### Mission by mission

# %%
counts = regions.outcomes(missions).set_index("outcome")
only = {
    who: int(((missions["success" + a] == 0) & (missions["success" + b] == 1)).sum())
    for who, a, b in ((policy, "", "_baseline"), (baseline, "_baseline", ""))
}


def share(outcome):
    return numbers.interval(*counts.loc[outcome, ["share", "low", "high"]])


display(
    Markdown(
        f"In collection ratio and communication, {policy} is ahead in {share('ahead')} of the "
        f"missions, level in {share('level')} and behind in {share('behind')}. A mission that "
        f"fails counts 0, so a single failure weighs as much as many small leads: in "
        f"{plural(only[policy], 'mission', 'missions')} {policy} fails and {baseline} does not, in "
        f"{plural(only[baseline], 'mission', 'missions')} it is the other way round."
    )
)
html.figure(
    drawings.distribution(missions, pair),
    f"Distribution of the difference between {policy} and {baseline} over the missions",
    f"Share of the missions (n = {len(missions):,}) in which the difference in collection ratio "
    f"and communication is at most the value below. The {level} band holds the whole "
    "curve. Where the curve crosses 0 is the share of missions that are lost. Up to "
    f"{numbers.level(drawings.EDGE)} of the missions lie beyond each end of the axis; the lowest is "
    f"{numbers.difference(missions['difference'].min(), 0)} points, the highest "
    f"{numbers.difference(missions['difference'].max(), 0)}.",
)

# %% [markdown]
# ## Over the space of parameters

# %%
lead = regions.along(missions, pair.candidates)
depends = regions.dependence(missions)
fields = regions.varied(missions)
overall = missions["difference"].mean()
order = lead.sort_values("mean", kind="stable")
verdicts = {v: int((lead["verdict"] == v).sum()) for v in ("ahead", "behind", regions.INCONCLUSIVE)}


def place(row):
    return f"{parameter(row['field']).within} {row['value']} ({points(row)} points)"


def spread(field):
    """Between which bins of a parameter the difference goes."""
    rows = lead[lead["field"] == field]
    low, high = rows.loc[rows["mean"].idxmin()], rows.loc[rows["mean"].idxmax()]
    return (
        f"the {parameter(field).within} ({numbers.difference(low['mean'], 0)} at {low['value']}, "
        f"{numbers.difference(high['mean'], 0)} at {high['value']})"
    )


matters = depends["p_adjusted"] <= 1 - LEVEL
named = [spread(field) for field in depends.loc[matters, "field"]]
unnamed = [f"the {parameter(field).within}" for field in depends.loc[~matters, "field"]]
if len(lead):
    display(
        Markdown(
            f"Every parameter is cut into at most {regions.BINS} bins with about as many missions; "
            "the initial data are the mean of a mission's nodes. "
            f"Of these {len(lead)} bins, {policy} is ahead in {verdicts['ahead']} and behind in "
            f"{verdicts['behind']}; of {verdicts[regions.INCONCLUSIVE]} it cannot be told (at "
            f"the {risk} level, after Holm's correction for all of them). The difference is lowest "
            f"with {place(order.iloc[0])}, highest with {place(order.iloc[-1])}."
            + (f"\n\nIt depends on {numbers.words(named)}." if named else "")
            + (f" That it depends on {numbers.words(unnamed)} is not shown." if unnamed else "")
            + " (Alexander and Govern's test of equal means, Holm's correction for the number of "
            "parameters.) In the figures, blue is ahead, orange behind; what cannot be told is "
            "hollow and grey."
        )
    )

# %%
html.gallery(
    [
        (
            drawings.lead(lead, field, overall),
            f"Mean difference of {policy} and {baseline} against the {parameter(field).within}",
            f"{policy} − {baseline}, collection ratio and communication, n = "
            f"{span(lead.loc[lead['field'] == field, 'n'])} missions per dot. Bars are "
            f"{level} intervals. Dashed: all missions.",
        )
        for field in fields
    ]
)

# %%
finding, telling = regions.halves(missions)
strongest = regions.dependence(finding)
if len(strongest) > 1 and len(telling):
    first, second = strongest["field"][:2]
    names = [parameter(field).within for field in (first, second)]
    cells = regions.across(telling, first, second, pair.candidates)
    low = cells.loc[cells["mean"].idxmin()]
    sure = {v: int((cells["verdict"] == v).sum()) for v in verdicts}
    display(
        Markdown(
            "The two parameters that explain most of the difference were sought on the missions of "
            f"even replications: the {names[0]} ({numbers.percent(strongest['explained'][0])} of its "
            f"variance) and the {names[1]} ({numbers.percent(strongest['explained'][1])}). Both at "
            "once are shown by the missions of odd replications, which had no part in that choice: "
            f"{policy} is ahead in {sure['ahead']} of {len(cells)} cells, behind in "
            f"{sure['behind']}. The lowest mean is {points(low)} points, with "
            f"{parameter(first).short} {low['value']} and {parameter(second).short} "
            f"{low['value_2']} ({plural(low['n'], 'mission', 'missions')}): {low['verdict']}."
        )
    )
    display(
        html.figure(
            drawings.heat(cells, first, second),
            f"Mean difference over {names[0]} and {names[1]}",
            f"{policy} − {baseline}, mean difference in points of collection ratio and "
            f"communication; blue is ahead, orange behind. In brackets: cannot be told at "
            f"{level} (p of the paired t test, Holm's correction for {len(cells)} cells). "
            f"n = {span(cells['n'])} missions per cell, of odd replications.",
        )
    )

# %% [markdown]
# ## Where it loses
#
# A regression tree cuts the space into regions in which the difference differs most. It is grown on
# one half of the missions, those of even replications, and judged on the other half, which had no
# part in it: else the regions that chance favours would look real.

# %%
found = regions.rules(missions, pair.candidates)
behind = found[found["verdict"] == "behind"]
unsure = found[found["verdict"] == regions.INCONCLUSIVE]


def region(row):
    return f"{row['rule']} ({points(row)} points, n = {row['n']:,})"


if not len(found):
    text = "There are too few missions for two halves."
elif len(behind):
    text = (
        f"Of {plural(len(found), 'region', 'regions')}, {policy} is **behind** in {len(behind)}: "
        + "; ".join(region(row) for _, row in behind.iterrows())
    )
else:
    text = (
        f"{policy} is **behind in none** of the {plural(len(found), 'region', 'regions')}, at "
        f"the {risk} level after Holm's correction. The difference is lowest in "
        f"{region(found.iloc[0])}"
    )
if len(unsure):
    text += ". Which of the two is ahead cannot be told in: " + "; ".join(unsure["rule"])
display(Markdown(f"{text}."))
html.table(
    pd.DataFrame(
        [
            [
                row["rule"],
                points(row),
                numbers.p_value(row["p_adjusted"]),
                row["verdict"],
                numbers.interval(row["behind"], row["behind_low"], row["behind_high"]),
                f"{row['n']:,}",
            ]
            for _, row in found.iterrows()
        ],
        columns=["Region", "Points", "p, adjusted", f"{policy} is", "Missions lost", "n"],
    ),
    f"The regions, on missions that did not find them: mean difference in collection ratio and "
    f"communication and share of the missions in which {policy} is behind, with "
    f"{level} intervals. A parameter that is not named may have any value",
)

# %% [markdown]
# ## The worst missions

# %%
COUNT, DRAWN = 5, 2
lowest = regions.worst(missions, COUNT)
lost = regions.most_lost(missions.drop(lowest.index), COUNT)


def side(row, name, end):
    return [
        "yes" if row[f"success{end}"] else "no",
        regions.quotas(study, name, int(row["replication"])),
        numbers.percent(row[f"collection_ratio{end}"]),
    ]


def listed(rows):
    """Missions with their parameters and what both policies made of them."""
    shorts = [parameter(field).short for field in regions.PARAMETERS]
    outcome = ("Success", "Quotas", "Collected")
    head = [("", name) for name in ("Mission", *shorts, "Points")]
    head += [(name, what) for name in (policy, baseline) for what in outcome]
    lines = [
        [
            f"{row['replication']:.0f}",
            *(f"{row[field]:.3g}" for field in regions.PARAMETERS),
            numbers.difference(row["difference"], 0),
            *side(row, policy, ""),
            *side(row, baseline, "_baseline"),
        ]
        for _, row in rows.iterrows()
    ]
    return pd.DataFrame(lines, columns=pd.MultiIndex.from_tuples(head))


@cache
def flown(name, number):
    return fly(study, name, 0, number)


failed = lowest.loc[lowest["success"] == 0, "replication"].tolist()
dry = [
    regions.stranded(flight.events, flight.scenario)
    for flight in (flown(policy, number) for number in failed)
]
away = pd.concat(dry)["moves"] if dry else pd.Series(dtype=int)
display(
    Markdown(
        f"The {plural(len(lowest), 'mission', 'missions')} in which {policy} has the lowest "
        "collection ratio and communication (the product), of those alike the ones with less "
        f"collected. It fails in {len(failed)} of them, {baseline} in "
        f"{int((lowest['success_baseline'] == 0).sum())}."
        + (
            f" In its failures {plural(len(away), 'UAV runs', 'UAVs run')} dry, "
            f"{span(away)} {'move' if away.max() == 1 else 'moves'} from the charging zone."
            if len(away)
            else ""
        )
    )
)
html.table(
    listed(lowest),
    f"The worst missions of {policy}, seed {seed}; points are the difference in the product",
)

# %%
if len(lost):
    display(
        Markdown(
            f"Of all other missions, the {len(lost)} in which {policy} is furthest behind "
            f"{baseline}, by {-100 * lost['difference'].max():.1f} to "
            f"{-100 * lost['difference'].min():.1f} points:"
        )
    )
    display(
        html.table(
            listed(lost),
            f"The greatest losses to {baseline} otherwise, seed {seed}",
        )
    )

# %%
numbers = pd.concat([lowest, lost])["replication"].tolist()
display(
    Markdown(
        "Each can be flown again:\n\n"
        + html.commands(study.replay(policy, 0, number) for number in numbers)
        + f"\n\nWith `--policy {baseline}` instead, it is the other policy in the same mission."
    )
)

# %% [markdown]
# ### What they look like


# %%
def fate(flight):
    """Who runs dry, where and when, in words."""
    dry = regions.stranded(flight.events, flight.scenario)
    told = [
        f"UAV {row.uav + 1} runs dry in slot {row.time:.0f} at ({row.x}, {row.y}), "
        + (f"{plural(row.moves, 'move', 'moves')} from" if row.moves else "in")
        + " the charging zone"
        for row in dry.itertuples()
    ]
    return "; ".join(told) or "no UAV runs dry"


def pictured(name, number):
    flight = flown(name, number)
    caption = (
        f"{name} in mission {number}, a single one (n = 1): {fate(flight)}. "
        f"{flight.record.collected:.0f} of {flight.record.initial + flight.record.arrived:.0f} "
        f"data units collected in {flight.record.slots} mission slots."
    )
    alt = f"Map of mission {number} flown by {name}; battery, residual data and charging"
    return figures.mission_figure(flight.events, flight.scenario), alt, caption


for number in numbers[: min(DRAWN, len(lowest))]:
    display(Markdown(f"**Mission {number}**: {policy}, and {baseline} in the same mission."))
    display(html.gallery([pictured(name, number) for name in (policy, baseline)]))

# %% [markdown]
# An arrow is the move of one mission slot, in the colour of the node that is served; a cross is a
# slot of hovering, a star one of charging. A numbered diamond is where a UAV starts, a dot where
# its mission ends.

# %% [markdown]
# ## What a decision costs

# %%
costs = {cost.policy: cost for cost in times.costs}
shown = [costs[name] for name in study.policies if name in costs]
untimed = [name for name in study.policies if name not in costs]
changed = timing.unlike(times, study.store.manifest)
remarks = [
    f"Not timed: {numbers.words(untimed)}." if untimed else "",
    f"Timed with other code or weights than those of the study: {numbers.words(changed)}."
    if changed
    else "",
]
ratio = (
    f" {policy} takes {costs[policy].median / costs[baseline].median:,.3g} times as long as "
    f"{baseline} for one mission, by the medians."
    if policy in costs and baseline in costs
    else ""
)
display(
    Markdown(
        "A policy is asked once in a mission slot for all UAVs of a mission that must act. Timed "
        "is this call alone, with all that the policy works out from what it sees, over "
        f"{plural(times.missions, 'mission', 'missions')} of the scenario {times.scenario}; and "
        "the same missions all at once in the batch engine, where a call decides for many. Times "
        f"are of one machine ({times.processor}, {plural(times.threads, 'thread', 'threads')}) and "
        "will differ on another." + ratio + "".join(f" {remark}" for remark in remarks if remark)
    )
)
html.figure(
    drawings.decision_time(shown or times.costs, study.policies),
    "Time of a decision of every policy, for one mission and in the batch",
    f"n = {min(cost.calls for cost in shown or times.costs):,} calls or more per policy, on a "
    f"logarithmic axis. A line goes from the median to what {numbers.level(timing.SLOW)} of the calls "
    "keep below: the spread of the calls, not an interval of their mean.",
)

# %%
html.table(
    pd.DataFrame(
        [
            [
                cost.policy,
                drawings.duration(cost.median),
                drawings.duration(cost.slow),
                f"{cost.rows / cost.calls:.2f}",
                f"{cost.calls:,}",
                drawings.duration(cost.batch),
                f"{cost.batch_rows:,}",
            ]
            for cost in shown or times.costs
        ],
        columns=pd.MultiIndex.from_tuples(
            [
                ("", "Policy"),
                *(("One mission, a call", c) for c in ("median", "95 % below", "UAVs", "calls")),
                *(("Many missions", c) for c in ("per UAV", "UAVs")),
            ]
        ),
    ),
    f"Times of decisions; in the batch the middle one of {timing.ROUNDS} rounds",
)

# %%
slowest = max(shown or times.costs, key=lambda cost: cost.slow)
cell = times.space.cell_size
display(
    Markdown(
        "Is that fast enough? A decision must be ready within a mission slot. The model gives a "
        f"slot no length in seconds; but in one, a UAV flies a cell of {cell:g} m, so a UAV of v "
        f"m/s gives {cell:g}/v seconds to decide. The slowest policy here, {slowest.policy}, needs "
        f"no more than {drawings.duration(slowest.slow)} in {numbers.level(timing.SLOW)} of its "
        f"calls: enough up to about {float(f'{cell / slowest.slow:.2g}'):,.0f} m/s, on this "
        "processor."
    )
)

# %% [markdown]
# ## Where the figures come from

# %%
html.provenance([study])

# %%
html.table(
    pd.DataFrame(
        {
            "Scenario": times.scenario,
            "Missions": f"{times.missions:,}",
            "Seed": times.seed,
            "Processor": f"{times.processor}, {plural(times.cores, 'core', 'cores')}",
            "Threads": times.threads,
            "dess": times.version,
            "Code": times.code[:12],
            "Commit": (times.commit or "unknown")[:12],
            "Libraries": ", ".join(f"{name} {v}" for name, v in times.libraries.items()),
        }.items(),
        columns=["Timing", "of decisions"],
    ),
    wrap=True,
)
