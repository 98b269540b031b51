"""The claims of the paper's Section V, and how each is judged.

A judge takes the results of a policy and says what they mean for a claim, by a rule of ``claims``.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from analysis.names import METRICS, PRODUCT, SHARES, parameter, value_text
from analysis.questions import learning, main_effects, node_shares
from analysis.replication import paper, rules
from analysis.replication.evidence_of_policy import (
    Case,
    Finding,
    MissingError,
    Pairs,
    Quantity,
    Unit,
    least,
    mean_of,
    mean_points,
    mean_share,
    points,
    share_of,
)
from analysis.results.resimulate import Flight
from analysis.stats.intervals import Interval, mean_interval
from analysis.stats.verdict import INCONCLUSIVE

Judge = Callable[[Case], Finding]

RATIO, SUCCESS = "collection_ratio", "success"

# Values that the paper names, as those of a study are called.
LONE, EARLIEST = value_text(paper.LONE_UAV), value_text(paper.EARLIEST_CHARGE)
ADVENTUROUS = tuple(map(value_text, paper.ADVENTUROUS))
TURNING, BEYOND = value_text(paper.TURNING), value_text(paper.BEYOND)

FIG_5 = "Fig. 5: one parameter at a time"

# Times that the nodes are shuffled, to see what chance gives.
SHUFFLES = 100


@dataclass(frozen=True)
class Claim:
    """A claim, as ``scorecard.Row`` has it, with its judge."""

    part: str
    evidence: str
    text: str
    place: str
    rule: str
    judge: Judge
    printed: tuple[Quantity, ...] = ()


def section_v(margin: float) -> list[Claim]:
    """All claims.

    Args:
        margin: The difference that does not matter.
    """
    parts: list[tuple[str, str, Iterator[tuple]]] = [
        ("Table IV: random missions", "performance.html#table-4", _table_4()),
        ("Fig. 4: one to three UAVs", "performance.html#fig-4", _fig_4(margin)),
        ("Fig. 4: where they fly", "mission.html#fig-4", _trajectories()),
        (FIG_5, "parameters.html#fig-5", _fig_5(margin)),
        ("Section V-D: the sweet spot", "parameters.html#sweet-spot", _sweet_spot()),
        ("Fig. 3: transfer learning", "learning.html#fig-3", _fig_3()),
    ]
    return [Claim(part, evidence, *fields) for part, evidence, own in parts for fields in own]


def _table_4() -> Iterator[tuple]:
    for metric, name in METRICS.items():
        printed = _printed(metric, paper.TABLE_IV[metric], paper.TABLE_IV_MISSIONS)
        yield (
            f"{name} over random missions",
            "Table IV",
            rules.REACHED,
            _reaches(printed, metric),
            (printed,),
        )
    yield "The collection ratio stays below 100 %", "Section V-C", rules.NEVER_ALL, _never_all


def _fig_4(margin: float) -> Iterator[tuple]:
    for (uavs, figures), panel in zip(paper.FIG_4.items(), "abc", strict=True):
        for metric, figure in figures.items():
            printed = _printed(metric, figure)
            yield (
                f"{METRICS[metric]} with {uavs} UAV{'s' if uavs > 1 else ''}",
                f"Fig. 4{panel}",
                rules.REACHED,
                _reaches(printed, metric, "fig4", uavs),
                (printed,),
            )
    yield (
        "A second UAV raises the collection ratio dramatically",
        "Fig. 4b, Section V-C",
        rules.GAINED,
        _gain(RATIO, 2, rules.gained),
        _printed_gain(RATIO, 2),
    )
    yield (
        "A third UAV raises the collection ratio further",
        "Fig. 4c, Section V-C",
        rules.HIGHER,
        _gain(RATIO, 3, lambda gap, _: rules.higher(gap)),
        _printed_gain(RATIO, 3),
    )
    yield (
        "A second UAV costs no success, though it is harder to return for charging",
        "Fig. 4b, Section V-C",
        rules.kept_words(margin),
        _gain(SUCCESS, 2, lambda gap, _: rules.kept(gap, margin)),
        _printed_gain(SUCCESS, 2),
    )
    yield (
        "With the third UAV, success decreases slightly",
        "Fig. 4c, Section V-C",
        rules.SLIGHTLY_LOWER,
        _gain(SUCCESS, 3, lambda gap, _: rules.slightly_lower(gap)),
        _printed_gain(SUCCESS, 3),
    )
    yield (
        "All else given, three UAVs are closest to the sweet spot",
        "Section V-D",
        f"By collection ratio and communication. {rules.BEST}",
        _best_at("fig4", "uavs", value_text(paper.BEST_UAVS)),
    )


def _trajectories() -> Iterator[tuple]:
    yield "A lone UAV charges once", "Fig. 4a, Section V-C", rules.MOST, _one_charge
    yield (
        "A lone UAV ignores the leftmost column and the bottommost row of nodes",
        "Fig. 4a, Section V-C",
        rules.IGNORED,
        _ignored,
    )
    yield (
        "Two UAVs divide the nodes into two sectors",
        "Fig. 4b, Section V-C",
        rules.DIVIDED,
        _divided,
    )
    yield (
        "Two UAVs reach the nodes far from the charging zone, too",
        "Fig. 4b, Section V-C",
        f"Of that column and row, the nodes that are not ignored. {rules.HIGHER}",
        _reach,
    )


def _fig_5(margin: float) -> Iterator[tuple]:
    yield (
        "Performance is best with three UAVs",
        "Fig. 5a, Section V-D",
        f"By collection ratio and communication. {rules.BEST}",
        _best_at("fig5", "uavs", value_text(paper.BEST_UAVS)),
    )
    yield (
        "The more UAVs, the more of the data is collected",
        "Fig. 5a, Section V-D",
        f"By collection ratio. {rules.RISES}",
        _rises("uavs", RATIO),
    )
    yield (
        "A lone UAV is an extreme, and costs collection ratio",
        "Section V-C",
        rules.LOWEST,
        _lowest_at("uavs", LONE),
    )
    yield (
        f"Charging at {EARLIEST} % or below is an extreme, and costs collection ratio",
        "Section V-C",
        rules.LOWEST,
        _lowest_at("charge_start", EARLIEST),
    )
    yield (
        f"Success is no lower at C_S {'–'.join(ADVENTUROUS)} % than above",
        "Fig. 5b, Section V-D",
        rules.no_lower_words(margin),
        lambda case: _no_lower(case, margin),
    )
    yield (
        "All values of C_C are served well",
        "Fig. 5c, Section V-D",
        f"By collection ratio and communication. {rules.alike_words(margin)}",
        lambda case: _alike(case, margin),
    )
    yield (
        f"More initial data is good up to {TURNING} data units, and bad above",
        "Fig. 5d, Section V-D",
        f"By collection ratio and communication. {rules.PEAKS}",
        _peaks,
    )
    yield (
        f"Above {TURNING} data units per node, the collection ratio decreases",
        "Fig. 5d, Section V-D",
        rules.LOWER,
        _decreases,
    )
    yield (
        "More flying time is better",
        "Fig. 5e, Section V-D",
        f"By collection ratio and communication. {rules.RISES}",
        _rises("flying_time", PRODUCT),
    )


def _sweet_spot() -> Iterator[tuple]:
    for metric, name in METRICS.items():
        printed = _printed(metric, paper.SWEET_SPOT[metric], paper.SWEET_SPOT_MISSIONS)
        yield (
            f"{name} with every parameter at its best",
            "Section V-D",
            f"Of missions that had no part in the selection. {rules.REACHED}",
            _checked(printed, metric),
            (printed,),
        )
    yield (
        "The sweet spot is one of three UAVs",
        "Section V-D",
        rules.CHOSEN,
        _selected,
        (Quantity(paper.BEST_UAVS, unit="number", name="UAVs"),),
    )


def _fig_3() -> Iterator[tuple]:
    yield (
        "With transfer learning, the reward is higher in all training steps",
        "Fig. 3a, Section V-B",
        rules.THROUGHOUT,
        _above("evaluation_reward", "reward"),
    )
    yield (
        "With transfer learning, collection ratio and communication passes that without, and ends "
        "higher",
        "Fig. 3b, Section V-B",
        rules.PASSES,
        _above(f"evaluation_{PRODUCT}", "points"),
        (Quantity(paper.CROSSING, unit="steps", name="crossing"),),
    )
    yield (
        "Without transfer learning, training levels off, with low performance",
        "Fig. 3b, Section V-B",
        rules.LEVELS_OFF,
        _levels_off,
        (Quantity(paper.LEVEL_FROM, unit="steps", name="level from"),),
    )


# Judges of means.


def _printed(metric: str, figure: float, missions: int = 0) -> Quantity:
    """A figure of the paper, with an interval where it is a share of so many missions."""
    if metric in SHARES and missions:
        return Quantity(*paper.spread(figure, missions), n=missions)
    return Quantity(figure, n=missions)


def _reaches(
    printed: Quantity, metric: str, study: str = "table4", uavs: int | None = None
) -> Judge:
    def judge(case: Case) -> Finding:
        return _beside(case.policy(study), mean_of(case.missions(study, uavs), metric), printed)

    return judge


def _checked(printed: Quantity, metric: str) -> Judge:
    def judge(case: Case) -> Finding:
        policy, checks = case.policy("sweet-spot"), case.studies.study("sweet-spot").checks
        own = checks[checks["policy"] == policy]
        if own.empty:
            raise MissingError("the study sweet-spot flew no check")
        return _beside(policy, mean_of(own, metric), printed)

    return judge


def _beside(policy: str, ours: Quantity, printed: Quantity) -> Finding:
    verdict = rules.reached(rules.gap(ours.interval, printed.interval))
    return Finding(verdict, policy, (ours,), _against(ours, printed.value))


def _against(ours: Quantity, printed: float) -> str:
    return paper.verdict(ours.interval.low, ours.interval.high, printed)


def _never_all(case: Case) -> Finding:
    missions = case.missions("table4")
    ratio = mean_of(missions, RATIO)
    whole = share_of(missions[RATIO].to_numpy() >= 1, "missions that collected everything")
    verdict = rules.never_all(whole.interval, ratio.interval)
    return Finding(verdict, case.policy("table4"), (ratio, whole))


# Judges of what one more UAV changes in Fig. 4.


def _gain(metric: str, uavs: int, rule: Callable[[Interval, float], str]) -> Judge:
    ((printed, *_),) = _printed_gain(metric, uavs)

    def judge(case: Case) -> Finding:
        ours = case.pairs("fig4", "uavs", metric).change(str(uavs - 1), str(uavs))
        verdict = rule(ours.interval, printed)
        return Finding(verdict, case.policy("fig4"), (ours,), _against(ours, printed))

    return judge


def _printed_gain(metric: str, uavs: int) -> tuple[Quantity]:
    gain = paper.FIG_4[uavs][metric] - paper.FIG_4[uavs - 1][metric]
    return (Quantity(gain, unit="points"),)


# Judges of missions of Fig. 4, flown again.


def _one_charge(case: Case) -> Finding:
    charges = [(flight.events["event"] == "charge_start").sum() for flight in case.flights(1)]
    ours = share_of(np.array(charges) == 1, "missions with one charge")
    return Finding(rules.most(ours.interval), case.policy("fig4"), (ours,))


def _ignored(case: Case) -> Finding:
    there, others = np.transpose([_left_behind(flight) for flight in case.flights(1)])
    found = mean_share(there, "ignored of these nodes"), mean_share(others, "of the others")
    verdict = rules.ignored(found[0].interval, mean_interval(there - others))
    return Finding(verdict, case.policy("fig4"), found)


def _reach(case: Case) -> Finding:
    alone, two = (np.array([_left_behind(f)[0] for f in case.flights(uavs)]) for uavs in (1, 2))
    n = min(len(alone), len(two))  # of the same replications
    more = mean_points(alone[:n] - two[:n], "more of these nodes than by a lone UAV")
    found = more, mean_share(1 - two, "of these nodes not ignored")
    return Finding(rules.higher(more.interval), case.policy("fig4"), found)


def _left_behind(flight: Flight) -> tuple[float, float]:
    """The shares left behind, of the nodes of the far edges and of the others."""
    nodes = np.array(flight.scenario.nodes)
    left = node_shares.left_behind(flight.events, flight.scenario.uavs, len(nodes))
    far = node_shares.far_edges(nodes)
    if far.all():
        raise MissingError("all nodes are on the edges")
    return float(left[far].mean()), float(left[~far].mean())


def _divided(case: Case) -> Finding:
    generator = np.random.default_rng(case.studies.study("fig4").store.manifest.seed)
    rows = [row for flight in case.flights(2) if (row := _division(flight, generator))]
    if not rows:
        raise MissingError("no data was collected")
    own, chance, most = np.transpose(rows)
    sides = mean_share(own, "data collected on the own side")
    whole = mean_share(most, "data by the UAV that serves the node most")
    drawn = Quantity(float(np.mean(chance)), name="by chance")
    verdict = rules.divided(mean_interval(own - chance), whole.interval)
    return Finding(verdict, case.policy("fig4"), (sides, drawn, whole))


def _division(flight: Flight, generator: np.random.Generator) -> tuple[float, ...]:
    """The share on the own side, the same by chance, and by the UAV that serves a node most."""
    nodes = np.array(flight.scenario.nodes)
    data = node_shares.collected(flight.events, flight.scenario.uavs, len(nodes))
    if not data.any():
        return ()
    shuffled = (generator.permutation(data, axis=1) for _ in range(SHUFFLES))
    chance = np.mean([node_shares.sectors(each, nodes) for each in shuffled])
    return node_shares.sectors(data, nodes), float(chance), node_shares.division(data)


# Judges of a parameter's values.


def _best_at(study: str, field: str, value: str) -> Judge:
    def judge(case: Case) -> Finding:
        pairs = case.pairs(study, field, PRODUCT)
        verdict = rules.best_at(pairs.table, pairs.place(value))
        lead = least(pairs.leads(value), f"{_at(field, value)} above the next best")
        return Finding(verdict, case.policy(study), (lead,))

    return judge


def _lowest_at(field: str, value: str) -> Judge:
    def judge(case: Case) -> Finding:
        pairs = case.pairs("fig5", field, RATIO).reversed()
        verdict = rules.best_at(pairs.table, pairs.place(value))
        lead = least(pairs.leads(value), "the next lowest is higher by")
        return Finding(verdict, case.policy("fig5"), (lead,))

    return judge


def _no_lower(case: Case, margin: float) -> Finding:
    pairs = case.pairs("fig5", "charge_start", SUCCESS)
    low = [pairs.place(value) for value in ADVENTUROUS]
    leads = pd.concat([pairs.leads(value) for value in ADVENTUROUS])
    ours = least(leads[~leads["other"].isin(low)], "least difference")
    verdict = rules.no_lower(pairs.table, low, margin)
    return Finding(verdict, case.policy("fig5"), (ours,))


def _alike(case: Case, margin: float) -> Finding:
    table = case.pairs("fig5", "charge_complete", PRODUCT).table
    ours = points(table.loc[table["difference"].abs().idxmax()], "largest difference")
    return Finding(rules.alike(table, margin), case.policy("fig5"), (ours,))


def _peaks(case: Case) -> Finding:
    pairs = case.pairs("fig5", "initial_data", PRODUCT)
    verdict = rules.peaks_at(pairs.table, pairs.place(TURNING))
    lead = least(pairs.leads(TURNING), f"{_at('initial_data', TURNING)} above the best other")
    return Finding(verdict, case.policy("fig5"), (lead,), note=_course(pairs))


def _decreases(case: Case) -> Finding:
    ours = case.pairs("fig5", "initial_data", RATIO).change(TURNING, BEYOND)
    return Finding(rules.lower(ours.interval), case.policy("fig5"), (ours,))


def _rises(field: str, metric: str) -> Judge:
    def judge(case: Case) -> Finding:
        pairs = case.pairs("fig5", field, metric)
        first, *_, last = pairs.places
        ours = pairs.change(first, last)._replace(name=f"from {first} to {last}")
        verdict = rules.rises(pairs.table)
        return Finding(verdict, case.policy("fig5"), (ours,), note=_course(pairs))

    return judge


def _at(field: str, value: object) -> str:
    """``C_S 30``."""
    text = value if isinstance(value, str) else value_text(value)
    return f"{parameter(field).short} {text}"


def _course(pairs: Pairs) -> str:
    """How the metric goes along the values, in words."""
    found = main_effects.shape(pairs.table)
    tops = [value for value, position in pairs.places.items() if position in found.peaks]
    peak = f", highest at {' or '.join(tops)}" if found.words == main_effects.PEAK else ""
    return f"it {found.words}{peak}"


def _selected(case: Case) -> Finding:
    results, policy = case.studies.study("sweet-spot"), case.policy("sweet-spot")
    choice, points = results.choice(policy), results.store.manifest.points
    if choice is None or "uavs" not in points[choice.best].values:
        raise MissingError("the study sweet-spot selects no number of UAVs")
    wanted = [n for n, point in enumerate(points) if point.values.get("uavs") == paper.BEST_UAVS]
    best = points[choice.best].values
    ours = Quantity(best["uavs"], n=choice.missions, unit="number", name="UAVs")
    note = ", ".join(_at(field, value) for field, value in best.items())
    return Finding(rules.chosen(choice, wanted), policy, (ours,), note=note)


# Judges of learning curves.


def _above(metric: str, unit: Unit) -> Judge:
    def judge(case: Case) -> Finding:
        variants, found = _transfer(case, metric)
        verdict = curve_verdict(metric, found)
        note = f"trainings {' and '.join(variants)}: {_where(found)}{_short(found)}"
        return Finding(verdict, quantities=_last(found, unit), note=note)

    return judge


def curve_verdict(metric: str, found: learning.Transfer) -> str:
    """The verdict on a learning curve: of the reward it is claimed that it is higher all along."""
    throughout = metric == "evaluation_reward"
    return rules.throughout(found.verdict, found.throughout) if throughout else found.verdict


def _where(found: learning.Transfer) -> str:
    """Where the mean curve with transfer learning is above, in words."""
    if found.throughout:
        return "above at every step"
    return "ends below, or level" if found.since is None else f"above from step {found.since:,} on"


def _short(found: learning.Transfer) -> str:
    return "" if found.length >= paper.CROSSING else "; too short to tell"


def _levels_off(case: Case) -> Finding:
    metric = f"evaluation_{PRODUCT}"
    (_, without), found = _transfer(case, metric)
    mean = learning.bands(case.studies.curves(metric)).query("variant == @without")
    mean = mean[mean["phase"] == mean["phase"].iloc[-1]]
    far = np.flatnonzero((mean["mean"] - mean["mean"].iloc[-1]).abs() > rules.MARGIN)
    since = mean["updates"].iloc[far[-1] + 1 if len(far) else 0]
    settled = Quantity(int(since), unit="steps", name="level from")
    verdict = rules.levels_off(since / mean["updates"].iloc[-1], found.last)
    if found.length < paper.CROSSING:
        verdict = INCONCLUSIVE
    note = f"trainings {without}{_short(found)}"
    return Finding(verdict, quantities=(settled, *_last(found, "points")), note=note)


def _transfer(case: Case, metric: str) -> tuple[tuple[str, str], learning.Transfer]:
    """The trainings with transfer learning and those without, compared."""
    there = case.studies.trainings
    if case.variants is None:
        raise MissingError("no trainings of this policy with and without transfer learning")
    if there.empty or not {*case.variants} <= {*there["variant"]}:
        raise MissingError(f"no trainings {' and '.join(case.variants)}")
    return case.variants, learning.transfer(case.studies.curves(metric), *case.variants)


def _last(found: learning.Transfer, unit: Unit) -> tuple[Quantity, Quantity]:
    """The last difference, and how long the trainings are."""
    last = Quantity(*found.last, min(found.trainings), unit, "with transfer, at the end")
    return last, Quantity(found.length, unit="steps", name="length of the trainings")
