"""An event log tells the whole mission: an auditor that knows only the page can replay it."""

import re
from functools import cache
from itertools import product
from math import isnan, nan
from typing import Any

import pytest
from hypothesis import given

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


def _check(record: MissionRecord, scenario: Scenario | ScenarioSpace) -> None:
    """Check that the auditor finds the record of the mission in its log."""
    assert record.events is not None
    report = audit(record.events.columns(), scenario.model_dump())
    metrics = report["metrics"]
    if scenario.wind.is_on:  # the auditor does not know what the way home costs
        metrics["home"] = record.home
    wanted = {name: pytest.approx(record.metrics[name], abs=1e-6) for name in metrics}
    assert metrics == wanted and {*metrics} == {*(MISSION_RECORD.names or ())}
    measured = {n: v for n, v in report["measured"].items() if not isnan(v)}
    assert measured == pytest.approx(record.measured, abs=1e-6)
    for u, row, found in zip(record.uavs, record.uav_rows(), report["uavs"], strict=True):
        assert (found["end"], found["communications"]) == (row["end"], row["quota"])
        for name in ("battery", "slots_flying", "slots_charging", "slots_waiting"):
            assert found[name] == u[name]
        for name in ("collected", "reward"):
            assert found[name] == pytest.approx(u[name], abs=1e-6)


@given(spaces() | extended_spaces() | continuous_spaces(), policies, seeds, replications)
def test_an_auditor_finds_the_record_in_the_log(space, policy, seed, replication):
    _check(simulate(space, policy, seed % 2**53, replication, events=True), space)


# --- logs that somebody has changed ---

# Three UAVs, one pad, a channel that lets a node be emptied.
SCENARIO = Scenario.of(
    **{"grid": 6, "zone": [1, 1, 3, 1], "uavs": 3, "pads": 1, "nodes": [[0, 5], [4, 3]]},
    **{"edge_snr": 3, "initial_data": 60, "arrival_rate": 0.3, "flying_time": 30},
    **{"charge_start": 20, "charge_complete": 40, "quota": 130, "max_slots": 200},
)
# The same with everything that goes beyond the paper; the nodes' data are kept, or lost as packets.
FAILURES = {"uav_rate": 0.03, "uav_repair": 4, "node_rate": 0.1, "node_repair": 5}
BEYOND = ScenarioSpace.of(
    SCENARIO,
    **{"uavs": 4, "pads": 2, "zone": [1, 1, 2, 2], "quota": 160},
    age={"measured": True, "reward": -0.5},
    charging={"order": "lowest-battery", "power": 14},
    failures=FAILURES | {"pad_rate": 0.1, "pad_repair": 3},
    wind={"strength": 2.5, "direction": 30, "gusts": 0.1},
    fleet=[{"slots_per_cell": 2, "rate": 3}, {"flying_time": 25}, {"quota": 40}],
)
LOSING = {"uav_repair": 0, "uav_data": "lost", "node_data": "lost", "uav_rate": 0.01}
DATA_LOST = ScenarioSpace.of(BEYOND, failures=LOSING)
PACKETS = ScenarioSpace.of(
    DATA_LOST,
    arrivals={"process": "continuous", "buffer": 2, "service": "newest", "rates": [0.8, 2.5]},
    initial_data=5,
)
# An island between the nodes and two zones with a pad each.
SEA: dict[str, Any] = {
    **{"rows": 8, "zone": [1, 1, 2, 2], "pads": 1, "uavs": 4},
    **{"zones": [{"cells": [3, 7, 2, 1], "pads": 1}], "no_fly": [[2, 4], [3, 4], [3, 5], [5, 0]]},
    **{"nodes": [[0, 5], [4, 3]], "max_slots": 200, "shadowing_variance": 0.01},
}
ISLANDS, ALL = ScenarioSpace.of(SCENARIO, **SEA), ScenarioSpace.of(BEYOND, **SEA)
SCENARIOS = {"paper": SCENARIO, "beyond": BEYOND, "data lost": DATA_LOST, "packets": PACKETS}
OWN = ScenarioSpace.of(SCENARIO, arrivals={"rates": [0.0, 0.6], "initial": [60, 50]})
SCENARIOS |= {"islands": ISLANDS, "all": ALL, "own": OWN}
# What they must have logged, beside what every mission of theirs logs.
EVENTS = {"collision", "charge_request", "charge_withdrawal", "charge_end"}
BEYONDS = EVENTS | {"uav_failure", "pad_failure", "pad_repair", "node_failure", "node_repair"}
LOGGED = {
    "paper": EVENTS | {"quota_filled", "battery_empty"},
    "beyond": BEYONDS | {"uav_repair"},
    "data lost": BEYONDS | {"data_lost"},
    "packets": BEYONDS | {"loss", "delivery"},
    "islands": EVENTS | {"quota_filled", "battery_empty"},
    "all": BEYONDS | {"uav_repair"},
    "own": EVENTS | {"quota_filled", "battery_empty"},
}
# What the log alone cannot contradict: the key of the random streams, a level between two
# batteries, and the SNR at which a node is emptied.
FREE = {("mission_seed", "value"), ("mission_replication", "value")}
FREE |= {("mission_charge_start", "value"), ("communication", "snr")}


@cache
def _log_of(name: str) -> tuple[Rows, float]:
    """The log of a mission in which everything happens, and its reward."""
    for replication in range(200):
        record = simulate(SCENARIOS[name], Fidget(), 5, replication, events=True)
        assert record.events is not None
        if LOGGED[name] <= {*record.events.event}:
            return [row._asdict() for row in record.events], record.reward
    raise AssertionError("no mission in which everything happens")


def _is_wrong(rows: Rows, scenario: Scenario | ScenarioSpace, reward: float = nan) -> bool:
    """Whether the auditor finds a wrong row, or another reward: only it tells some collisions."""
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    try:
        found = audit(columns, scenario.model_dump())["metrics"]["reward"]
        return abs(found - reward) > 1e-6
    except WrongLogError as error:
        assert re.match(r"row \d+, slot \d+: ", str(error))
        return True


@pytest.mark.parametrize("every", [pytest.param(1, marks=pytest.mark.slow), 7])
@pytest.mark.parametrize("name", SCENARIOS)
def test_every_column_of_every_event_counts(name, every):
    """A row that is missing, or a number that is one more, is found; or some of them."""
    (log, reward), scenario, accepted = _log_of(name), SCENARIOS[name], set()
    assert not _is_wrong(log, scenario, reward)
    assert _is_wrong(log[: len(log) // 2], scenario) and _is_wrong([*log, log[-1]], scenario)
    for event, column in [*product(sorted({row["event"] for row in log}), log[0])][::every]:
        places = [i for i, row in enumerate(log) if row["event"] == event]
        place, rows = places[len(places) // 2], [dict(row) for row in log]
        if column == "event":
            del rows[place]
        else:
            rows[place][column] += 1
        if str(rows) != str(log) and not _is_wrong(rows, scenario, reward):  # it was nan
            accepted.add((event, column))
    assert accepted <= FREE
