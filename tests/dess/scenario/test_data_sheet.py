"""The data sheet: what follows from it, recomputed by hand, and what is refused."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from dess import InputError, load_scenario, policies, simulate
from dess.model.channel import world_of
from dess.model.state import constants_of
from dess.scenario.data_sheet import lora
from dess.scenario.quantities import printed
from dess.scenario.rotary_wing import airspeed_along, largest_speed
from dess.scenario.scenario import ScenarioSpace
from tests.drawn import Script
from tests.verification import closed_forms

CALM = {"wind": None, "max_speed": None}
SHEET = {
    **{"endurance": "35 min", "cruise": "15 m/s", "charging": "40 min", "data_rate": "3 MB/h"},
    **{"bandwidth": "125 kHz", "snr": "12 dB at 2 km", "wind": "8 m/s from SW"},
    **{"max_speed": "23 m/s"},
}


def _space(sheet: dict[str, Any] | None = None, **values: Any) -> ScenarioSpace:
    merged = {name: of for name, of in (SHEET | (sheet or {})).items() if of is not None}
    return ScenarioSpace.of(data_sheet=merged, **values)


def test_the_list_of_an_engineer_is_recomputed_by_hand():
    failing = {"mtbf": "30 d", "pad_mtbf": "90 d", "pad_repair": "1 d"}
    space = _space({"range": "2 km", "horizon": "8 h", "max_rate": "6 bit/s/Hz", **failing})
    slot = 35 * 60 / 100
    assert (space.units.slot, space.units.cell, space.units.data) == (21, 15 * 21, 125e3 * 21)
    assert str(space.units) == "a slot is 21 s, a cell 315 m, a data unit 328.1 kB"
    assert space.cell_size == 315 and space.max_slots == math.floor(8 * 3600 / slot) == 1371
    assert space.charge_rate == pytest.approx(100 * slot / (40 * 60)) == 0.875
    assert space.arrival_rate == pytest.approx(3e6 * 8 / 3600 / 125e3)
    assert space.failures.uav_rate == pytest.approx(slot / (30 * 86400))
    assert space.failures.pad_rate == pytest.approx(slot / (90 * 86400))
    assert space.failures.pad_repair == pytest.approx(86400 / slot)
    # The rate at 2 km [data units per slot] is that of an SNR of 12 dB.
    rate = float(closed_forms.rate_at_snr(space, closed_forms.mean_snr(space, 2000.0)))
    assert 4 * rate == pytest.approx(math.log2(1 + 10**1.2))
    # A wind of 8 m/s from the south-west: south and west are against it, at 45 degrees.
    along = 8 / math.sqrt(2)
    with_it, against = math.hypot(15 - along, along), math.hypot(15 + along, along)
    shares = [_zeng(airspeed) / _zeng(15) for airspeed in (with_it, with_it, against, against, 8)]
    assert space.consumption.slots[0] == tuple(math.ceil(1000 * share) for share in shares)
    assert space.landing and space.quota == 0
    assert space.flying_time == space.charge_complete == (100, 100)


def test_pads_of_all_zones_or_of_each_fail():
    zones = [{"cells": [0, 0, 1, 1]}]
    by_zone = {"pad_mtbf": ["90 d", "7 d"], "pad_repair": ["1 d", "42 s"]}
    failures = _space(by_zone, zones=zones).failures
    assert failures.pad_rates == pytest.approx((21 / (90 * 86400), 21 / (7 * 86400)))
    assert failures.pad_repairs == pytest.approx((86400 / 21, 2))
    mixed = _space({"pad_mtbf": ["90 d", "7 d"], "pad_repair": "42 s"}, zones=zones)
    assert mixed.failures.pad_repair == 2 and not mixed.failures.pad_repairs
    assert ScenarioSpace.of(mixed) == mixed
    equal = ScenarioSpace.of(mixed, **{"data_sheet.pad_mtbf": "7 d"})
    assert equal.failures.pad_rate == pytest.approx(21 / (7 * 86400))
    assert not equal.failures.pad_rates
    # Without the second zone, the pads of the first one fail as before.
    alone = ScenarioSpace.of(mixed, **{"zones.pads": 0})
    assert alone == _space({"pad_mtbf": ["90 d"], "pad_repair": "42 s"})


def test_a_link_budget_gives_the_snr_of_friis_equation():
    budget = {"snr": None, "tx_power": "100 mW", "noise_figure": "6 dB", "frequency": "868 MHz"}
    space = _space(budget | {"free_space": "100 m"})
    wavelength = 299_792_458 / 868e6
    loss = 20 * math.log10(4 * math.pi * 100 / wavelength)
    noise = 10 * math.log10(1.380649e-23 * 290 * 125e3 * 1000) + 6
    assert space.edge_snr == pytest.approx(20 - loss - noise)
    assert space.radio.anchor == 100
    assert float(closed_forms.mean_snr(space, 1000.0)) == pytest.approx(space.edge_snr - 22.7)


ABOVE_NODE = {"nodes": [[5, 0]], "zone": [4, 0, 1, 1], "uavs": 1, "shadowing_variance": 0}


def _bits_per_second(snr: float, **sheet: Any) -> float:
    """What a UAV collects that hovers 10 m above a node, where the SNR has this value [dB]."""
    above = {"snr": f"{snr} dB at 10 m", "backlog": "90 GB", "data_rate": "0 B/h", "wind": None}
    space = _space({**above, "horizon": "3 min", **sheet}, **ABOVE_NODE)
    events = simulate(space, Script("E" + 99 * "."), 1, events=True).events
    assert events is not None
    served = [e.value for e in events if e.event == "communication" and 2 < e.time <= 3]
    return sum(served) * space.units.data / space.units.slot


@pytest.mark.parametrize(
    ("snr", "rate"),
    [
        (30, 5468.75),  # 7 * 125,000 / 2^7 * 4/5
        (-7.5, 5468.75),
        (-7.501, 3125),  # 8 * 125,000 / 2^8 * 4/5
        (-15, 976.5625),  # 10 * 125,000 / 2^10 * 4/5
        (-17.5, 439.453125),  # symbols of 16.4 ms: (11 - 2) * 125,000 / 2^11 * 4/5
        (-20, 244.140625),  # (12 - 2) * 125,000 / 2^12 * 4/5
        (-20.001, 0),
    ],
)
def test_lora_has_the_rates_of_its_spreading_factors(snr, rate):
    assert _bits_per_second(snr, modulation="lora") == pytest.approx(rate)


def test_symbols_of_lora_lose_two_bits_from_16_ms_on():
    """At 250 kHz those of spreading factor 12 alone; at 128 kHz that of 11 takes 16 ms exactly."""
    for bandwidth, factor_12, factor_11 in (
        (250_000, 10 * 250e3 / 4096 * 0.8, 11 * 250e3 / 2048 * 0.8),
        (128_000, 10 * 128e3 / 4096 * 0.8, 9 * 128e3 / 2048 * 0.8),
        (500_000, 12 * 500e3 / 4096 * 0.8, 11 * 500e3 / 2048 * 0.8),
    ):
        space = _space({"modulation": "lora", "bandwidth": f"{bandwidth} Hz"})
        rates = [efficiency * bandwidth for _, efficiency in space.radio.steps]
        assert rates[:2] == pytest.approx([factor_12, factor_11])


def test_packets_of_lora_take_the_time_on_air_of_the_chip():
    """The times of Semtech's calculator at 125 kHz, 4/5, 8 symbols of preamble [ms]."""
    for packet, factor_12, factor_7 in (("51 B", 2465.79, 102.66), ("13 B", 1155.07, 46.34)):
        space = _space({"modulation": "lora", "packet": packet})
        bits = 8 * float(packet.split()[0])
        slowest, *_, fastest = (efficiency * 125e3 for _, efficiency in space.radio.steps)
        assert 1000 * bits / slowest == pytest.approx(factor_12, abs=0.01)
        assert 1000 * bits / fastest == pytest.approx(factor_7, abs=0.01)
    # 222 bytes and a header of 13 take 368.9 ms with factor 7; 51 and 13 take 2,793.47 with 12.
    assert lora.lorawan_overhead(7, 125e3) == pytest.approx(5468.75 * 0.368896 / (8 * 222))
    assert lora.lorawan_overhead(12, 125e3) == pytest.approx(244.140625 * 2.793472 / (8 * 51))


