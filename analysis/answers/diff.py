"""Compare two results folders, mission by mission: the effect of changed code or weights.

    found = diff_results(load_results("results/before"), load_results("results/after"))
    found.identical, found.changed, estimate_differences(found)

A mission is in both folders if policy, scenario, seed and replication are the same. Then it has the
same random draws in both, so that every difference is an effect of the change. If no scenario is in
both, design points with the same values are compared, and the effect is also that of the constants
that differ. With different seeds, all missions are compared without pairs.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from dess import InputError
from dess.analysis.answers.settings.points import points_in_words
from dess.analysis.metrics import METRICS, PRODUCT, RATIO, REWARD
from dess.analysis.results.provenance import differing_modules
from dess.analysis.results.tables import Results
from dess.analysis.stats.corrections import add_adjusted
from dess.analysis.stats.differences import Paired, compare, compare_unpaired
from dess.analysis.stats.rows import group_rows
from dess.base.errors import shown
from dess.model.record import MISSION_RECORD, OPERATIONS, UAV_RECORD
from dess.scenario.values import dotted

_KEYS = ["team", "scenario", "replication"]  # columns by which missions are matched
_MISSION_FIELDS = [n for n in MISSION_RECORD.names or () if n not in ("seed", "replication")]
_MISSION_FIELDS += OPERATIONS.names or ()
_UAV_FIELDS = [*(UAV_RECORD.names or ())]
_ORDER = [PRODUCT, RATIO, REWARD]  # metrics by whose changes missions are sorted


@dataclass(frozen=True, eq=False)
class Diff:
    """The differences between two results folders.

    Attributes:
        a: The results of A.
        b: The results of B.
        missions: A row per mission that both have, in the order of A: ``fields`` (the names of
            those that differ in the records of the mission and of its UAVs, empty if none does),
            ``replication``, and with ``_a`` and ``_b`` each ``policy``, ``point`` and the fields of
            ``MISSION_RECORD`` and ``OPERATIONS`` (nan where not measured).
        alone: The missions that only one folder has: ``only_in`` (``A`` or ``B``), ``what`` they
            are, and the number ``missions``.
        points: The pairs of design points that are compared: ``point_a`` and ``point_b``.
        unpaired: With different seeds, the missions of both that are compared without pairs:
            ``side`` (``a`` or ``b``), ``policy_a``, ``point_a`` and the metrics; else None.
    """

    a: Results
    b: Results
    missions: pd.DataFrame
    alone: pd.DataFrame
    points: pd.DataFrame
    unpaired: pd.DataFrame | None = None

    @property
    def identical(self) -> bool:
        """Whether both have the same missions, and their records are the same bit for bit."""
        return self.changed.empty and self.alone.empty and self.unpaired is None

    @cached_property
    def changed(self) -> pd.DataFrame:
        """The missions that differ, the most changed first: by product, ratio, then reward."""
        rows = self.missions[self.missions["fields"] != ""]
        sizes = {name: (rows[f"{name}_b"] - rows[f"{name}_a"]).abs() for name in _ORDER}
        order = pd.DataFrame(sizes).sort_values(_ORDER, ascending=False, kind="stable").index
        return rows.loc[order].reset_index(drop=True)


def diff_results(a: Results, b: Results) -> Diff:
    """Compare two results, mission by mission.

    If each has a single policy, the two policies are compared, whatever their names are; otherwise
    policies of the same name are compared. Two design points are the same if their scenarios are
    equal in all fields or, where no scenario is in both, in those of the design. Missions that
    check a selection are compared as well.

    Raises:
        InputError: If no mission is in both; with different seeds, no policy at a design point.
    """
    both = f"{a.store.folder} and {b.store.folder}"
    is_paired = len(_distinct_seeds(a, b)) == 1
    keys = _KEYS if is_paired else _KEYS[:2]
    single = len(a.policies) == len(b.policies) == 1
    teams = dict(zip(b.policies, a.policies if single else b.policies, strict=True))
    of_a, of_b = _number_scenarios(a, b)
    missions_a = _numbered_missions(a, {name: name for name in a.policies}, of_a)
    missions_b = _numbered_missions(b, teams, of_b)
    alone = [
        _rows_of_one_side("A", a, missions_a, missions_b, keys),
        _rows_of_one_side("B", b, missions_b, missions_a, keys),
    ]
    cells = [m.drop_duplicates(_KEYS[:2]) for m in (missions_a, missions_b)]
    cells = cells[0].merge(cells[1], on=_KEYS[:2], suffixes=("_a", "_b"))
    cells = cells[[*_KEYS[:2], "policy_a", "point_a", "point_b"]]
    common = missions_a.merge(missions_b, on=_KEYS, suffixes=("_a", "_b"))
    if (common if is_paired else cells).empty:
        lacking = ", ".join(f"only {rows['only_in'][0]} has {rows['what'][0]}" for rows in alone)
        raise InputError(both, f"no mission is in both: {lacking}", _ALLOWED)
    sides = None
    if not is_paired:
        rows = pd.concat([missions_a.assign(side="a"), missions_b.assign(side="b")])
        common = common[:0]
        sides = rows.merge(cells, on=_KEYS[:2])
    numbered = common[_KEYS].assign(mission=np.arange(len(common)))
    uavs = [_uavs_of_missions(a, missions_a, numbered), _uavs_of_missions(b, missions_b, numbered)]
    pairs = uavs[0].merge(uavs[1], on=["mission", "uav"], how="outer", suffixes=("_a", "_b"))
    common.insert(0, "fields", _differing_fields(common, pairs))
    points = cells[["point_a", "point_b"]].drop_duplicates()
    missions = common.drop(columns=_KEYS[:2])
    alone_in = pd.concat(alone, ignore_index=True)
    return Diff(a, b, missions, alone_in, points, sides)


_ALLOWED = "results folders that share policies, scenarios and replications"


def estimate_differences(found: Diff, by: Sequence[str] = ("policy_a",)) -> pd.DataFrame:
    """The differences B - A: of pairs, over the missions that both folders have, or unpaired.

    Args:
        found: The result of ``diff_results``.
        by: The columns that form groups: ``policy_a``, or ``policy_a`` and ``point_a``.

    Returns:
        A row per group and metric, the group with most differing missions first: the columns
        ``by``, ``missions``, ``differ`` (number of missions that differ), ``metric``, and the
        columns that follow ``metric`` in ``dess.analysis.compare``.
    """
    if found.unpaired is not None:
        return _unpaired_effects(found.unpaired, by)
    by_group = found.missions.assign(differ=found.missions["fields"] != "").groupby([*by])
    counts = by_group["differ"].agg(missions="size", differ="sum").reset_index()
    keys = ["policy_a", "point_a", "replication"]
    sides = []
    for side in "ab":
        metrics = {f"{name}_{side}": name for name in METRICS}
        metrics["uavs_a"] = "uavs"  # by which means are post-stratified
        side_missions = found.missions[[*keys, *metrics]].rename(columns=metrics)
        sides.append(side_missions.assign(policy=side, point=side_missions["point_a"]))
    table = compare(pd.concat(sides), "a", [*METRICS], by).drop(columns=["policy", "baseline"])
    ordered = counts.merge(table, on=[*by])
    return ordered.sort_values("differ", ascending=False, kind="stable", ignore_index=True)


def _unpaired_effects(missions: pd.DataFrame, by: Sequence[str]) -> pd.DataFrame:
    """``estimate_differences`` without pairs; its counts are those of both folders together."""
    rows = []
    for group, part in group_rows(missions, by):
        of_side = dict([*part.groupby("side")])
        for metric in METRICS:
            compared = compare_unpaired(of_side["b"][metric], of_side["a"][metric], metric)
            rows.append((*group, len(part), len(part), metric, *compared))
    columns = [*by, "missions", "differ", "metric", *Paired._fields]
    return add_adjusted(pd.DataFrame(rows, columns=columns), "holm")


def most_changed(found: Diff, missions: int) -> pd.DataFrame:
    """The most changed missions, with the commands that simulate them again.

    Returns:
        The first rows of ``changed`` with ``command_a`` and ``command_b``.
    """
    rows = found.changed[:missions]
    for side, results in (("a", found.a), ("b", found.b)):
        which = rows[[f"policy_{side}", f"point_{side}", "replication"]]
        asked = which.itertuples(index=False)
        folder = results.store.folder
        commands = [results.command(p, point, n, folder) for p, point, n in asked]
        rows = rows.assign(**{f"command_{side}": commands})
    return rows


def differing_origins(found: Diff) -> list[str]:
    """In what the origins of the two results differ, with a line for each part."""
    a = found.a.store.manifest
    b = found.b.store.manifest
    modules = sorted({*differing_modules(a.code, b.code), *differing_modules(b.code, a.code)})
    teams = found.missions[["policy_a", "policy_b"]].drop_duplicates().itertuples(index=False)
    weights_a, weights_b = ({t.policy: t.weights for t in m.policies} for m in (a, b))
    changed = [" and ".join({p: None, q: None}) for p, q in teams if weights_a[p] != weights_b[q]]
    names = [n for n in {**a.libraries, **b.libraries} if a.libraries.get(n) != b.libraries.get(n)]
    libraries = [f"{n} {a.libraries.get(n, '-')} and {b.libraries.get(n, '-')}" for n in names]
    seeds = _distinct_seeds(found.a, found.b)
    constants = _differing_constants(found)
    different_seeds = []
    if len(seeds) > 1:
        both = " and ".join(map(str, seeds))
        different_seeds.append(f"{both}, so that missions are compared without pairs")
    different_versions = []
    if a.version != b.version:
        different_versions.append(f"{a.version} and {b.version}")
    parts = {
        "seeds": different_seeds,
        "scenario": [f"{field} {of_a} and {of_b}" for field, of_a, of_b in constants],
        "version": different_versions,
        "code": modules,
        "weights": changed,
        "libraries": libraries,
        "accepted in A": [change.text for change in a.accepted],
        "accepted in B": [change.text for change in b.accepted],
    }
    return [f"{part}: {', '.join(words)}" for part, words in parts.items() if words]


def at_hand(results: Results) -> str:
    """In words: whether the code, weights and libraries of this process made the results."""
    try:
        changes = results.store.manifest.changes_here()
    except InputError as error:
        changes = [str(error)]
    return "; ".join(changes) or "made by the code, weights and libraries that are here"


def _distinct_seeds(a: Results, b: Results) -> list[int]:
    """The seed of both, or the two seeds."""
    return [*dict.fromkeys((a.store.manifest.seed, b.store.manifest.seed))]


def _differing_constants(found: Diff) -> list[tuple[str, str, str]]:
    """The fields in which the scenarios of compared design points differ, with their values."""
    differ: dict[tuple[str, str, str], None] = {}
    for points in found.points.itertuples(index=False):
        pair = zip((found.a, found.b), points, strict=True)
        of_a, of_b = (dotted(r.scenario(n).model_dump(mode="json")) for r, n in pair)
        for field in {**of_a, **of_b}:
            if of_a.get(field) != of_b.get(field):
                differ[field, shown(of_a.get(field)), shown(of_b.get(field))] = None
    return [*differ]


def _number_scenarios(a: Results, b: Results) -> tuple[np.ndarray, np.ndarray]:
    """A number for every design point: the same for equal scenarios or, without any, values."""
    texts = [[s.model_dump_json() for s in r.store.manifest.scenarios] for r in (a, b)]
    if not {*texts[0]} & {*texts[1]}:
        texts = [[json.dumps(v, sort_keys=True) for v in r.store.manifest.values] for r in (a, b)]
    numbers, _ = pd.factorize(np.array([*texts[0], *texts[1]], object))
    return numbers[: len(texts[0])], numbers[len(texts[0]) :]


def _numbered_missions(
    results: Results, teams: Mapping[str, str], scenarios: np.ndarray
) -> pd.DataFrame:
    """All missions with the columns that match them; equal design points count once."""
    rows = pd.concat([results.missions, results.checks], ignore_index=True)
    rows = rows.reindex(columns=["policy", "point", "replication", *_MISSION_FIELDS])
    rows = rows.assign(team=rows["policy"].map(teams), scenario=scenarios[rows["point"]])
    return rows.drop_duplicates(_KEYS, ignore_index=True)


def _uavs_of_missions(
    results: Results, missions: pd.DataFrame, numbered: pd.DataFrame
) -> pd.DataFrame:
    """The UAVs of the numbered missions."""
    manifest = results.store.manifest
    tables = [results.uavs]
    for number, policy in enumerate(results.policies):
        if parts := manifest.parts_of_check(number):
            tables.append(results.store.uavs(parts).assign(policy=policy))
    which = missions[["policy", "point", *_KEYS]].merge(numbered, on=_KEYS)
    which = which[["policy", "point", "replication", "mission"]]
    rows = pd.concat(tables, ignore_index=True).merge(which)
    return rows.reindex(columns=["mission", "uav", *_UAV_FIELDS])


def _differing_fields(missions: pd.DataFrame, uavs: pd.DataFrame) -> np.ndarray:
    """For every mission the names of the fields that differ; fields of UAVs are ``uav quota``."""
    differ = np.zeros((len(missions), len(_MISSION_FIELDS) + len(_UAV_FIELDS)), bool)
    for column, name in enumerate(_MISSION_FIELDS):
        differ[:, column] = _field_differs(missions, name)
    for column, name in enumerate(_UAV_FIELDS, len(_MISSION_FIELDS)):
        differ[uavs["mission"].to_numpy()[_field_differs(uavs, name)], column] = True
    names = np.array([*_MISSION_FIELDS, *(f"uav {name}" for name in _UAV_FIELDS)])
    patterns, which = np.unique(differ, axis=0, return_inverse=True)
    return np.array([", ".join(names[pattern]) for pattern in patterns], object)[which.ravel()]


def _field_differs(pairs: pd.DataFrame, name: str) -> np.ndarray:
    """For every mission, whether a field of A and B differs in any bit."""
    a, b = (pairs[f"{name}_{side}"] for side in "ab")
    if not pd.api.types.is_numeric_dtype(a):
        return (a != b).to_numpy()
    bits = [np.ascontiguousarray(values, float).view(np.int64) for values in (a, b)]
    return (bits[0] != bits[1]) & ~(a.isna() & b.isna()).to_numpy()  # nan: not measured


def _rows_of_one_side(
    side: str, results: Results, missions: pd.DataFrame, others: pd.DataFrame, keys: list[str]
) -> pd.DataFrame:
    """What only one side has: complete policies, complete design points, or replications."""
    other_keys = others[keys].drop_duplicates()
    side_of_row = missions[keys].merge(other_keys, how="left", indicator="found")["found"]
    rows = missions[side_of_row.to_numpy() != "both"]
    scenario = f"the scenario of study {results.study.name}"
    words = pd.Series([setting or scenario for setting in points_in_words(results)])
    points = rows["point"].map(words)
    no_policy = ~rows["team"].isin(others["team"])
    no_point = ~rows["scenario"].isin(others["scenario"])
    cells = "policy " + rows["policy"] + " at " + points
    what = cells.mask(no_point, points).mask(no_policy, "policy " + rows["policy"])
    parts = rows.assign(part=~no_policy & ~no_point).groupby(what.rename("what"), sort=False)
    spans = parts.agg(part=("part", "all"), missions=("part", "size"))
    first = parts["replication"].min()
    last = parts["replication"].max()
    replications = ", replications " + first.astype(str) + " to " + last.astype(str)
    names = spans.index.to_series() + replications.where(spans["part"], "")
    return pd.DataFrame(
        {"only_in": side, "what": [*names], "missions": spans["missions"].to_numpy(int)}
    )
