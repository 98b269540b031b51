"""Exact checks: data and batteries balance, and logs add up to records."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from dess.analysis.results import event_log
from dess.analysis.results.tables import Results
from dess.model.state import EAST, HOVER, NORTH, SOUTH, WEST, constants_of
from dess.model.ways import move_costs
from dess.physics.fleet import type_of
from dess.scenario.fields import SAMPLED
from dess.scenario.scenario import Scenario, ScenarioSpace
from tests.verification.checks import (
    CONSERVATION,
    ENERGY,
    ENGINES,
    REALISATIONS,
    RECORDS,
    Check,
)
from tests.verification.measurements import Log, SimulatedAgain, longest_logs

EPSILON = np.finfo(float).eps

_KEPT = "initial + arrived = collected + residual (+ lost)"


def conservation_check(studies: Mapping[str, Results]) -> Check:
    """Check in every mission of every study that data are neither created nor lost.

    Every addition rounds its result, which is at most the total amount of data, by at most half a
    unit in the last place. So the number of additions gives a bound of the rounding error. The
    check reports the mission that comes closest to its bound.

    Args:
        studies: Results by the name of their study.
    """
    tables = [_imbalance_of_missions(results) for results in studies.values()]
    table = pd.concat(tables, ignore_index=True)
    error, bound = table.loc[(table["error"] / table["bound"]).idxmax()]
    seen = f"off by {error:.1e} of the data at most, {error / EPSILON:.0f} units of rounding"
    if len(studies) > 1:
        some = f"{len(studies)} studies"
    else:
        some = f"the study {next(iter(studies))}"
    test = f"Every mission of {some}"
    return Check.exact(CONSERVATION, test, _KEPT, seen, len(table), error, float(bound))


def _imbalance_of_missions(results: Results) -> pd.DataFrame:
    """A row per mission: ``error``, as a share of its data, and the ``bound`` of rounding."""
    missions = pd.concat([results.missions, results.checks])
    spaces = [results.scenario(point) for point in range(len(results.manifest["points"]))]
    m = missions["point"].map([space.communication_slots for space in spaces].__getitem__)
    nodes = missions["point"].map([len(space.nodes) for space in spaces].__getitem__)
    whole = missions["initial"] + missions["arrived"]
    if "lost" in missions:
        lost = missions["lost"]
    else:
        lost = pd.Series(np.nan, missions.index)
    error = (whole - missions["collected"] - missions["residual"] - lost.fillna(0.0)).abs()
    # Two additions per communication (node and mission), then arrivals and nodes; where data can be
    # lost, also what silent nodes hide, and each packet when it comes and when it goes.
    additions = 2 * m * missions["uav_slots"] + 2 * nodes * (missions["slots"] + 1)
    additions += (additions + 2 * missions["arrived"]).where(lost.notna(), 0)
    return pd.DataFrame(
        {"error": error / whole.where(whole > 0, 1.0), "bound": EPSILON * additions}
    )


def balance_check(logs: Sequence[Log]) -> Check:
    """Check at every node, bit for bit, that initial + arrived = collected + residual data."""
    off = max((float(np.abs(log.residuals[-1] - log.left).max()) for log in logs), default=0.0)
    lowest = min((float(log.residuals.min()) for log in logs), default=0.0)
    lowest = min(lowest, 0.0)
    n = sum(log.left.size for log in logs)
    seen = f"off by {off:g} data units at most, never below {lowest:g}"
    return Check.exact(CONSERVATION, "Every node of every log", _KEPT, seen, n, max(off, -lowest))


def battery_check(logs: Sequence[Log]) -> Check:
    """Check that the battery follows its rules (eq. 1-4, 8) in every UAV slot of the logs."""
    wrong = np.concatenate([np.zeros(0, bool), *map(battery_errors, logs)])
    cost, gain = (
        "/".join(map(str, sorted({getattr(log.scenario, field) for log in logs})))
        for field in ("flight_cost", "charge_rate")
    )
    rule = f"−{cost} % flying, +{gain} % charging; charging begins at or below C_S, ends at C_C"
    test = "Battery of every UAV in every slot"
    return Check.counted(ENERGY, test, rule, int(wrong.sum()), wrong.size)


def battery_errors(log: Log) -> np.ndarray:
    """For each of the N UAV slots of a log, whether it breaks a rule of the battery.

    What the wind costs in a cell is taken from the field of the scenario. How UAVs on pads share
    limited power is not checked, only that they take all of it, and none more than it can.
    """
    s, table = log.scenario, log.uav_slots
    uavs = table.groupby("uav")
    charging = table["charging"]
    before = uavs["battery"].shift().fillna(table["uav"].map(_first_battery(s)))
    flown = (before - s.flight_cost * _costs(s, table)).clip(lower=0)
    flown = flown.where(~table["grounded"], before)
    right = (table["battery"] == flown).where(~charging, _charges_rightly(log, before))
    right &= ~charging | ((_zone_of(s, table) >= 0) & ~table["moved"])
    level = np.select([before >= s.charge_complete, before <= s.charge_start], [0, 1], np.nan)
    latch = pd.Series(level).groupby(table["uav"]).ffill() == 1
    begins = charging & ~charging.groupby(table["uav"]).shift(fill_value=False)
    right &= ~begins | latch
    last = table["slot"] == s.max_slots - 1
    ends = charging & ~charging.groupby(table["uav"]).shift(-1, fill_value=False) & ~last
    failures = log.events.loc[log.events["event"] == "pad_failure", "time"]
    right &= ~ends | (table["battery"] == s.charge_complete) | (table["slot"] + 1).isin(failures)
    return (~right).to_numpy()


def _costs(scenario: Scenario, table: pd.DataFrame) -> Any:
    """(N,) the battery [%] that each UAV slot in the air takes."""
    mission = constants_of(ScenarioSpace.of(scenario))[0]
    spent = np.zeros(len(table), np.int64)
    for uav, rows in table.groupby("uav"):
        slots = type_of(scenario.fleet, int(str(uav))).slots_per_cell
        action = _actions(rows).where(rows["moved"]).mask(rows["grounded"], HOVER)
        if slots > 1:  # a failure ends a move
            action = action.ffill(limit=slots - 1)
        moves = move_costs(mission, slots, scenario.chart.zones.shape) // slots
        hovering = np.full((1, *moves.shape[1:]), mission["slot_costs"][5 * slots - 1])
        of_cells = np.concatenate([moves, hovering])
        taken = of_cells[action.fillna(HOVER).astype(int), rows["y"], rows["x"]]
        total = np.cumsum(np.where(rows["charging"] | rows["grounded"], 0, taken))
        spent[rows.index] = np.diff(total // 1000, prepend=0)  # whole percents leave the battery
    return spent


def _zone_of(scenario: Scenario, table: pd.DataFrame) -> np.ndarray:
    """(N,) the number of the charging zone in which each UAV is; negative for none."""
    return scenario.chart.zones[table["y"].to_numpy(), table["x"].to_numpy()]


def _first_battery(scenario: Scenario) -> dict[int, int]:
    """The battery of each UAV at the start [%]."""
    types = [type_of(scenario.fleet, i) for i in range(scenario.uavs)]
    return {i: kind.flying_time or scenario.flying_time for i, kind in enumerate(types)}


def _actions(table: pd.DataFrame) -> pd.Series:
    """(N,) the moves that lead to the cells of UAV slots; of those without one, any."""
    step_x = table["x"] - table["from_x"]
    step_y = table["y"] - table["from_y"]
    action = np.select([step_y < 0, step_x > 0, step_y > 0], [NORTH, EAST, SOUTH], WEST)
    return pd.Series(action, table.index)


def _charges_rightly(log: Log, before: pd.Series) -> pd.Series:
    """Whether a UAV that charges gains what it can, or all in its zone gain the shared power."""
    s, table = log.scenario, log.uav_slots
    charging = table["charging"]
    place = [table["slot"], _zone_of(s, table)]
    starts = log.events.loc[log.events["event"] == "charge_start", ["uav", "time"]]
    begins = pd.MultiIndex.from_frame(table[["uav", "slot"]]).isin(
        [*starts.itertuples(index=False)]
    )
    charge = pd.Series(begins).groupby(table["uav"]).cumsum()
    k = charging.groupby([table["uav"], charge]).cumsum()  # the slots of the present charge
    rate, slots = s.charge_fraction.as_integer_ratio()
    added = k * rate // slots - (k - 1) * rate // slots
    expected = (s.charge_complete - before).clip(upper=added).where(charging, 0)
    gain = (table["battery"] - before).where(charging, 0)
    of_all = gain.groupby(place).transform("sum")
    shared = expected.groupby(place).transform("sum").clip(upper=s.charging.power or np.inf)
    return gain.between(0, expected) & (of_all == shared)


def record_check(logs: Sequence[Log]) -> Check:
    """Check that the event logs add up to the records of their missions."""
    wrong = sum(not _adds_up(log) for log in logs)
    test = "Record of a mission against its log"
    return Check.counted(RECORDS, test, "the same", wrong, len(logs))


def _adds_up(log: Log) -> bool:
    """Whether a log adds up to the record of its mission, and to those of its UAVs."""
    events = log.events
    uavs = log.uavs.set_index("uav")
    value = events.groupby("event")["value"].sum()
    filled = {*events.loc[events["event"] == "quota_filled", "uav"]}
    served = events[events["event"] == "communication"].groupby("uav")["value"]
    ends = events[(events["event"] == "mission_end") & (events["uav"] >= 0)].set_index("uav")
    of_mission = {
        "slots": event_log.mission_length(events),
        "uav_slots": len(log.uav_slots),
        "arrived": value.get("arrival", 0.0),
        "success": filled == {*uavs.index},
        "initial": log.initial.sum(),
        "collected": value.get("communication", 0.0),
        "residual": log.left.sum(),
    }
    of_uavs = {
        "quota": served.size(),
        "battery": ends["value"].reindex(uavs.index),
        "slots_charging": log.uav_slots.groupby("uav")["charging"].sum(),
        "collected": served.sum(),
    }
    of_uavs = {name: totals.reindex(uavs.index, fill_value=0) for name, totals in of_uavs.items()}
    return {*uavs.index[uavs["end"] == "quota"]} == filled and all(
        np.allclose(np.asarray(record[name], float), np.asarray(stored, float), rtol=1e-12)
        for record, fields in ((log.record, of_mission), (uavs, of_uavs))
        for name, stored in fields.items()
    )


def realisation_checks(results: Results, logs: Sequence[Log]) -> list[Check]:
    """Check that all policies meet the same random draws in every replication."""
    if len(results.policies) < 2:
        return []
    drawn = results.missions.groupby(["point", "replication"])[[*SAMPLED, "initial"]].nunique()
    reference = {log.replication: log for log in longest_logs(logs)}
    others = sum(not _same_realisation(log, reference[log.replication]) for log in logs)
    expectation, of_replication = "the same for all policies", "of a replication"
    return [
        Check.counted(REALISATIONS, f"{what} {of_replication}", expectation, wrong, n)
        for what, wrong, n in (
            ("Parameters and initial data", int((drawn > 1).any(axis=1).sum()), len(drawn)),
            ("Arrivals and start cells", others, len(logs)),
        )
    ]


def _same_realisation(log: Log, other: Log) -> bool:
    """Whether a mission has the arrivals and the start cell of a longer one."""
    arrivals = log.arrivals
    return np.array_equal(arrivals, other.arrivals[: len(arrivals)]) and np.array_equal(
        log.first_cell, other.first_cell
    )


def engine_check(results: Results, again: Sequence[SimulatedAgain]) -> Check:
    """Check that missions of a study are the same, bit for bit, by the SimPy engine.

    Args:
        results: The results of a study that the batch engine simulated.
        again: Some of its missions, simulated again with the SimPy engine.
    """
    n = len(again)
    differing = sum(bool(mission.differs) for mission in again)
    seen = f"{n - differing:,} of {n:,} missions"
    test = f"Record of the {results.study.engine} engine, simulated again with SimPy"
    return Check.exact(ENGINES, test, "equal, bit for bit", seen, n, differing)
