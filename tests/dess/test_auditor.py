"""An event log tells the whole mission: an auditor that knows only the page can replay it."""

import math
import re
from collections.abc import Callable
from functools import cache
from itertools import product
from typing import Any

import pytest
from hypothesis import given

import policies as shipped
from dess import load_scenario
from dess.mission import simulate
from dess.record import MISSION_RECORD, MissionRecord
from dess.scenario import Scenario, ScenarioSpace
from tests.dess.auditor import WrongLogError, audit
from tests.drawn import (
    Fidget,
    continuous_spaces,
    extended_spaces,
    policies,
    replications,
    seeds,
    spaces,
)

Rows = list[dict[str, Any]]


def _rows(record: MissionRecord) -> Rows:
    assert record.events is not None
    columns = {name: column.tolist() for name, column in record.events.columns().items()}
    return [
        dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)
    ]


def _audit(rows: Rows, scenario: Scenario | ScenarioSpace) -> dict[str, Any]:
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    return audit(columns, scenario.model_dump())


def _check(record: MissionRecord, scenario: Scenario | ScenarioSpace) -> None:
    """Check that the auditor finds the record of the mission in its log."""
    report = _audit(_rows(record), scenario)
    metrics = report["metrics"]
    wanted = {name: pytest.approx(record.metrics[name], abs=1e-6) for name in metrics}
    assert metrics == wanted
    assert {*metrics} == {*(MISSION_RECORD.names or ())}
    measured = {n: v for n, v in report["measured"].items() if not math.isnan(v)}
    assert measured == pytest.approx(record.measured, abs=1e-6)
    for u, row, found in zip(record.uavs, record.uav_rows(), report["uavs"], strict=True):
        assert found["end"] == row["end"]
        assert found["communications"] == row["quota"]
        for name in ("battery", "slots_flying", "slots_charging", "slots_waiting"):
            assert found[name] == u[name]
        for name in ("collected", "reward"):
            assert found[name] == pytest.approx(u[name], abs=1e-6)


@given(spaces() | extended_spaces() | continuous_spaces(), policies, seeds, replications)
def test_an_auditor_finds_the_record_in_the_log(
    space: ScenarioSpace, policy: object, seed: int, replication: int
) -> None:
    _check(simulate(space, policy, seed % 2**53, replication, events=True), space)


@pytest.mark.parametrize(
    "section",
    [
        {},
        {"failures.uav_rate": 0.002},
        {"wind.strength": 0.4},
        {"pads": 1, "charging.order": "lowest-battery"},
        {"arrivals.process": "continuous", "arrivals.buffer": 30},
    ],
)
def test_an_auditor_finds_the_records_of_the_paper_scenario(section: dict[str, Any]) -> None:
    paper, greedy = load_scenario("paper", **section), shipped.load("greedy")
    for replication in range(3):
        _check(simulate(paper, greedy, 2022, replication, events=True), paper)


# --- logs that somebody has changed ---

# Three UAVs, one pad, a channel that lets a node be emptied.
SCENARIO = Scenario.of(
    grid=6,
    zone=[1, 1, 3, 1],
    uavs=3,
    pads=1,
    nodes=[[0, 5], [4, 3]],
    edge_snr=3,
    initial_data=60,
    arrival_rate=0.3,
    flying_time=30,
    charge_start=20,
    charge_complete=40,
    quota=130,
    max_slots=200,
)


# The same with everything that goes beyond the paper; the nodes' data are kept, or lost as packets.
BEYOND = ScenarioSpace.of(
    SCENARIO,
    uavs=4,
    pads=2,
    zone=[1, 1, 2, 2],
    quota=160,
    age={"measured": True, "reward": -0.5},
    charging={"order": "lowest-battery", "power": 14},
    failures={
        **{"uav_rate": 0.03, "uav_repair": 4, "node_rate": 0.1, "node_repair": 5},
        **{"pad_rate": 0.1, "pad_repair": 3},
    },
    wind={"strength": 2.5, "direction": 30, "gusts": 0.1},
    fleet=[{"slots_per_cell": 2, "rate": 3}, {"flying_time": 25}, {"quota": 40}],
)
LOSING = {
    "failures.uav_repair": 0,
    "failures.uav_data": "lost",
    "failures.node_data": "lost",
    "failures.uav_rate": 0.01,
}
DATA_LOST = ScenarioSpace.of(BEYOND, **LOSING)
PACKETS = ScenarioSpace.of(
    BEYOND,
    **LOSING,
    arrivals={"process": "continuous", "buffer": 2, "service": "newest", "rates": [0.8, 2.5]},
    initial_data=5,
)


