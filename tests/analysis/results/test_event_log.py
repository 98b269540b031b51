"""What ended a mission is said of missions worked by hand, one for each cause."""

from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

import dess
from dess import policies
from dess.analysis.results.event_log import (
    ages_of_nodes,
    causes_of_failure,
    mean_age,
    mission_length,
    residual_data,
    uav_slots,
)
from dess.model.view import View
from dess.scenario.scenario import Scenario
from tests import drawn
from tests.dess.model.flights import CHANNEL, flown


def assert_agree(record: Any, log: pd.DataFrame) -> None:
    slots = uav_slots(log)
    of_uav = slots.groupby("uav")
    assert of_uav["charging"].sum().tolist() == record.uavs["slots_charging"].tolist()
    assert of_uav["waiting"].sum().tolist() == record.uavs["slots_waiting"].tolist()
    flying = (~slots["charging"]).groupby(slots["uav"]).sum()
    assert flying.tolist() == record.uavs["slots_flying"].tolist()
    assert of_uav["battery"].last().tolist() == record.uavs["battery"].tolist()
    assert not (slots["charging"] & (slots["waiting"] | slots["moved"])).any()
    assert mission_length(log) == record.slots == slots["slot"].max() + 1
    assert_residual(log)


def assert_residual(log: pd.DataFrame) -> None:
    """The data of nodes end as the log has it, are never below 0, and 0 where nothing is left."""
    end = log[(log["event"] == "mission_end") & (log["node"] >= 0)]["value"].to_numpy()
    residual = residual_data(log)
    assert np.allclose(residual.iloc[-1], end, atol=1e-9, rtol=0)
    assert (residual >= 0).all(axis=None) and not residual.iloc[-1].to_numpy()[end == 0].any()


@given(drawn.spaces(), drawn.seeds)
def test_tables_agree_on_any_scenario(space, seed):
    record = dess.simulate(space, policies.load("random"), seed, events=True)
    assert_agree(record, pd.DataFrame(record.events.columns()))


class _Witness(drawn.Wanderer):
    """A policy that keeps the ages that it sees at the starts of slots."""

    def __init__(self) -> None:
        self.seen: dict[int, np.ndarray] = {}

    def act(self, view: View) -> np.ndarray:
        self.seen[int(view.constants["slot"][0])] = view.age[0].copy()
        return super().act(view)


@given(
    st.one_of(drawn.extended_spaces(age={"measured": True}), drawn.continuous_spaces()), drawn.seeds
)
def test_ages_of_a_log_are_those_of_the_record_and_those_that_policies_see(space, seed):
    witness = _Witness()
    record = dess.simulate(space, witness, seed, events=True)
    log = pd.DataFrame(record.events.columns())
    of_nodes, curve = ages_of_nodes(log), mean_age(log)
    for slot, seen in witness.seen.items():
        assert np.allclose(of_nodes.loc[slot], seen, rtol=0, atol=1e-9)
    time, age = curve["time"].to_numpy(), curve["age"].to_numpy()
    area = ((age[1:] + age[:-1]) / 2 * np.diff(time)).sum()
    assert area / mission_length(log) == pytest.approx(record.age, rel=1e-9)
    assert of_nodes.loc[mission_length(log)].mean() == pytest.approx(age[-1], abs=1e-9)
    assert_residual(log)


def test_the_node_of_a_slot_is_the_one_served_most_and_last():
    log = {
        "time": [0, 0, 0, 0.25, 0.5, 0.75, 1.0, 1, 1.25, 1.5, 1.75, 2.0, 2, 3],
        "event": ["mission_start"] * 2
        + ["move"]
        + ["communication"] * 4
        + ["move"]
        + ["communication"] * 4
        + ["move", "mission_end"],
        "uav": [0, -1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
        "node": [-1, 0, -1, 2, 2, 2, 1, -1, 1, 2, 2, 1, -1, -1],
        "value": [9, 5, 8, 1, 1, 1, 1, 7, 1, 1, 1, 1, 6, 6],
        "x": [0] * 14,
        "y": [0] * 14,
    }
    assert uav_slots(log)["node"].tolist() == [2, 1, -1]


# A zone of two cells at the western edge, with a pad. UAVs may charge from a battery of 12 on. Each
# slot is a communication slot, and there are data for all.
FIELDS: dict[str, Any] = CHANNEL | {
    **{"grid": 8, "zone": [0, 0, 1, 2], "pads": 1, "nodes": [[7, 7]], "initial_data": 1000.0},
    **{"flying_time": 14, "charge_start": 12, "charge_complete": 100, "charge_rate": 1},
    "quota": 100,
}
BOTH = [(0, 0), (0, 1)]


class Case(NamedTuple):
    """What UAVs do, where they start, which fields differ, and what is said."""

    routes: tuple[str, ...]
    starts: list[tuple[int, int]]
    fields: dict[str, Any]
    said: list[str]


ENDS = {
    "the quota is filled": Case(("",), [(0, 0)], {"quota": 3}, []),
    # Back home with 11, it charges in slots 2 to 10, up to 20. A move to the east costs 2: after 17
    # slots it is 6 cells away with 8, then 7 with 6. The wind has cost 1 % for each of 7 moves;
    # what it cost before the charge does not count.
    "it goes too far against the wind": Case(
        ("EW" + 9 * "." + "EEEEEEE",),
        [(0, 0)],
        {"wind": {"strength": 1.0, "direction": 90}, "charge_complete": 20, "charge_start": 11},
        [
            "UAV 1 ran empty after 24 slots at (7, 0), 7 cells from the nearest zone, with 85 of "
            "100 communication slots to go; its battery last covered the way to a zone after 17 "
            "slots, with 8 % for 6 cells; the wind cost 7 %"
        ],
    ),
    # Both ask in slot 2, and UAV 1 charges for 88 slots.
    "it waits for a pad": Case(
        ("", ""),
        BOTH,
        {"quota": 20},
        [
            "UAV 2 ran empty after 14 slots at (0, 1), in a zone, with 6 of 20 communication slots "
            "to go; it waited 12 slots for a pad of the zone at (0, 0), which has 1, while UAV 1 "
            "charged there"
        ],
    ),
    # UAV 1 wants to go home through the cell where UAV 2 charges, from slot 4 on.
    "a teammate is in its way": Case(
        ("EESW" + 10 * "W", ""),
        BOTH,
        {"fleet": [{}, {"quota": 13}], "charge_start": 10},
        [
            "UAV 1 ran empty after 14 slots at (1, 1), 1 cell from the nearest zone, with 86 of "
            "100 communication slots to go; its battery last covered the way to a zone after 12 "
            "slots, with 2 % for 1 cell; it was overruled 10 times, by UAV 2"
        ],
    ),
    "a failure": Case(
        ("EEE",),
        [(0, 0)],
        {"failures": {"uav_rate": 0.1}},
        [
            "UAV 1 was lost to a failure after 5 slots at (3, 0), with 95 of 100 communication "
            "slots to go"
        ],
    ),
}


@pytest.mark.parametrize("case", ENDS.values(), ids=ENDS)
def test_what_ended_a_mission_is_said(case):
    scenario = Scenario.of(**FIELDS | {"uavs": len(case.routes)} | case.fields)
    record, log = flown(scenario, *case.routes, starts=case.starts)
    assert causes_of_failure(log, scenario) == case.said
