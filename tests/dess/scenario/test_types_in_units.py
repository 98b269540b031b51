"""Types of UAVs in units beside a data sheet: recomputed by hand, and what is refused."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import dess
from dess import InputError, ScenarioSpace, policies, simulate_batch
from dess.analysis.sheet import sheet_facts, sheet_lines
from dess.envs.observations.components import component_names
from dess.model.reach import reach_of_nodes
from dess.model.state import BATTERY, types_of
from tests.dess.model.flights import batteries, flown

SHEET = {
    **{"endurance": "40 min", "cruise": "15 m/s", "charging": "55 min", "data_rate": "3 MB/h"},
    **{"bandwidth": "125 kHz", "snr": "12 dB at 2 km", "range": "2 km", "horizon": "2 h"},
}
SEA: dict[str, Any] = {"grid": 16, "nodes": [[9, 9]], "zone": [7, 7, 1, 1], "uavs": 1}
WIND = {"wind": "5 m/s from N", "max_speed": "23 m/s"}
THERE_AND_BACK = "NNNNN" + "SSSSS"


def _space(*types: dict[str, Any], sheet: dict[str, str] | None = None, **values: Any):
    fields = SEA | {"fleet": types, "data_sheet": SHEET | (sheet or {})}
    return ScenarioSpace.of(**fields | values)


def _power(airspeed: float) -> float:
    """The power of the UAV in Zeng et al. (2019), eq. 12, in terms of that of hovering."""
    inflow = math.sqrt(1 + airspeed**4 / (4 * 4.03**4)) - airspeed**2 / (2 * 4.03**2)
    profile = 0.474 * (1 + 3 * airspeed**2 / 120**2)
    return profile + 0.526 * math.sqrt(inflow) + 5.48e-5 * airspeed**3


@pytest.mark.parametrize(
    ("kind", "reserve", "full", "rate"),
    [
        ({"endurance": "20 min"}, "0 %", 50, Fraction(40, 55)),  # by the charger of the sheet
        ({"endurance": "20 min", "charging": "25 min"}, "10 %", 45, Fraction(20, 25)),
        ({"endurance": "33 min", "charging": "70 min"}, "0 %", 82, Fraction(33, 70)),
        ({"endurance": "25 min", "charging": "30 min"}, "15 %", 53, Fraction(25, 30)),
        ({"charging": "70 min"}, "0 %", 100, Fraction(40, 70)),
    ],
)
def test_a_type_starts_with_its_battery_and_charges_to_it(kind, reserve, full, rate):
    """20 of 40 min are 50 %, of which a charging slot of 24 s adds 24 s of the charging time."""
    space = _space(kind, sheet={"reserve": reserve})
    _, log = flown(space, THERE_AND_BACK + "." * 40)
    levels = batteries(log)
    assert levels[:10] == [full - n for n in range(1, 11)]
    charge = [full - 10 + min(math.floor(k * rate), 10) for k in range(1, 41)]
    assert levels[10:50] == charge and charge[-1] == full


def test_a_lower_limit_of_the_scenario_holds_for_all_types():
    """Also one that is drawn: a type begins and ends a charge where its battery is full at most."""
    space = _space({"endurance": "32 min"}, flying_time=60, charge_complete=55)
    _, log = flown(space, THERE_AND_BACK + "." * 40)
    levels = batteries(log)
    assert levels[:10] == [60 - n for n in range(1, 11)] and levels[49] == 55


def test_a_slow_type_pays_for_its_own_speed():
    """At 7.5 m/s a cell takes two slots, and each costs p(a) / p(7.5); at 15 m/s p(a) / p(15)."""
    four_slots = WIND | {"horizon": "96 s"}
    space = _space({"cruise": "7.5 m/s"}, {}, sheet=four_slots, zone=[7, 7, 2, 1], uavs=2)
    _, log = flown(space, "NNNN", "NNNN", starts=[(7, 7), (8, 7)])
    left = log["value"][log["event"] == "remainder"]
    spent = [1000 * (100 - battery) + rest for battery, rest in zip(_last(log), left, strict=True)]
    slow = math.ceil(1000 * _power(12.5) / _power(7.5))
    fast = math.ceil(1000 * _power(20) / _power(15))
    assert spent == [4 * slow, 4 * fast] and slow < fast
    cells = [log["y"][(log["event"] == "move") & (log["uav"] == uav)][-1] for uav in range(2)]
    assert cells == [5, 3]


def _last(log: Any) -> list[int]:
    """The battery of each of two UAVs at the end."""
    return [int(log["battery"][log["uav"] == uav][-1]) for uav in range(2)]


@pytest.mark.parametrize(
    ("endurance", "cruise", "full"),
    [
        ("20 min at 10 m/s", "15 m/s", int(50 * _power(10) / _power(15))),
        ("20 min at 10 m/s", "7.5 m/s", int(50 * _power(10) / _power(7.5))),
        ("40 min at 15 m/s", "15 m/s", 100),
    ],
)
def test_an_endurance_at_another_speed_is_converted_to_the_speed_of_the_type(
    endurance, cruise, full
):
    space = _space({"endurance": endurance, "cruise": cruise})
    assert space.battery_of_type(space.fleet[0]) == full


@pytest.mark.parametrize(("cruise", "slots"), [("15 m/s", 1), ("27 km/h", 2), ("2.143 m/s", 7)])
def test_a_speed_may_be_rounded(cruise, slots):
    assert _space({"cruise": cruise}).fleet[0].slots_per_cell == slots


def test_a_scenario_is_stored_and_changed_by_the_units_of_its_types():
    space = _space({"endurance": "20 min", "cruise": "5 m/s"}, {"rate": 2.0})
    assert ScenarioSpace.of(space) == space
    in_units, other = space.model_dump(mode="json", exclude_none=True)["fleet"]
    assert in_units == {"endurance": "20 min", "cruise": "5 m/s", "rate": 1.0}
    assert other == {"slots_per_cell": 1, "rate": 2.0}
    longer = ScenarioSpace.of(space, **{"data_sheet.endurance": "50 min"})
    assert types_of(longer, 2)["charge_complete"].tolist() == [40, 0]
    # What needs no sheet is stored as before.
    plain = ScenarioSpace.of(fleet=[{"rate": 2.0}]).model_dump()["fleet"]
    assert plain == ({"flying_time": None, "slots_per_cell": 1, "quota": None, "rate": 2.0},)


def test_what_follows_for_each_type_is_told():
    space = _space({"endurance": "20 min", "charging": "25 min", "cruise": "7.5 m/s"}, sheet=WIND)
    [facts] = sheet_facts(space)["types"]
    assert facts["battery"] == 50 and facts["charge_rate"] == 0.8 and facts["slots_per_cell"] == 2
    north = math.ceil(1000 * _power(12.5) / _power(7.5)) / 1000
    assert facts["battery_per_slot"]["north"] == north
    line = next(line for line in sheet_lines(space) if line.startswith("type 1"))
    assert "50 % of a full battery" in line and "adds 0.8 %" in line and "2 slots" in line


def test_the_reach_is_that_of_the_type():
    """21 cells there and back, 20 if the node is served for a slot, of a battery of 42 %."""
    sea = {"grid": 64, "rows": 2, "zone": [0, 0, 1, 1], "nodes": [[40, 0]]}
    space = _space({"endurance": "16.8 min"}, **sea)
    assert reach_of_nodes(space).cells == (42_000 - 1217 - 1) // 2000
    assert reach_of_nodes(space).lost == (0,)
    assert not reach_of_nodes(_space({}, {"endurance": "16.8 min"}, uavs=1, **sea)).lost


def test_an_observation_has_the_limit_of_the_type():
    space = _space({"endurance": "20 min"}, {}, zone=[7, 7, 2, 1], uavs=2)
    env = dess.parallel_env(space, observation="state")
    observations, _ = env.reset()
    complete = component_names(space).index("charge_complete")
    limits = [observations[agent]["observation"][complete] for agent in env.agents]
    assert limits == pytest.approx([0.5, 1.0])


def test_a_uav_that_may_not_leave_its_zone_stays_and_others_fly_around_it():
    """Its full battery of 28 % is below the margins that the guard keeps for three teammates."""
    slow = {"endurance": "8 min", "charging": "134 min", "cruise": "3.75 m/s"}
    sheet = {"endurance": "15 min", "reserve": "25 %", "horizon": "81 min"}
    sea = {"grid": 27, "rows": 23, "zone": [17, 5, 2, 2], "nodes": [[18, 9], [3, 3]]}
    space = _space(slow, sheet=sheet, **sea, pads=2, uavs=4, charge_start=10)
    records = simulate_batch(space, policies.load("greedy"), 3, 20)
    assert not np.any(records.uavs["end"] == BATTERY)


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (
            {"endurance": "50 min"},
            "fleet.1.endurance: '50 min' is longer than that of the data sheet; "
            "allowed: 40 min at most",
        ),
        (
            {"cruise": "16 m/s"},
            "fleet.1.cruise: '16 m/s' is faster than that of the data sheet; "
            "allowed: 15 m/s at most",
        ),
        (
            {"cruise": "6 m/s"},
            "fleet.1.cruise: '6 m/s' does not go into 15 m/s a whole number of times; "
            "allowed: 7.5 m/s or 5 m/s",
        ),
        ({"cruise": "1 m/s"}, "less than an eighth of 15 m/s; allowed: 1.875 m/s or more"),
        ({"endurance": 20}, 'fleet.1.endurance: 20 has no unit; allowed: a time, such as "35 min"'),
        ({"endurance": ["20 min"]}, "fleet.1.endurance: ('20 min',) is not text in quotes"),
        ({"charging": "20 m"}, "fleet.1.charging: '20 m' has a unit of another kind"),
        ({"charging": "9 s"}, "'9 s' is less than a slot of 24 s; allowed: 24 s or more"),
        ({"charging": "90 h"}, "'90 h' is 13,500 slots of 24 s; allowed: 2.778 d at most"),
        ({"endurance": "9 min", "flying_time": 9}, "flying_time: is given beside endurance"),
        (
            {"flying_time": 95},
            "fleet.1.flying_time: 95 is more than the reserve leaves; allowed: 90",
        ),
        ({"cruise": "5 m/s", "slots_per_cell": 3}, "slots_per_cell: is given beside cruise"),
        (
            {"endurance": "12 min"},
            "fleet.1.endurance: '12 min' is 27 % of a battery, less the reserve; "
            "allowed: more than charge_start, 30 %",
        ),
    ],
)
def test_what_a_type_cannot_be_is_refused(kind, message):
    with pytest.raises(InputError) as raised:
        _space({}, kind, sheet={"reserve": "10 %"})
    assert message in str(raised.value) and "\n" not in str(raised.value)


def test_units_need_a_data_sheet():
    with pytest.raises(InputError, match=r"fleet\.0\.cruise: needs a data sheet; allowed: a data"):
        ScenarioSpace.of(fleet=[{"cruise": "5 m/s"}])
