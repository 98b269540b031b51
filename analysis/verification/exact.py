"""Exact checks: what the records and event logs of a study say, computed once more from the model.

Of the simulator they share the generator of random words alone, run as plain Python.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd
from scipy import special

from analysis.results import event_log
from analysis.results.store import MANIFEST
from analysis.results.tables import Results, load_results
from analysis.verification import closed_forms
from analysis.verification.checks import Check
from dess import simulate, streams
from dess.errors import InputError
from dess.record import MISSION_RECORD, UAV_RECORD, MissionRecord
from dess.scenario import SAMPLED, Scenario, ScenarioSpace
from dess.state import END_NAMES
from policies import load_team

CHANNEL, CONSERVATION, ENERGY = "Channel", "Conservation", "Energy"
RECORDS, SEA, ENGINES = "Records", "Common sea", "Engines"

EPSILON = np.finfo(float).eps
# Units of rounding by which two ways to compute a rate may differ: a handful of steps each, of
# which the way from SNR [dB] to a ratio magnifies the rounding most.
_ROUNDINGS = 1000

_KEPT = "initial + arrived = collected + residual"


@dataclass(frozen=True, eq=False)
class Log:
    """A mission whose event log is kept.

    Attributes:
        policy: Who flew it.
        scenario: What its replication drew.
        mission: Its record.
        uavs: The records of its UAVs.
        events: Its event log.
    """

    policy: str
    scenario: Scenario
    mission: pd.Series
    uavs: pd.DataFrame
    events: pd.DataFrame

    @property
    def replication(self) -> int:
        """Which replication it is."""
        return int(self.mission["replication"])

    @cached_property
    def uav_slots(self) -> pd.DataFrame:
        """What every UAV did in every slot, as ``analysis.results.event_log.uav_slots`` has it."""
        return event_log.uav_slots(self.events)

    @cached_property
    def initial(self) -> np.ndarray:
        """(K,) data of every node at the start [data units]."""
        return self._of_nodes("mission_start")

    @cached_property
    def left(self) -> np.ndarray:
        """(K,) data of every node at the end [data units]."""
        return self._of_nodes("mission_end")

    @cached_property
    def first_cell(self) -> np.ndarray:
        """(2,) the cell at which the first UAV starts."""
        rows = self.events[(self.events["event"] == "mission_start") & (self.events["uav"] == 0)]
        return rows[["x", "y"]].to_numpy(int)[0]

    @cached_property
    def arrivals(self) -> np.ndarray:
        """(T, K) data units that arrived, by mission slot and node."""
        rows = self.events[self.events["event"] == "arrival"]
        counts = np.zeros((event_log.duration(self.events), len(self.scenario.nodes)), int)
        slot = rows["time"].astype(int) - 1
        np.add.at(counts, (slot, rows["node"]), rows["value"].astype(int))
        return counts

    def _of_nodes(self, event: str) -> np.ndarray:
        rows = self.events[(self.events["event"] == event) & (self.events["node"] >= 0)]
        return rows.sort_values("node")["value"].to_numpy()


def studies_in(folder: Path, *, but: str = "") -> tuple[dict[str, Results], list[str]]:
    """The results of all studies in a folder, and the names of those that cannot be loaded.

    Args:
        folder: Holds a results folder per study.
        but: A study to leave out.
    """
    loaded, damaged = {}, []
    for path in sorted(folder.glob(f"*/{MANIFEST}")):
        name = path.parent.name
        if name != but:
            try:
                loaded[name] = load_results(path.parent)
            except InputError:
                damaged.append(name)
    return loaded, damaged


def logs_of(results: Results) -> list[Log]:
    """The missions of the first design point whose logs a study has kept."""
    found = []
    space, kept = results.scenario(), range(results.manifest["study"]["logged"])
    missions, uavs = (
        table[(table["point"] == 0) & table["replication"].isin(kept)]
        for table in (results.missions, results.uavs)
    )
    for policy in results.policies:
        records = missions[missions["policy"] == policy].set_index("replication", drop=False)
        fleets = uavs[uavs["policy"] == policy]
        for replication in kept:
            own = records.loc[replication]
            scenario = space.scenario_at(**{name: int(own[name]) for name in SAMPLED})
            fleet = fleets[fleets["replication"] == replication]
            events = results.events(policy, 0, replication)
            found.append(Log(policy, scenario, own, fleet, events))
    return found


def longest(logs: Sequence[Log]) -> list[Log]:
    """Of every replication the log that lasts longest: policies share all that arrives in it."""
    kept: dict[int, Log] = {}
    for log in logs:
        other = kept.get(log.replication)
        if other is None or log.mission["slots"] > other.mission["slots"]:
            kept[log.replication] = log
    return [kept[replication] for replication in sorted(kept)]


def arrivals(logs: Sequence[Log], space: ScenarioSpace) -> np.ndarray:
    """(T, K) data units that arrived in missions one after another, by mission slot and node."""
    none = np.zeros((0, len(space.nodes)), int)
    return np.concatenate([none, *(log.arrivals for log in logs)])


def channel_checks(logs: Sequence[Log], seed: int) -> list[Check]:
    """Every communication of the logs: the node that was served, and what it gave.

    Both are computed again from the formula, with the shadowing of that communication slot: the
    best of the nodes that have data, and the smaller of its rate and its data.
    """
    tables = [communications(log, seed) for log in logs]
    table = pd.concat(tables) if tables else pd.DataFrame(columns=_COMMUNICATIONS, dtype=float)
    n = len(table)
    other = int((table["node"] != table["best"]).sum())
    same = table[table["node"] == table["best"]]
    off = float((same["value"] / same["known"] - 1).abs().max()) if len(same) else 0.0
    emptied = int((same["known"] == same["residual"]).sum())
    test, known = "Node served in a communication slot", "the one heard best, of those with data"
    choice = _exact(CHANNEL, test, known, _otherwise(other), n, other)
    test, known = "Data of a communication", "min(R, D) with the shadowing that was drawn"
    seen = f"off by {off:.1e} of it at most; {emptied:,} times the node was emptied"
    return [choice, _exact(CHANNEL, test, known, seen, len(same), off, _ROUNDINGS * EPSILON)]


_COMMUNICATIONS = ["node", "value", "best", "known", "residual"]


def communications(log: Log, seed: int) -> pd.DataFrame:
    """Every communication of a log, computed once more.

    Returns:
        A row per communication: ``node`` and ``value`` as logged; ``best``, the node with the
        highest SNR of those with data; ``known``, the smaller of its rate and its ``residual``
        [data units].
    """
    scenario, m = log.scenario, log.scenario.communication_slots
    served = log.events["event"] == "communication"
    rows = log.events[served]
    slot = np.ceil(rows["time"]).to_numpy(np.int64) - 1
    number = np.rint((rows["time"] - slot) * m).to_numpy(np.int64) - 1
    away = rows[["x", "y"]].to_numpy()[:, None] - np.array(scenario.nodes)
    distance = closed_forms.distance(scenario, away[..., 0], away[..., 1])
    eta = _shadowing(seed, log, rows["uav"].to_numpy(np.int64), slot, number)
    snr = closed_forms.mean_snr(scenario, distance) + eta
    residual = _residuals(log)[served.to_numpy()]
    best = np.where(residual > 0, snr, -np.inf).argmax(1)
    each = np.arange(len(rows))
    rate, left = closed_forms.rate(scenario, snr[each, best]), residual[each, best]
    columns = (
        rows["node"].to_numpy(),
        rows["value"].to_numpy(),
        best,
        np.minimum(rate, left),
        left,
    )
    return pd.DataFrame(dict(zip(_COMMUNICATIONS, columns, strict=True)))


def _shadowing(seed: int, log: Log, uav: np.ndarray, slot: np.ndarray, n: np.ndarray) -> np.ndarray:
    """(E, K) shadowing [dB] of communication slots ``n`` = 0..m-1, for all nodes.

    Four communication slots share a block of four words; a block has the UAV and the number of the
    four as its lane.
    """
    lane = (np.uint64(streams.SHADOWING) << np.uint64(24)) | (n // 4 * 65536 + uav).astype(
        np.uint64
    )
    key, mask, half = np.uint64(seed), np.uint64(2**32 - 1), np.uint64(32)
    words = streams.philox.py_func(
        np.arange(len(log.scenario.nodes), dtype=np.uint64)[None, :],
        slot.astype(np.uint64)[:, None],
        lane[:, None],
        np.uint64(log.replication),
        key & mask,
        key >> half,
    )
    word = np.choose(n[:, None] % 4, words)
    deviates = special.ndtri((word.astype(float) + 0.5) / 2.0**32)
    return np.sqrt(log.scenario.shadowing_variance) * deviates


def _residuals(log: Log) -> np.ndarray:
    """(E, K) residual data before every event of a log, added up in its order."""
    events = log.events
    flows = np.zeros((len(events) + 1, len(log.scenario.nodes)))
    flows[0] = log.initial
    sign = events["event"].map({"arrival": 1.0, "communication": -1.0}).fillna(0.0)
    flowing = np.flatnonzero(sign)
    nodes = events["node"].to_numpy()[flowing]
    flows[flowing + 1, nodes] = (sign * events["value"]).to_numpy()[flowing]
    return flows.cumsum(0)[:-1]


def balance_check(logs: Sequence[Log]) -> Check:
    """Node by node: what it had and received is what was taken and is left, to the last bit."""
    error, lowest, n = 0.0, 0.0, 0
    for log in logs:
        residual = _residuals(log)
        error = max(error, float(np.abs(residual[-1] - log.left).max()))
        lowest, n = min(lowest, float(residual.min())), n + log.left.size
    seen = f"off by {error:g} data units at most, never below {lowest:g}"
    return _exact(CONSERVATION, "Every node of every log", _KEPT, seen, n, max(error, -lowest))


def conservation_check(results: Mapping[str, Results]) -> Check:
    """Every mission of every study: data are neither made nor lost.

    Every addition rounds its result, which is never above the whole, by half a unit of rounding at
    most. So the number of additions bounds what rounding can do; told is the mission
    that comes closest to its bound.
    """
    worst = pd.DataFrame({"error": [0.0], "bound": [1.0]})  # by the share of what it may be
    n = 0
    for study in results.values():
        missions = pd.concat([study.missions, study.checks])
        spaces = [study.scenario(point) for point in range(len(study.manifest["points"]))]
        m = missions["point"].map([s.communication_slots for s in spaces].__getitem__)
        nodes = missions["point"].map([len(s.nodes) for s in spaces].__getitem__)
        whole = missions["initial"] + missions["arrived"]
        error = (whole - missions["collected"] - missions["residual"]).abs()
        # Collected twice: from a node, and to the sum of the mission. Then arrivals, and nodes.
        additions = 2 * m * missions["uav_slots"] + 2 * nodes * (missions["slots"] + 1)
        errors = {"error": error / whole.where(whole > 0, 1.0), "bound": EPSILON * additions}
        worst = pd.concat([worst, pd.DataFrame(errors)], ignore_index=True)
        worst = worst.loc[[(worst["error"] / worst["bound"]).idxmax()]]
        n += len(missions)
    error, bound = (float(worst[name].iloc[0]) for name in ("error", "bound"))
    seen = f"off by {error:.1e} of the data at most, {error / EPSILON:.0f} units of rounding"
    test = f"Every mission of {_studies(results)}"
    return _exact(CONSERVATION, test, _KEPT, seen, n, error, bound)


def _studies(results: Mapping[str, Results]) -> str:
    return f"{len(results)} studies" if len(results) > 1 else f"the study {next(iter(results))}"


def battery_check(logs: Sequence[Log]) -> Check:
    """Every UAV slot of the logs: the battery by its rules (eq. 1-4, 8)."""
    wrong = [battery_errors(log) for log in logs]
    errors = sum(int(each.sum()) for each in wrong)
    cost, gain = (
        "/".join(str(n) for n in sorted({getattr(log.scenario, field) for log in logs}))
        for field in ("flight_cost", "charge_rate")
    )
    known = f"−{cost} % flying, +{gain} % charging, which begins at C_S or below and ends at C_C"
    test = "Battery of every UAV in every slot"
    return _exact(ENERGY, test, known, _otherwise(errors), sum(map(len, wrong)), errors)


def battery_errors(log: Log) -> np.ndarray:
    """(N,) whether a UAV slot of a log breaks a rule of the battery."""
    s, table = log.scenario, log.uav_slots
    before = table.groupby("uav")["battery"].shift().fillna(s.flying_time)
    charging = table["charging"]
    begins = charging & ~charging.groupby(table["uav"]).shift(fill_value=False)
    last = table["slot"] == s.max_slots - 1
    ends = charging & ~charging.groupby(table["uav"]).shift(-1, fill_value=False) & ~last
    x, y, width, height = s.zone
    parked = table["x"].between(x, x + width - 1) & table["y"].between(y, y + height - 1)
    charged = (before + s.charge_rate).clip(upper=s.charge_complete)
    right = np.where(charging, charged, before - s.flight_cost) == table["battery"]
    right &= ~charging | (parked & ~table["moved"])
    right &= ~begins | (before <= s.charge_start)
    right &= ~ends | (table["battery"] == s.charge_complete)
    return (~right).to_numpy()


def record_check(logs: Sequence[Log]) -> Check:
    """The records of the missions whose logs are kept, added up from their logs."""
    wrong = sum(not _agrees(log) for log in logs)
    test = "Record of a mission against its log"
    return _exact(RECORDS, test, "the same", _otherwise(wrong), len(logs), wrong)


def _agrees(log: Log) -> bool:
    """Whether a mission's record is what its log adds up to."""
    events, mission, uavs = log.events, log.mission, log.uavs.set_index("uav")
    value = events.groupby("event")["value"].sum()
    of_uavs = events[events["event"] == "communication"].groupby("uav")["value"]
    fleet = uavs.index
    ends = events[(events["event"] == "mission_end") & (events["uav"] >= 0)].set_index("uav")
    table = log.uav_slots
    quota = of_uavs.size().reindex(fleet, fill_value=0)
    filled = set(events.loc[events["event"] == "quota_filled", "uav"])
    whole = {
        "slots": event_log.duration(events),
        "uav_slots": len(table),
        "arrived": value.get("arrival", 0.0),
        "success": filled == {*fleet},
    }
    sums = {
        "initial": log.initial.sum(),
        "collected": value.get("communication", 0.0),
        "residual": log.left.sum(),
    }
    charging = table.groupby("uav")["charging"].sum().reindex(fleet, fill_value=0)
    return (
        all(mission[name] == whole[name] for name in whole)
        and np.allclose([mission[name] for name in sums], [*sums.values()], rtol=1e-12)
        and (uavs["quota"] == quota).all()
        and {*fleet[uavs["end"] == "quota"]} == filled
        and (uavs["battery"] == ends["value"].reindex(fleet)).all()
        and (uavs["slots_charging"] == charging).all()
        and np.allclose(uavs["collected"], of_uavs.sum().reindex(fleet, fill_value=0.0), rtol=1e-12)
    )