def test_a_node_is_served_at_the_highest_step_that_its_snr_reaches():
    rates = [["-2.5 dB", "5.5 kbit/s"], ["3 dB", "1 Mbit/s"]]
    collected = [_bits_per_second(snr, rates=rates) for snr in (-2.6, -2.5, 2.9, 3.0, 90)]
    assert collected == pytest.approx([0, 5500, 5500, 1e6, 1e6])


def test_rates_are_multiplied_by_the_duty_cycle():
    assert _bits_per_second(0, modulation="lora", duty_cycle="1 %") == pytest.approx(54.6875)
    assert _bits_per_second(0, duty_cycle="25 %") == pytest.approx(125e3 * 1 / 4)
    assert _bits_per_second(90) == pytest.approx(6 * 125e3), "6 bit/s/Hz at most"


def test_the_altitude_counts_in_every_distance():
    """12 dB at 2 km: 120 m above a node the SNR is that of 120 m, also in the table of rates."""
    space = _space({"altitude": "120 m", "range": "400 m"})
    mean = world_of(space).mean_snr
    assert mean[0, 0] == pytest.approx(12 + 22.7 * math.log10(2000 / 120))
    assert mean[0, 4] == pytest.approx(12 + 22.7 * math.log10(2000 / math.hypot(315, 120)))
    assert mean[1, 4] == -math.inf, "a cell to the east and one to the south it is 461 m"
    assert _space().altitude == 10