# Changes that no column alone makes, or that some rows only show.
PLANTED: dict[str, tuple[str, Callable[[dict[str, Any]], bool], dict[str, float]]] = {
    "paper": ("collision", lambda row: row["other"] >= 0 and row["value"] < 2, {"value": 2}),
    "beyond": ("communication", lambda row: row["x"] % 1 > 0, {"x": 0.5}),
    "data lost": ("data_lost", lambda row: row["uav"] >= 0, {"value": 1}),
    "packets": ("loss", lambda row: True, {"packet": 1}),
}
SCENARIOS = {"paper": SCENARIO, "beyond": BEYOND, "data lost": DATA_LOST, "packets": PACKETS}
# What they must have logged, beside what every mission of theirs logs.
EVENTS = {"collision", "charge_request", "charge_withdrawal", "charge_end"}
BEYONDS = EVENTS | {"uav_failure", "pad_failure", "pad_repair", "node_failure", "node_repair"}
LOGGED = {
    "paper": EVENTS | {"quota_filled", "battery_empty"},
    "beyond": BEYONDS | {"uav_repair"},
    "data lost": BEYONDS | {"data_lost"},
    "packets": BEYONDS | {"loss", "delivery"},
}


@cache
def _log_of(name: str) -> Rows:
    """The log of a mission in which everything happens."""
    for replication in range(200):
        rows = _rows(simulate(SCENARIOS[name], Fidget(), 5, replication, events=True))
        event, where, _ = PLANTED[name]
        happens = any(row["event"] == event and where(row) for row in rows)
        if happens and LOGGED[name] <= {row["event"] for row in rows}:
            return rows
    raise AssertionError("no mission in which everything happens")


def _is_wrong(rows: Rows, name: str) -> bool:
    try:
        _audit(rows, SCENARIOS[name])
    except WrongLogError as error:
        assert re.match(r"row \d+, slot \d+: ", str(error))
        return True
    return False


def _changed(
    name: str,
    event: str,
    change: dict[str, float] | None,
    where: Callable[[dict[str, Any]], bool] = lambda row: True,
) -> Rows:
    """The log with another middle row of an event; without it where there is no change."""
    rows = [dict(row) for row in _log_of(name)]
    places = [i for i, row in enumerate(rows) if row["event"] == event and where(row)]
    place = places[len(places) // 2]
    if change is None:
        del rows[place]
    else:
        rows[place] |= {column: rows[place][column] + by for column, by in change.items()}
    return rows


# What the log alone cannot contradict: the key of the random streams, a level between two
# batteries, and the SNR at which a node is emptied.
FREE = {("mission_seed", "value"), ("mission_replication", "value")}
FREE |= {("mission_charge_start", "value"), ("communication", "snr")}


@pytest.mark.parametrize("every", [pytest.param(1, marks=pytest.mark.slow), 7])
@pytest.mark.parametrize("name", SCENARIOS)
def test_every_column_of_every_event_counts(name: str, every: int) -> None:
    """A row that is missing, or a number that is one more, is found; or some of them."""
    log, accepted = _log_of(name), set()
    assert not _is_wrong(log, name)
    assert _is_wrong(_changed(name, PLANTED[name][0], PLANTED[name][2], PLANTED[name][1]), name)
    assert _is_wrong(log[: len(log) // 2], name) and _is_wrong([*log, log[-1]], name)
    for event, column in [*product(sorted({row["event"] for row in log}), log[0])][::every]:
        rows = _changed(name, event, None if column == "event" else {column: 1})
        if str(rows) != str(log) and not _is_wrong(rows, name):  # it was nan
            accepted.add((event, column))
    assert accepted <= FREE


OTHERS = {
    "paper": {"pads": 2, "charge_rate": 9, "quota": 120, "slot_length": 1.1},
    "beyond": {
        **{"charging.order": "first-come", "charging.power": 9, "wind.direction": 120},
        **{"failures.pad_rate": 0, "failures.node_data": "lost", "fleet": []},
    },
    "packets": {"arrivals.buffer": 1, "arrivals.service": "oldest", "arrivals.rates": [0.5, 0]},
}


@pytest.mark.parametrize("name", OTHERS)
def test_an_auditor_of_another_scenario_objects(name: str) -> None:
    for field, value in OTHERS[name].items():
        with pytest.raises(WrongLogError):
            _audit(_log_of(name), ScenarioSpace.of(SCENARIOS[name], **{field: value}))
