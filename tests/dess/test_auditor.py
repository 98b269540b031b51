"""An event log tells the whole mission: an auditor that knows only the page can replay it."""

import math
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


class _Change:
    """A change of the middle row of an event, among the rows for which ``where`` holds."""

    def __init__(
        self,
        event: str,
        change: Callable[[Rows, int], None],
        where: Callable[[dict[str, Any]], bool] = lambda row: True,
    ):
        self.args = event, change, where

    def places(self, rows: Rows) -> list[int]:
        event, _, where = self.args
        return [i for i, row in enumerate(rows) if row["event"] == event and where(row)]

    def __call__(self, rows: Rows) -> None:
        places = self.places(rows)
        self.args[1](rows, places[len(places) // 2])


def _add(**numbers: float) -> Callable[[Rows, int], None]:
    def change(rows: Rows, place: int) -> None:
        for name, number in numbers.items():
            rows[place][name] += number

    return change


def _remove(rows: Rows, place: int) -> None:
    del rows[place]


def _repeat(rows: Rows, place: int) -> None:
    rows.insert(place, dict(rows[place]))


def _exchange(rows: Rows, place: int) -> None:
    rows[place - 1], rows[place] = rows[place], rows[place - 1]


PLANTED = {
    "a battery that lost too much": _Change("move", _add(value=-1, battery=-1)),
    "a battery with two values": _Change("move", _add(battery=1)),
    "a UAV that is elsewhere": _Change("move", _add(x=1)),
    "a UAV that jumps": _Change("move", _add(y=2)),
    "a move that is missing": _Change("move", _remove),
    "a move that is there twice": _Change("move", _repeat),
    "moves in another order": _Change("move", _exchange, lambda row: row["uav"] > 0),
    "a collision with another UAV": _Change("collision", _add(other=1)),
    "a collision that is missing": _Change("collision", _remove),
    "a collision that asked for another cell": _Change(
        "collision", _add(value=2), lambda row: row["other"] >= 0 and row["value"] < 2
    ),
    "another SNR": _Change("communication", _add(snr=-1)),
    "an SNR that cannot be": _Change("communication", _add(snr=80)),
    "more data": _Change("communication", _add(value=0.001)),
    "data of another node": _Change("communication", _add(node=1), lambda row: row["node"] == 0),
    "data at another time": _Change("communication", _add(time=0.125)),
    "a communication that is missing": _Change("communication", _remove),
    "one data unit more": _Change("arrival", _add(value=1)),
    "half a data unit more": _Change("arrival", _add(value=0.5)),
    "an arrival that is missing": _Change("arrival", _remove),
    "a request that is missing": _Change("charge_request", _remove),
    "a withdrawal that is missing": _Change("charge_withdrawal", _remove),
    "a pad that is granted to another UAV": _Change("charge_start", _add(uav=1)),
    "a pad that is not granted": _Change("charge_start", _remove),
    "a charging session that goes on": _Change("charge_end", _remove),
    "a quota that is filled early": _Change("quota_filled", _add(value=-1)),
    "a quota that is not filled": _Change("quota_filled", _remove),
    "a battery that is not empty": _Change("battery_empty", _remove),
    "other data left over": _Change("mission_end", _add(value=0.5)),
    "other initial data": _Change("mission_start", _add(value=-0.5)),
    "a UAV that starts outside the zone": _Change(
        "mission_start", _add(y=1), lambda row: row["uav"] == 0
    ),
    "another charging level": _Change("mission_charge_complete", _add(value=-5)),
    "a log that goes on after its end": _Change("mission_end", _repeat),
}

PLANTED_BEYOND = {
    "a battery that the wind emptied more": _Change("move", _add(value=-1, battery=-1)),
    "a slow UAV that is there too early": _Change(
        "communication", _add(x=0.5), lambda row: row["x"] % 1 > 0
    ),
    "a pad of another UAV": _Change("charge_start", _add(uav=1), lambda row: row["uav"] < 3),
    "another pad that fails": _Change("pad_failure", _add(value=1), lambda row: row["value"] == 0),
    "a pad that is repaired in secret": _Change("pad_repair", _remove),
    "a UAV that fails without a word": _Change("uav_failure", _remove),
    "a UAV that is repaired twice": _Change("uav_repair", _repeat),
    "another UAV that is repaired": _Change("uav_repair", _add(uav=1)),
    "a UAV that is grounded elsewhere": _Change("uav_failure", _add(x=1)),
    "a node that falls silent twice": _Change("node_failure", _repeat),
    "another node that falls silent": _Change(
        "node_failure", _add(node=1), lambda row: row["node"] == 0
    ),
    "a silent node that lost data": _Change("node_repair", _add(value=-1)),
    "a node that answers again in secret": _Change("node_repair", _remove),
    "a silent node with other data": _Change("node_failure", _add(value=0.25)),
    "a UAV in the way that is not": _Change("collision", _add(other=1)),
}
PLANTED_DATA_LOST = {
    "lost data that are missing": _Change("data_lost", _remove, lambda row: row["node"] >= 0),
    "more lost data of a node": _Change("data_lost", _add(value=1), lambda row: row["node"] >= 0),
    "other lost data of a UAV": _Change("data_lost", _add(value=1), lambda row: row["uav"] >= 0),
    "lost data of a UAV that are missing": _Change(
        "data_lost", _remove, lambda row: row["uav"] >= 0
    ),
    "a lost UAV that is not": _Change("uav_failure", _remove),
}
PLANTED_PACKETS = {
    "a packet at another time": _Change("arrival", _add(time=-1e-6)),
    "a packet that was generated before": _Change("delivery", _add(generated=-0.5)),
    "a packet that is missing": _Change("arrival", _remove),
    "a packet of another node": _Change("arrival", _add(node=1), lambda row: row["node"] == 0),
    "a packet of two data units": _Change("arrival", _add(value=1)),
    "a packet that is delivered twice": _Change("delivery", _repeat),
    "a delivery that is missing": _Change("delivery", _remove),
    "a delivery of another packet": _Change("delivery", _add(packet=-1)),
    "another latency": _Change("delivery", _add(value=0.25)),
    "a delivery to another UAV": _Change("delivery", _add(uav=1)),
    "a loss that is missing": _Change("loss", _remove),
    "a loss of another packet": _Change("loss", _add(packet=1)),
    "a loss of more data": _Change("loss", _add(value=0.1)),
    "a communication with less data": _Change("communication", _add(value=-0.001)),
}

BY_SCENARIO = {
    "paper": (SCENARIO, PLANTED),
    "beyond": (BEYOND, PLANTED_BEYOND),
    "data lost": (DATA_LOST, PLANTED_DATA_LOST),
    "packets": (PACKETS, PLANTED_PACKETS),
}


@cache
def _log_of(name: str) -> Rows:
    """The log of a mission in which everything happens that the planted errors change."""
    scenario, planted = BY_SCENARIO[name]
    for replication in range(200):
        rows = _rows(simulate(scenario, Fidget(), 5, replication, events=True))
        if all(change.places(rows) for change in planted.values()):
            return rows
    raise AssertionError("no mission in which everything happens")


@pytest.mark.parametrize("name", BY_SCENARIO)
def test_the_log_that_is_changed_is_right(name: str) -> None:
    _audit(_log_of(name), BY_SCENARIO[name][0])


@pytest.mark.parametrize(
    ("name", "error"), [(name, error) for name in BY_SCENARIO for error in BY_SCENARIO[name][1]]
)
def test_an_auditor_finds_planted_errors(name: str, error: str) -> None:
    scenario, planted = BY_SCENARIO[name]
    rows = [dict(row) for row in _log_of(name)]
    planted[error](rows)
    with pytest.raises(WrongLogError, match=r"row \d+, slot \d+: "):
        _audit(rows, scenario)


# What the log alone cannot contradict: the key of the random streams, a level between two
# batteries, and the SNR at which a node is emptied.
FREE = {("mission_seed", "value"), ("mission_replication", "value")}
FREE |= {("mission_charge_start", "value"), ("communication", "snr")}


@pytest.mark.slow
@pytest.mark.parametrize("name", BY_SCENARIO)
def test_every_column_of_every_event_counts(name: str) -> None:
    scenario, log, accepted = BY_SCENARIO[name][0], _log_of(name), set()
    for event, column in product({row["event"] for row in log}, log[0]):
        change = _Change(event, _remove if column == "event" else _add(**{column: 1}))
        rows = [dict(row) for row in log]
        change(rows)
        if str(rows) == str(log):  # it was nan
            continue
        try:
            _audit(rows, scenario)
        except WrongLogError:
            continue
        accepted.add((event, column))
    assert accepted <= FREE


@pytest.mark.parametrize("name", BY_SCENARIO)
def test_a_log_that_is_cut_short_is_wrong(name: str) -> None:
    log = _log_of(name)
    for length in (1, 5, len(log) // 2, len(log) - 1):
        with pytest.raises(WrongLogError):
            _audit(log[:length], BY_SCENARIO[name][0])


OTHERS = {
    "paper": {"pads": 2, "charge_rate": 9, "quota": 120, "slot_length": 1.1},
    "beyond": {
        **{"charging.order": "first-come", "charging.power": 9, "wind.direction": 120},
        **{"failures.pad_rate": 0, "failures.node_data": "lost", "fleet": []},
    },
    "packets": {"arrivals.buffer": 1, "arrivals.service": "oldest", "arrivals.rates": [0.5, 0]},
}


@pytest.mark.parametrize(
    ("name", "field"), [(name, field) for name, others in OTHERS.items() for field in others]
)
def test_an_auditor_of_another_scenario_objects(name: str, field: str) -> None:
    scenario = ScenarioSpace.of(BY_SCENARIO[name][0], **{field: OTHERS[name][field]})
    with pytest.raises(WrongLogError):
        _audit(_log_of(name), scenario)