def _arrivals(space: ScenarioSpace) -> list[tuple[float, float]]:
    """The times and sizes [data units] of new data."""
    events = simulate(space, Script(""), 1, events=True).events
    assert events is not None
    return [(e.time, e.value) for e in events if e.event == "arrival"]


ONE_NODE = {"nodes": [[0, 0]], "zone": [9, 9, 1, 1], "uavs": 1}


def test_new_data_come_in_messages():
    space = _space({"data_rate": "20 kB/h", "wind": None}, **ONE_NODE)
    message = 8000 / (125e3 * 21)  # 1 kB, in data units
    counts = [value / message for _, value in _arrivals(space)]
    assert counts == pytest.approx(np.round(counts)) and max(counts) <= 3
    assert sum(counts) == pytest.approx(20 * 500 * 21 / 3600, abs=25)  # 58 of them, within 3.3 s
    large = ScenarioSpace.of(space, **{"data_sheet.message": "10 kB"})
    assert sum(value for _, value in _arrivals(large)) / message % 10 == pytest.approx(0)


def test_of_more_than_50_messages_a_slot_a_node_has_exactly_its_rate_from_the_first_slot():
    space = _space({"data_rate": "3 MB/h", "message": "340 B", "wind": None}, **ONE_NODE)
    rate = 3e6 * 8 * 21 / 3600 / (125e3 * 21)
    assert space.message_rates[0] == pytest.approx(51.47, abs=0.01)
    assert _arrivals(space) == [(t + 1, pytest.approx(rate)) for t in range(500)]
    fewer = ScenarioSpace.of(space, **{"data_sheet.message": "351 B"})  # 49.86 messages
    assert len({value for _, value in _arrivals(fewer)}) > 20


