"""The record of a mission and its event log."""

import pickle

import numpy as np
import pytest
from hypothesis import given

from dess.mission import simulate
from dess.record import EVENT_NAMES, MISSION_RECORD, MissionRecord, measures_of
from dess.scenario import Scenario, ScenarioSpace
from dess.state import sample_scenario
from tests.drawn import (
    Commuter,
    Fidget,
    continuous_spaces,
    extended_spaces,
    policies,
    replications,
    seeds,
    spaces,
)

# Nothing was delivered, or no age has come to its end.
NOT_ALWAYS = {"latency", "latency_p99", "peak_age"}


def _logged(
    space: ScenarioSpace, policy: object, seed: int, replication: int
) -> tuple[MissionRecord, dict[str, np.ndarray]]:
    """The record of a mission and its event log."""
    record = simulate(space, policy, seed, replication, events=True)
    assert record.events is not None
    return record, record.events.columns()


# A mission of any small space under any of the test policies.
missions = given(spaces(), policies, seeds, replications)


@missions
def test_the_log_costs_nothing_and_changes_nothing(
    space: ScenarioSpace, policy: object, seed: int, replication: int
) -> None:
    without = simulate(space, policy, seed, replication)
    assert without.events is None
    logged = simulate(space, policy, seed, replication, events=True)
    assert logged.metrics.tobytes() == without.metrics.tobytes()
    assert logged.uavs.tobytes() == without.uavs.tobytes()


@missions
def test_the_log_is_a_table_in_the_order_of_time(
    space: ScenarioSpace, policy: object, seed: int, replication: int
) -> None:
    record, log = _logged(space, policy, seed, replication)
    assert {len(column) for column in log.values()} == {len(record.events or ())}
    assert set(log["event"]) <= set(EVENT_NAMES)
    assert (np.diff(log["time"]) >= 0).all()

    fleet, nodes = int(record.metrics["uavs"]), len(space.nodes)
    for name, time in (("mission_start", 0.0), ("mission_end", float(record.slots))):
        rows = log["event"] == name
        assert (log["time"][rows] == time).all()
        assert log["uav"][rows].tolist() == [*range(fleet), *[-1] * nodes]
        assert log["node"][rows].tolist() == [*[-1] * fleet, *range(nodes)]

    m = space.communication_slots
    slots = np.arange(record.slots)
    instants = {slot + n / m for slot in slots.tolist() for n in range(1, m + 1)}
    served = log["event"] == "communication"
    assert set(log["time"][served].tolist()) <= instants
    assert (log["uav"][served] >= 0).all()
    assert (log["node"][served] >= 0).all()
    moves = log["event"] == "move"
    assert set(log["time"][moves].tolist()) == set(slots.tolist())
    arrivals = log["event"] == "arrival"
    assert set(log["time"][arrivals].tolist()) <= set((slots + 1).tolist())
    assert (log["value"][arrivals] >= 1).all()


@missions
def test_uavs_move_cell_by_cell_and_communicate_on_the_way(
    space: ScenarioSpace, policy: object, seed: int, replication: int
) -> None:
    _, log = _logged(space, policy, seed, replication)
    x, y, width, height = space.zone
    begins = (log["event"] == "mission_start") & (log["uav"] >= 0)
    occupied: dict[float, set] = {}
    for i in range(int(begins.sum())):
        mine = log["uav"] == i
        track = mine & ((log["event"] == "move") | begins)
        cells = np.stack([log["x"][track], log["y"][track]], 1)
        assert x <= cells[0, 0] < x + width
        assert y <= cells[0, 1] < y + height
        assert (np.abs(np.diff(cells, axis=0)).sum(1) <= 1).all()
        assert ((cells >= 0) & (cells < space.grid)).all()
        for time, cell in zip(log["time"][track][1:].tolist(), cells[1:].tolist(), strict=True):
            here = occupied.setdefault(time, set())
            assert tuple(cell) not in here
            here.add(tuple(cell))
        served = mine & (log["event"] == "communication")
        slot = np.ceil(log["time"][served]).astype(int) - 1
        part = (log["time"][served] - slot)[:, None]
        between = cells[slot] + (cells[slot + 1] - cells[slot]) * part
        np.testing.assert_allclose(log["x"][served], between[:, 0], atol=1e-9)
        np.testing.assert_allclose(log["y"][served], between[:, 1], atol=1e-9)


