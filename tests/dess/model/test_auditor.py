"""An event log tells the whole mission: an auditor that knows only the page can replay it."""

from fractions import Fraction
from math import isnan
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from dess.model.mission import simulate
from dess.model.record import MISSION_RECORD, NODE_RECORD, measures_of
from dess.physics.fleet import UavType
from dess.physics.section import Section
from dess.policies import load
from dess.scenario.data_sheet import DataSheet
from dess.scenario.scenario import ScenarioSpace, load_scenario
from tests.dess.model.auditor import audit
from tests.drawn import (
    continuous_spaces,
    extended_spaces,
    policies,
    replications,
    seeds,
    sheet_spaces,
    spaces,
)

# Nothing was delivered, no age has come to its end, or no UAV has asked for a pad.
NOT_ALWAYS = {"latency", "latency_p99", "peak_age", "waiting"}


def constants_of(space: ScenarioSpace) -> dict[str, Any]:
    """The fields of a scenario, and those that follow from its data sheet."""
    constants = space.model_dump()
    if space.units:
        for field in space.data_sheet.fields():
            name = field.partition(".")[0]
            value = getattr(space, name)
            constants[name] = value.model_dump() if isinstance(value, Section) else value
        constants["charge_rate"] = space.charge_fraction  # exactly, as the times were typed
        constants["fleet"] = [_type_in_slots(kind, space.data_sheet) for kind in space.fleet]
        if space.data_sheet.idle:
            slot = 60 * _number(space.data_sheet.endurance) / 100
            constants["before"] = {"idle": float(3600 * _number(space.data_sheet.idle) / slot)}
    return constants


def _type_in_slots(kind: UavType, sheet: DataSheet) -> dict[str, Any]:
    """A type of UAVs in percent and slots, computed from its times in minutes and its speed."""
    fields = kind.model_dump()
    endurance = _number(kind.endurance or sheet.endurance)
    if kind.endurance:
        above_reserve = 100 - _number(sheet.reserve or "0 %")
        fields["full"] = int(endurance / _number(sheet.endurance) * above_reserve)
    if kind.charging:
        fields["charge_rate"] = endurance / _number(kind.charging)
    if kind.cruise:
        fields["slots_per_cell"] = round(_number(sheet.cruise) / _number(kind.cruise))
    return fields


def _number(quantity: str | None) -> Fraction:
    return Fraction((quantity or "").split()[0])


@given(
    spaces() | extended_spaces() | continuous_spaces() | sheet_spaces(),
    policies,
    seeds,
    replications,
)
def test_an_auditor_finds_the_record_in_the_log(space, policy, seed, replication):
    record = simulate(space, policy, seed % 2**53, replication, events=True)
    assert record.events is not None
    report = audit(record.events.columns(), constants_of(space))
    metrics = report["metrics"]
    if space.wind.gusts:  # the auditor does not know what the way home costs
        metrics["home"] = record.home
    wanted = {name: pytest.approx(record.metrics[name], abs=1e-6) for name in metrics}
    assert metrics == wanted and {*metrics} == {*(MISSION_RECORD.names or ())}
    measured = {n: v for n, v in report["measured"].items() if not isnan(v)}
    assert measured == pytest.approx(record.measured, abs=1e-6)
    known = {*measures_of(space)}
    assert known - NOT_ALWAYS <= {*measured} <= known
    for u, row, found in zip(record.uavs, record.uav_rows(), report["uavs"], strict=True):
        assert (found["end"], found["communications"]) == (row["end"], row["quota"])
        for name in ("battery", "slots_flying", "slots_charging", "slots_waiting", "charged"):
            assert found[name] == u[name]
        for name in ("collected", "reward"):
            assert found[name] == pytest.approx(u[name], abs=1e-6)
    assert (record.nodes is None) == (space.units is None)
    if record.nodes is not None:
        check_nodes(record.nodes, report["nodes"])


def check_nodes(records: np.ndarray, found: list[dict[str, float]]) -> None:
    for node, of_auditor in zip(records, found, strict=True):
        wanted = {name: pytest.approx(node[name], abs=1e-6) for name in NODE_RECORD.names or ()}
        assert of_auditor == wanted


@pytest.mark.parametrize("data", ["kept", "lost"])
def test_an_auditor_finds_the_records_of_nodes_in_the_log_of_packets(data):
    """In continuous time, where nodes fall silent."""
    failures = {"node_rate": 0.02, "node_repair": 8.0, "node_data": data, "uav_rate": 0.002}
    changes = {
        "data_sheet.horizon": "1 h",
        "data_sheet.message": "500 kB",
        "data_sheet.idle": None,  # which needs slotted arrivals
        "arrivals.process": "continuous",
        "failures": failures | {"uav_repair": 20.0},
        "age.measured": True,
    }
    space = load_scenario("jade-bight", **changes)
    record = simulate(space, load("greedy"), 1, 2, events=True)
    assert record.nodes is not None and record.events is not None
    check_nodes(record.nodes, audit(record.events.columns(), constants_of(space))["nodes"])
    nodes = record.nodes
    lost = nodes["initial"] + nodes["arrived"] - nodes["collected"] - nodes["residual"]
    assert lost.sum() == pytest.approx(record.lost, abs=1e-6)
    assert (record.lost > 0) == (data == "lost")
    assert nodes["age"].mean() == pytest.approx(record.age)
    assert np.ptp(nodes["age_at_end"]) > 1 and (nodes["age"] > 0).all()