def test_in_continuous_time_each_message_is_a_packet():
    values = {"data_rate": "20 kB/h", "wind": None}
    space = _space(values, **ONE_NODE, arrivals={"process": "continuous"})
    arrivals = _arrivals(space)
    assert [*{value for _, value in arrivals}] == pytest.approx([8000 / (125e3 * 21)])
    assert 40 < len(arrivals) < 80 and any(time % 1 for time, _ in arrivals)
    with pytest.raises(InputError, match="messages in a slot, each a packet; allowed: 50 at most"):
        _space({"message": "100 B"}, **ONE_NODE, arrivals={"process": "continuous"})


def test_the_data_of_a_slow_node_are_not_old():
    """One buoy a cell from the base: in packets of a data unit its data were 9.3 h old."""
    sheet = {"data_rate": "20 kB/h", "wind": None, "horizon": "24 h"}
    sea = {"nodes": [[2, 0]], "zone": [0, 0, 2, 1], "uavs": 1, "age": {"measured": True}}
    space = _space(sheet, **sea)
    record = simulate(space, policies.load("greedy"), 1)
    assert record.operations["age"] * space.units.slot / 3600 < 0.5


def test_the_snr_is_that_of_the_distance_and_not_of_the_grid():
    """A larger exponent lowers the SNR beyond its distance, and raises it nearer."""
    small, large = (_space({"range": "3 km"}, grid=grid) for grid in (32, 60))
    assert np.array_equal(world_of(small).mean_snr[:8, :8], world_of(large).mean_snr[:8, :8])
    steep = world_of(ScenarioSpace.of(small, path_loss_exponent=3.5)).mean_snr
    plain = world_of(small).mean_snr
    far, near = 8, 3  # 2.5 km and 945 m
    assert steep[0, 4 * far] < plain[0, 4 * far] and steep[0, 4 * near] > plain[0, 4 * near]
    assert plain[0, 4 * 10] == -math.inf  # 3.15 km


def test_a_charge_adds_whole_percents_that_add_up_to_its_rate():
    values = {"uavs": 1, "flying_time": 20, "charge_complete": 90, "charge_rate": 0.875}
    space = ScenarioSpace.of(**values, charge_start=30, zone=[0, 0, 2, 2], landing=True, quota=9)
    events = simulate(space, Script("." * 200), 1, events=True).events
    assert events is not None
    battery = [e.battery for e in events if e.event == "move"]
    assert battery[:81] == [20 + min(math.floor(0.875 * k), 70) for k in range(1, 82)]


def test_out_of_range_no_node_is_served_and_no_slot_counts():
    values = {"nodes": [[5, 0]], "uavs": 1, "zone": [0, 0, 1, 1], "initial_data": 1e6}
    space = ScenarioSpace.of(**values, cell_size=100, radio={"range": 210.0, "max_rate": 0.5})
    record = simulate(space, Script("EEEE...."), 1, events=True)
    assert record.events is not None
    served = [e for e in record.events if e.event == "communication"]
    # From 0 to 4 cells; 209.5 m away at most is less than 2.1 cells from the node.
    assert min(e.x for e in served) == pytest.approx(3.0) and served[0].time == 3.0
    assert record.uavs["quota"].tolist() == [len(served)]
    assert max(e.value for e in served) <= 0.5 / 4 + 1e-12


def _zeng(airspeed: float, drag: float = 5.48e-5) -> float:
    """The power of the UAV in Zeng et al. (2019), eq. 12, in terms of that of hovering."""
    tip, induced = 120, 4.03
    inflow = math.sqrt(1 + airspeed**4 / (4 * induced**4)) - airspeed**2 / (2 * induced**2)
    profile = 0.474 * (1 + 3 * airspeed**2 / tip**2)
    return profile + 0.526 * math.sqrt(inflow) + drag * airspeed**3


