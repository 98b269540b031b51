"""An event log tells the whole mission: an auditor that knows only the page can replay it."""

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given

import policies as shipped
from dess import load_scenario
from dess.mission import simulate
from dess.record import MISSION_RECORD, MissionRecord
from dess.scenario import Scenario, ScenarioSpace
from tests.dess.auditor import WrongLogError, audit
from tests.drawn import Fidget, policies, replications, seeds, spaces

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
    for u, row, found in zip(record.uavs, record.uav_rows(), report["uavs"], strict=True):
        assert found["end"] == row["end"]
        assert found["communications"] == row["quota"]
        for name in ("battery", "slots_flying", "slots_charging", "slots_waiting"):
            assert found[name] == u[name]
        for name in ("collected", "reward"):
            assert found[name] == pytest.approx(u[name], abs=1e-6)


@given(spaces(), policies, seeds, replications)
def test_an_auditor_finds_the_record_in_the_log(
    space: ScenarioSpace, policy: object, seed: int, replication: int
) -> None:
    _check(simulate(space, policy, seed % 2**53, replication, events=True), space)


def test_an_auditor_finds_the_records_of_the_paper_scenario() -> None:
    paper, greedy = load_scenario("paper"), shipped.load("greedy")
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


@pytest.fixture(scope="module")
def log() -> Rows:
    """The log of a mission in which everything happens that the planted errors change."""
    wanted = {change.args[0] for change in PLANTED.values()}
    for replication in range(200):
        rows = _rows(simulate(SCENARIO, Fidget(), 5, replication, events=True))
        if wanted <= {row["event"] for row in rows}:
            return rows
    raise AssertionError("no mission in which everything happens")


class _Change:
    """A change of the middle row of an event, among the rows for which ``where`` holds."""

    def __init__(
        self,
        event: str,
        change: Callable[[Rows, int], None],
        where: Callable[[dict[str, Any]], bool] = lambda row: True,
    ):
        self.args = event, change, where

    def __call__(self, rows: Rows) -> None:
        event, change, where = self.args
        places = [i for i, row in enumerate(rows) if row["event"] == event and where(row)]
        change(rows, places[len(places) // 2])


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


def test_the_log_that_is_changed_is_right(log: Rows) -> None:
    _audit(log, SCENARIO)


@pytest.mark.parametrize("change", PLANTED.values(), ids=PLANTED.keys())
def test_an_auditor_finds_planted_errors(log: Rows, change: _Change) -> None:
    rows = [dict(row) for row in log]
    change(rows)
    with pytest.raises(WrongLogError, match=r"row \d+, slot \d+: "):
        _audit(rows, SCENARIO)


def test_a_log_that_is_cut_short_is_wrong(log: Rows) -> None:
    for length in (1, 5, len(log) // 2, len(log) - 1):
        with pytest.raises(WrongLogError):
            _audit(log[:length], SCENARIO)


def test_an_auditor_of_another_scenario_objects(log: Rows) -> None:
    for field, value in (("pads", 2), ("charge_rate", 9), ("quota", 120), ("slot_length", 1.1)):
        with pytest.raises(WrongLogError):
            _audit(log, SCENARIO.model_copy(update={field: value}))