@missions
def test_pads_are_never_overbooked(
    space: ScenarioSpace, policy: object, seed: int, replication: int
) -> None:
    record, log = _logged(space, policy, seed, replication)
    pads = space.pads or space.zone[2] * space.zone[3]
    complete = int(record.metrics["charge_complete"])
    waiting: dict[int, float] = {}
    charging: dict[int, float] = {}
    charged = np.zeros(len(record.uavs), int)
    for time, event, i, value in zip(
        log["time"], log["event"], log["uav"], log["value"], strict=True
    ):
        if event == "charge_request":
            assert i not in charging
            assert value <= max(record.charge_start, complete - 1)
            waiting[i] = time
        elif event == "charge_start":
            assert waiting.pop(i) <= time
            charging[i] = time
            assert len(charging) <= pads
        elif event == "charge_end":
            charged[i] += time - charging.pop(i)
            assert value == complete or time == record.slots
        elif event == "communication":
            assert i not in charging or charging[i] >= time
    assert not charging
    assert charged.tolist() == record.uavs["slots_charging"].tolist()


def test_ends_are_logged_once() -> None:
    space = ScenarioSpace.of(
        grid=6,
        zone=[1, 1, 2, 2],
        nodes=[[0, 5], [5, 0]],
        uavs=4,
        pads=1,
        flying_time=[12, 30],
        quota=100,
    )
    seen = set()
    for replication in range(20):
        record, log = _logged(space, Fidget(), 5, replication)
        ends = [
            (i, event)
            for i, event in zip(log["uav"], log["event"], strict=True)
            if event in ("quota_filled", "battery_empty")
        ]
        names = {"quota": "quota_filled", "battery": "battery_empty"}
        rows = enumerate(record.uav_rows())
        assert sorted(ends) == [(i, names[u["end"]]) for i, u in rows if u["end"] in names]
        seen.update(event for _, event in ends)
    assert seen == set(names.values())


def test_the_metrics_of_a_record_are_attributes() -> None:
    space = ScenarioSpace.of(uavs=[1, 3])
    record = simulate(space, Commuter(), 3, 4)
    drawn = sample_scenario(space, 3, 4)
    assert (record.seed, record.replication) == (3, 4)
    assert record.metrics["uavs"] == drawn.uavs
    for name in ("flying_time", "charge_start", "charge_complete"):
        assert getattr(record, name) == getattr(drawn, name)
    for name in set(MISSION_RECORD.names or ()) - {"uavs"}:
        assert type(getattr(record, name)) in (int, float)
    assert isinstance(record.success, int)
    rows = record.uav_rows()
    assert [set(row) for row in rows] == [{"quota", "battery", "slots_charging", "end"}] * len(rows)
    with pytest.raises(AttributeError, match="speed"):
        _ = record.speed
    copy = pickle.loads(pickle.dumps(record))
    assert copy.metrics.tobytes() == record.metrics.tobytes()
    assert copy.uavs.tobytes() == record.uavs.tobytes()


def test_the_columns_of_a_log_are_attributes() -> None:
    log = simulate(ScenarioSpace.of(), Commuter(), 3, 4, events=True).events
    assert log is not None and log.event[0] == "mission_start"
    for name, column in log.columns().items():
        np.testing.assert_array_equal(getattr(log, name), column)
    with pytest.raises(AttributeError, match="colour"):
        _ = log.colour


def test_the_collection_ratio_without_data_is_one() -> None:
    scenario = Scenario.of(initial_data=0, arrival_rate=0, uavs=1)
    record = simulate(scenario, Commuter(), 0, 0)
    assert (record.initial, record.arrived, record.collected, record.residual) == (0, 0, 0, 0)
    assert (record.collection_ratio, record.success) == (1.0, 0)


def test_a_log_begins_with_the_parameters_of_its_mission() -> None:
    record, log = _logged(ScenarioSpace.of(uavs=[1, 3]), Commuter(), 2**40 + 1, 7)
    names = ("seed", "replication", "flying_time", "charge_start", "charge_complete")
    logged = dict(zip(log["event"].tolist(), log["value"].tolist(), strict=True))
    assert {name: logged[f"mission_{name}"] for name in names} == {
        name: getattr(record, name) for name in names
    }


@missions
def test_every_row_of_a_uav_has_its_battery(
    space: ScenarioSpace, policy: object, seed: int, replication: int
) -> None:
    record, log = _logged(space, policy, seed, replication)
    is_level = ~np.isin(log["event"], ["collision", "communication", "quota_filled", "data_lost"])
    of_uav = log["uav"] >= 0
    assert (log["battery"][of_uav & is_level] == log["value"][of_uav & is_level]).all()
    assert (log["battery"][~of_uav] == -1).all()
    for i in range(len(record.uavs)):
        battery = log["battery"][(log["uav"] == i) & (log["event"] != "move")]
        assert battery[-1] == record.uavs["battery"][i]


@given(extended_spaces() | continuous_spaces(), policies, seeds, replications)
def test_a_record_has_what_the_scenario_measures(
    space: ScenarioSpace, policy: object, seed: int, replication: int
) -> None:
    measured, known = {*simulate(space, policy, seed, replication).measured}, {*measures_of(space)}
    assert known - NOT_ALWAYS <= measured <= known