def test_hovering_costs_more_than_cruising_and_a_headwind_twice_as_much():
    calm = _space({"wind": None})
    assert calm.consumption.slots[0] == (1000, 1000, 1000, 1000, 1217)  # 1 / p(15) = 1.2164
    windy = _space({"wind": "12 m/s from N", "max_speed": "30 m/s"})
    assert windy.consumption.slots[0][0] == 2072  # the airspeed is 27 m/s
    assert windy.consumption.slots[0][2] == math.ceil(1000 * _zeng(3) / _zeng(15))
    with pytest.raises(InputError, match=r"wind: '12 m/s from N' .*allowed: 8 m/s from there"):
        _space({"wind": "12 m/s from N"})


def test_the_cost_of_hovering_is_that_of_the_hovering_time():
    space = _space({"wind": None, "hover": "30 min"})
    assert space.consumption.slots[0][4] == math.ceil(1000 * 35 / 30)
    # Its drag is fitted, so that other airspeeds follow.
    drag = (30 / 35 - _zeng(15, 0.0)) / 15**3
    windy = _space({"wind": "5 m/s from N", "hover": "30 min"})
    share = _zeng(20, drag) / _zeng(15, drag)
    assert windy.consumption.slots[0][0] == math.ceil(1000 * share)
    with pytest.raises(InputError, match=r"hover: '10 min' is too short.* and more, or a smaller"):
        _space({"wind": None, "hover": "10 min"})


def test_an_endurance_at_another_speed_is_converted():
    space = _space({"wind": None, "endurance": "55 min at 8 m/s"})
    assert space.units.slot == pytest.approx(33 * _zeng(8) / _zeng(15))
    with_hover = _space({"wind": None, "endurance": "55 min at 8 m/s", "hover": "50 min"})
    drag = (50 / 55 - _zeng(8, 0.0)) / 8**3
    assert with_hover.units.slot == pytest.approx(33 * _zeng(8, drag) / _zeng(15, drag))
    # A full battery hovers for its hovering time.
    hovering = with_hover.units.slot * 100 / with_hover.consumption.slots[0][4] * 1000
    assert hovering == pytest.approx(50 * 60, rel=2e-3)


@given(st.floats(1, 40), st.floats(0, 40), st.floats(0, 360))
def test_all_moves_can_be_flown_in_the_strongest_wind_and_not_in_a_stronger_one(
    cruise, more, direction
):
    most = cruise + more
    wind = largest_speed(cruise, direction, most)
    courses = (0, 90, 180, 270)
    fastest = max(airspeed_along(course, cruise, wind, direction) for course in courses)
    assert fastest == pytest.approx(most)
    if wind > 0.01:
        assert largest_speed(wind, direction, most) == pytest.approx(cruise)


def test_a_battery_flies_for_its_endurance_and_hovers_for_its_hovering_time():
    """A hundred slots of cruising, and as much hovering as the sheet says, to a slot."""
    space = _space({"wind": None, "hover": "30 min"}, uavs=1, landing=False, quota=10**6)
    for route, slots in (("WE" * 300, 100), ("W" * 5 + "." * 300, 5 + 82)):
        record = simulate(space, Script(route), 1)
        assert record.uavs["slots_flying"][0] == slots


def test_a_scenario_with_a_sheet_is_stored_and_changed_by_its_sheet():
    space = _space({"reserve": "20 %", "backlog": "20 MB"}, uavs=2, landing=False, quota=50)
    assert ScenarioSpace.of(space) == space and "cell_size" not in space.model_dump()
    assert space.charge_complete == space.flying_time == (80, 80)
    assert space.initial_data[0] == pytest.approx(20e6 * 8 / (125e3 * 21))
    calm = ScenarioSpace.of(space, **{"data_sheet.wind": "0 m/s from N"})
    assert calm.consumption.slots[0][:4] == (1000,) * 4
    assert (calm.quota, calm.landing) == (50, False)
    assert not ScenarioSpace.of().units and "radio" not in ScenarioSpace.of().model_dump()