def sea_checks(results: Results, logs: Sequence[Log]) -> list[Check]:
    """What policies share: every replication gives all of them the same mission to fly."""
    if len(results.policies) < 2:
        return []
    fields = [*SAMPLED, "initial"]
    table = results.missions.groupby(["point", "replication"])[fields].nunique()
    differ = int((table > 1).any(axis=1).sum())
    reference = {log.replication: log for log in longest(logs)}
    others = sum(not _same_sea(log, reference[log.replication]) for log in logs)
    known = "the same for all policies"
    return [
        _exact(SEA, f"{what} of a replication", known, _otherwise(wrong), n, wrong)
        for what, n, wrong in (
            ("Parameters and initial data", len(table), differ),
            ("Arrivals and start cells", len(logs), others),
        )
    ]


def _same_sea(log: Log, other: Log) -> bool:
    own, theirs = log.arrivals, other.arrivals
    return np.array_equal(own, theirs[: len(own)]) and np.array_equal(
        log.first_cell, other.first_cell
    )


def engine_check(results: Results, count: int) -> Check:
    """Missions of the study flown again with the SimPy engine, compared bit for bit.

    Args:
        results: Of a study that the batch engine ran.
        count: How many of every policy, spread over its replications.
    """
    space, seed, alike = results.scenario(), results.store.manifest.seed, []
    missions, uavs = (table[table["point"] == 0] for table in (results.missions, results.uavs))
    for policy in results.policies:
        team, kept = load_team(policy), missions[missions["policy"] == policy]
        fleets = uavs[uavs["policy"] == policy].set_index("replication")
        rows = np.unique(np.linspace(0, len(kept) - 1, count).astype(int))
        for _, mission in kept.iloc[rows].iterrows():
            replication = int(mission["replication"])
            again = simulate(space, team, seed, replication)
            alike.append(_equal(again, mission, fleets.loc[[replication]]))
    seen = f"{sum(alike):,} of {len(alike):,} missions"
    test = f"Record of the {results.manifest['study']['engine']} engine, flown again with SimPy"
    known = "equal, bit for bit"
    return _exact(ENGINES, test, known, seen, len(alike), len(alike) - sum(alike))


def _equal(again: MissionRecord, mission: pd.Series, uavs: pd.DataFrame) -> bool:
    """Whether a mission's record and those of its UAVs are the same in every field."""
    ends = [END_NAMES[end] for end in again.uavs["end"]]
    numbers = [name for name in UAV_RECORD.names or () if name != "end"]
    return (
        all(again.metrics[name] == mission[name] for name in MISSION_RECORD.names or ())
        and all(np.array_equal(again.uavs[name], uavs[name]) for name in numbers)
        and ends == uavs["end"].tolist()
    )


def _exact(
    topic: str, test: str, known: str, seen: str, n: int, error: float, bound: float = 0.0
) -> Check:
    """An exact check; without observations it cannot be told."""
    return Check(topic, test, known, seen, n, error=float(error) if n else None, bound=bound)


def _otherwise(times: int) -> str:
    return "always" if not times else f"otherwise {times:,} times"