def _sea(folder: Path, rows: str, **sheet: Any) -> Path:
    """A scenario with a sheet that reads its nodes from a file."""
    (folder / "buoys.csv").write_text(rows)
    given = {name: of for name, of in (SHEET | sheet).items() if of is not None}
    text = tomli_w.dumps({"nodes": "buoys.csv", "data_sheet": given})
    (folder / "sea.toml").write_text(text)
    return folder / "sea.toml"


MEGABYTE_PER_HOUR = 8e6 / 3600 / 125e3  # in units of the bandwidth of SHEET


def test_nodes_of_a_file_have_their_own_rates_in_units(tmp_path):
    rows = "name,x,y,data_rate,backlog\na,1,1,3 MB/h,1 MB\nb,4,4,6 MB/h,0 MB\n"
    _sea(tmp_path, rows, data_rate=None)
    space = load_scenario(tmp_path / "sea.toml")
    assert (
        space.arrivals.rates[1]
        == pytest.approx(2 * space.arrivals.rates[0])
        == 6e6 * 8 / 3600 / 125e3
    )
    assert space.arrivals.initial == pytest.approx((8e6 / (125e3 * 21), 0))
    (tmp_path / "buoys.csv").write_text(rows.replace("3 MB/h", "3"))
    with pytest.raises(
        InputError, match="line 2: data_rate: '3' has no unit; allowed: a data rate"
    ):
        load_scenario(tmp_path / "sea.toml")


def test_a_field_of_a_node_wins_and_the_sheet_is_for_those_that_have_none(tmp_path):
    rows = "name;x;y;data_rate;backlog\na;1;1;3,5 MB/h;20 MB\nb;4;4;;\n"
    space = load_scenario(sea := _sea(tmp_path, rows, data_rate="2 MB/h"))
    assert space.arrivals.rates == pytest.approx((3.5 * MEGABYTE_PER_HOUR, 2 * MEGABYTE_PER_HOUR))
    assert space.arrivals.initial == pytest.approx((20 * 8e6 / (125e3 * 21), 0))
    # What is set for the scenario is for all nodes, also through a table of the section.
    for values in ({"data_sheet.data_rate": "1 MB/h"}, {"data_sheet": {"data_rate": "1 MB/h"}}):
        space = load_scenario(sea, **values)
        assert (space.arrivals.rates, space.arrival_rate) == ((), pytest.approx(MEGABYTE_PER_HOUR))
    with pytest.raises(InputError, match="line 3: data_rate: is empty; allowed: a data rate, such"):
        load_scenario(_sea(tmp_path, rows, data_rate=None))
    listed = _sea(tmp_path, rows, data_rate=["1 MB/h", "2 MB/h"])
    with pytest.raises(InputError, match="has the column data_rate, and the scenario lists"):
        load_scenario(listed)
    below = rows.replace("20 MB", "-1 MB")
    with pytest.raises(InputError, match="line 2: backlog: '-1 MB' is out of range; allowed: 0"):
        load_scenario(_sea(tmp_path, below, data_rate="2 MB/h"))
    both = "x,y,rate,data_rate\n1,1,1 MB/h,2 MB/h\n4,4,3 MB/h,4 MB/h\n"
    with pytest.raises(InputError, match="has the columns data_rate and rate for one field"):
        load_scenario(_sea(tmp_path, both))


def test_no_other_cell_size_is_advised_where_it_follows_from_the_sheet(tmp_path):
    near, far = "lon,lat\n8,54\n8.02,54.02\n8,54.0001\n", "lon,lat\n0,0\n0,0.2\n"
    for rows, line in ((near, "in one cell"), (far, "off the grid")):
        with pytest.raises(InputError, match=line) as error:
            load_scenario(_sea(tmp_path, rows))
        assert "cell_size" not in str(error.value).partition("; allowed: ")[2]


class Unreadable:
    """Like a quantity of pint with a single number, whose method for arrays fails."""

    def __repr__(self):
        return "<Quantity(35, 'minute')>"

    def tolist(self):
        raise AttributeError("Magnitude 'int' does not support tolist.")


@pytest.mark.parametrize("field", ["data_sheet.endurance", "data_sheet.data_rate", "cell_size"])
def test_a_quantity_of_another_library_is_refused_in_a_line(field):
    with pytest.raises(InputError, match=rf"{field}: <Quantity\(35, 'minute'\)> is .*; allowed: "):
        load_scenario("jade-bight" if "." in field else "paper", **{field: Unreadable()})


@pytest.mark.parametrize(
    ("sheet", "values", "message"),
    [
        ({"endurance": 35}, {}, 'endurance: 35 has no unit; allowed: a time, such as "35 min"'),
        ({"endurance": "35"}, {}, "'35' has no unit"),
        ({"endurance": "35 m"}, {}, "'35 m' has a unit of another kind"),
        ({"endurance": "35 minits"}, {}, "'35 minits' has an unknown unit"),
        ({"endurance": None}, {}, "endurance: is missing; allowed: flying time"),
        ({"data_rate": None}, {}, "data_sheet.data_rate: is missing; allowed: new data"),
        ({"data_rate": ["3 MB/h"] * 2}, {}, "arrivals.rates: there are 2; allowed: 25"),
        (
            {"wind": "14.5 m/s from SW"},
            {},
            "is too strong for 15 m/s over ground and 23 m/s in the air; "
            "allowed: 9.8 m/s from there at most, or a cruise of 10.33 m/s at most",
        ),
        ({"max_speed": None}, {}, "max_speed: is missing; allowed: largest speed through the air"),
        ({"max_speed": "14 m/s"}, {}, "max_speed: '14 m/s' is less than the cruise 15 m/s"),
        ({"endurance": "35 min at 8 km"}, {}, "'8 km' has a unit of another kind"),
        ({}, {"wind": {"gusts": 1.0}}, "wind: is given beside data_sheet; allowed: one of both"),
        ({"wind": "14 m/s"}, {}, "is not a speed and where it comes from"),
        ({"horizon": "60 d"}, {}, "is 246,857 slots of 21 s; allowed: 24.31 d at most"),
        ({"charging": "10 s"}, {}, "is less than a slot of 21 s; allowed: 21 s or more"),
        (
            {"range": "200 m"},
            {},
            "is less than a cell of 315 m, the way of a slot at 15 m/s; allowed: 315 m or more",
        ),
        ({"tx_power": "20 dBm"}, {}, "snr: follows from tx_power"),
        ({"repair": "2 h"}, {}, "mtbf: is missing"),
        ({"pad_repair": "2 h"}, {}, "pad_mtbf: is missing"),
        (
            {"pad_mtbf": ["90 d", "7 d"]},
            {},
            "data_sheet.pad_mtbf: there are 2; allowed: 1, one for each zone",
        ),
        ({"pad_mtbf": ["90 d", "7"]}, {}, "pad_mtbf: '7' has no unit"),
        ({"pad_mtbf": "90 d", "pad_repair": ["1 d", "2 s"]}, {}, "'2 s' is less than a slot of"),
        ({"reserve": "80 %"}, {}, "reserve: '80 %' is out of range; allowed: 0..60"),
        ({"reserve": "20 %"}, {"flying_time": 90}, "more than the reserve leaves; allowed: 80"),
        (
            {"snr": "12 dB at 0 m"},
            {},
            "snr: '12 dB at 0 m' is out of range; allowed: 0.01..1e+06 m",
        ),
        ({"snr": "12 dB at -2 km"}, {}, "is out of range; allowed: 0.01..1e+06 m"),
        ({"snr": "12 dB at 2000 km"}, {}, "is out of range; allowed: 0.01..1e+06 m"),
        ({"wind": "5 m/s from 400 deg"}, {}, "is out of range; allowed: -360..360 deg"),
        (
            {"rates": [["0 dB", "1 kbit/s"], ["-3 dB", "2 kbit/s"]]},
            {},
            "rates: ['-3 dB', '2 kbit/s'] comes after ['0 dB', '1 kbit/s']; allowed: pairs whose",
        ),
        ({"rates": [["0 dB", "1 kbit/s"], ["3 dB", "1 kbit/s"]]}, {}, "comes after"),
        ({"rates": [["0 dB", "1 kbit"]]}, {}, "'1 kbit' has a unit of another kind"),
        ({"rates": [["0 dB"]]}, {}, "rates: ['0 dB'] is no pair; allowed: a list of at most 32"),
        ({"rates": []}, {}, "rates: [] has no such pairs; allowed: a list of at most 32 pairs"),
        ({"rates": [["0 dB", 5]]}, {}, 'rates: 5 has no unit; allowed: a data rate, such as "3'),
        ({"rates": [["0 dB", "1 kbit/s"]], "modulation": "lora"}, {}, "is given beside rates"),
        ({"rates": [["0 dB", "1 kbit/s"]], "max_rate": "6 bit/s/Hz"}, {}, "beside rates"),
        ({"modulation": "lora", "max_rate": "6 bit/s/Hz"}, {}, "is given beside lora"),
        (
            {"packet": "51 B"},
            {},
            "packet: '51 B' is of lora; allowed: modulation = \"lora\", or no",
        ),
        ({"modulation": "lora", "packet": "12 bit"}, {}, "'12 bit' is no whole number of bytes"),
        ({"modulation": "fsk"}, {}, "modulation: 'fsk' is unknown"),
        (
            {"modulation": "lora", "bandwidth": "20 MHz"},
            {},
            "bandwidth: '20 MHz' is none of lora; allowed: 7.8 kHz..1.625 MHz",
        ),
        ({"altitude": "0.5 m"}, {}, "altitude: '0.5 m' is out of range; allowed: 1..500 m"),
        (
            {"altitude": "400 m", "range": "350 m"},
            {},
            "range: '350 m' ends above the sea, 400 m below; allowed: above 400 m",
        ),
        # What follows is refused in the words of the sheet.
        ({"cruise": "1000 km/s"} | CALM, {}, "endurance '35 min', cruise '1000 km/s', cell"),
        ({"data_rate": "3 TB/s"}, {}, "data_sheet: with data_rate '3 TB/s', bandwidth '125 kHz'"),
        ({"bandwidth": "1 Hz", "backlog": "90 TB"}, {}, "data_sheet: with backlog '90 TB', end"),
        ({}, {"cell_size": 315.0}, "cell_size: follows from the data sheet"),
        ({}, {"initial_data": 3.0}, "initial_data: follows from the data sheet"),
        ({}, {"arrivals": {"rates": [0.1] * 25}}, "arrivals.rates: follows from the data sheet"),
    ],
)
def test_what_a_sheet_cannot_be_is_refused(sheet, values, message):
    with pytest.raises(InputError) as raised:
        _space(sheet, **values)
    assert message in str(raised.value) and "\n" not in str(raised.value)


def test_amounts_are_printed_in_the_unit_that_suits_them():
    assert [printed(n, "s") for n in (0.5, 21, 2100, 28800)] == ["0.5 s", "21 s", "35 min", "8 h"]
    assert [printed(n, "m") for n in (315, 2000)] == ["315 m", "2 km"]


def test_the_bay_with_a_sheet_has_its_constants():
    bay = load_scenario("jade-bight")
    mission = constants_of(bay)[0]
    assert (mission["charge_rate"], mission["charge_slots"]) == (7, 8)
    assert mission["max_rate"] == 0 and mission["range"] == 2000
    assert len(bay.nodes) == 23 and len(bay.rectangles) == 2 and bay.names[0] == "Jade 1"
