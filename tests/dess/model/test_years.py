"""Years at sea: what a campaign carries from window to window, and what its record says."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dess import InputError, simulate, simulate_batch
from dess.model import mission
from dess.model.campaign import HOUR, MOST_HOURS, Campaign, plan_of, repair_in_gap, years_of
from dess.model.channel import world_of
from dess.model.record import AGES_OF_MONTHS, MissionRecord
from dess.model.state import BATTERY
from dess.model.view import View, decide, flight_of
from dess.model.years import WindowStart, Years, _advance, start_of_window
from dess.policies import load
from dess.scenario.rotary_wing import COURSES, RotaryWing, airspeed_along
from dess.scenario.scenario import ScenarioSpace, load_scenario
from dess.scenario.weather.hours import hours_of
from tests.dess.model.auditor import audit
from tests.dess.model.test_auditor import check_nodes, constants_of

SHEET = {
    **{"endurance": "35 min", "cruise": "15 m/s", "charging": "40 min", "data_rate": "3 MB/h"},
    **{"bandwidth": "20 MHz", "snr": "12 dB at 2 km", "max_speed": "23 m/s"},
}
SEA: dict[str, Any] = {
    **{"grid": 16, "zone": [7, 7, 2, 2], "pads": 1, "uavs": 1},
    "nodes": [[2, 3], [12, 4], [8, 14], [4, 10], [13, 13]],
}
GREEDY = load("greedy")


@pytest.fixture
def write(tmp_path):
    """A function that writes the weather of 2021 as CSV: one wind, missing in closed hours."""

    def write(is_open: Any, wind: float = 6.0, origin: float = 225.0) -> Path:
        hours = np.datetime64("2021-01-01T00") + np.arange(8760).astype("timedelta64[h]")
        rows = [f"{hour}:00,{wind if is_open(h) else ''},{origin}" for h, hour in enumerate(hours)]
        path = tmp_path / f"weather-{len([*tmp_path.iterdir()])}.csv"
        path.write_text("\n".join(["time,wind,from", *rows]))
        return path

    return write


def sea(path: Path, sheet: dict[str, Any] | None = None, **values: Any) -> ScenarioSpace:
    """A small sea whose weather is in a file."""
    weather = {"file": str(path), **values.pop("weather", {})}
    values = SEA | values
    return ScenarioSpace.of(data_sheet=SHEET | (sheet or {}), weather=weather, **values)


def first_days(count: int, begin: int = 0, until: int = 24) -> Any:
    """Whether an hour is one of some hours of the first days."""
    return lambda hour: hour < 24 * count and begin <= hour % 24 < until


def windows_flown(space: ScenarioSpace, monkeypatch: Any) -> list[tuple[Campaign, Any, Any]]:
    """Each window of the first year: what it starts from, and its record."""
    flown: list[Any] = []
    begin, end = Campaign.begin_window, Campaign.end_window

    def watch_begin(self: Campaign, starts: Any, b: int) -> int:
        number = begin(self, starts, b)
        if number >= 0:
            state = {name: getattr(starts, name)[b].copy() for name in starts._fields}
            flown.append([self.plan.windows[self.next], state, None])
        return number

    def watch_end(self: Campaign, record: MissionRecord, state: Any, b: int) -> None:
        flown[-1][-1] = record.nodes.copy()
        end(self, record, state, b)

    monkeypatch.setattr(Campaign, "begin_window", watch_begin)
    monkeypatch.setattr(Campaign, "end_window", watch_end)
    simulate_batch(space, GREEDY, 0, 1)
    return flown


def assert_same(record: MissionRecord, other: MissionRecord) -> None:
    assert record.metrics == other.metrics
    for name in ("uavs", "nodes"):
        np.testing.assert_array_equal(getattr(record, name), getattr(other, name))


def test_the_first_window_of_a_constant_series_is_a_mission_of_its_sheet(write):
    weather = {"operating": "08:00-16:00", "longest": "8 h", "longitude": 0}
    space = sea(write(first_days(3)), weather=weather, uavs=2)
    start = start_of_window(space, [GREEDY], 7, "2021-01-01T08")
    assert start.replication == MOST_HOURS * 0 + 8
    window = simulate(space, GREEDY, 7, window="2021-01-01T08")
    of_sheet = {"wind": "6 m/s from 225 deg", "idle": "8 h", "horizon": "8 h"}
    today = ScenarioSpace.of(data_sheet=SHEET | of_sheet, **SEA | {"uavs": 2})
    assert_same(window, simulate(today, GREEDY, 7, start.replication))
    assert window.collected > 0


class Slotwise:
    """A policy of Python, which is asked in every slot."""

    name = "slotwise"

    def act(self, view: View) -> np.ndarray:
        return GREEDY.act(view)


def test_a_year_flown_in_compiled_code_is_that_of_policies_asked_slot_by_slot(write):
    space = sea(write(first_days(4)), uavs=3, weather={"operating": "always"})
    tour = load("tour")
    for compiled, asked in (([GREEDY], [Slotwise()]), ([GREEDY, tour], [Slotwise(), tour])):
        assert flight_of(compiled) and not flight_of(asked)
        year, other = (simulate_batch(space, team, 3, 1) for team in (compiled, asked))
        assert year.missions["collected"] > 0
        assert_same(year.mission(0), other.mission(0))


def test_where_no_hour_is_open_nothing_flies(write):
    records = simulate_batch(sea(write(lambda _: False)), GREEDY, 0, 1)
    (record,), (measured,) = records.missions, records.operations
    slots = 8760 * 3600 / 21
    assert record["collected"] == record["slots"] == measured["windows"] == measured["open"] == 0
    assert measured["longest_gap"] == 8760
    np.testing.assert_allclose(measured["age"], slots / 2, rtol=1e-12)
    np.testing.assert_allclose(records.nodes["age"], slots / 2, rtol=1e-12)
    # Data are late once they are older than a day, and none of them is on land.
    assert math.isclose(measured["late"], 1 - 24 / 8760, rel_tol=1e-12)
    months = [measured[name] * 21 / 3600 for name in AGES_OF_MONTHS]
    assert math.isclose(months[0], 31 * 12, rel_tol=1e-12)
    assert math.isclose(months[11], 8760 - 31 * 12, rel_tol=1e-12)


@pytest.mark.parametrize(("opened", "closed"), [(12, 12), (8, 16)])
def test_a_node_beside_the_zone_is_nearly_as_old_as_hours_are_closed(write, opened, closed):
    path = write(lambda hour: hour < 31 * 24 and hour % (opened + closed) < opened)
    records = simulate_batch(sea(path, nodes=[[9, 7]]), GREEDY, 0, 1)
    (measured,) = records.operations
    perfect = closed**2 / (2 * (opened + closed))
    assert perfect < measured["age_month_1"] * 21 / 3600 < perfect + 0.5
    assert records.missions["success"] == records.missions["home"] == 1


def test_a_window_begins_with_what_the_last_one_has_left_and_what_came_since(write, monkeypatch):
    space = sea(write(first_days(4, 6, 20)), uavs=2)
    flown = windows_flown(space, monkeypatch)
    assert len(flown) == 4 * 3  # 14 hours, cut after 6
    rates = np.array(space.node_rates)
    data, emptied, clock = np.zeros(5), np.zeros(5), 0.0
    for window, starts, nodes in flown:
        gap = window.first * HOUR / 21_000 - clock
        np.testing.assert_allclose(starts["data"][:, 0], data + rates * gap, rtol=1e-12)
        np.testing.assert_allclose(starts["ages"], clock - emptied, atol=1e-4)
        slots = window.hours * 3600 // 21
        clock = window.first * HOUR / 21_000 + slots
        data = nodes["residual"]
        emptied = clock - nodes["age_at_end"]
        assert (nodes["age_at_end"] <= starts["ages"] + gap + slots + 1e-3).all()


def test_data_of_a_year_are_conserved_and_its_hours_counted(write):
    space = sea(write(first_days(3, 6, 20)), uavs=2)
    records = simulate_batch(space, GREEDY, 0, 1)
    nodes, (measured,) = records.nodes[0], records.operations
    total = nodes["initial"] + nodes["arrived"]
    np.testing.assert_allclose(total, nodes["collected"] + nodes["residual"], rtol=1e-12)
    mean = np.array(space.node_rates) * 8760 * 3600 / 21  # in windows they are drawn
    np.testing.assert_allclose(nodes["arrived"], mean, rtol=1e-3)
    assert measured["windows"] == 9 and math.isclose(measured["open"], 42 / 8760)
    assert records.missions["slots"][0] == 3 * (2 * 1028 + 342)
    assert math.isclose(measured["age"], nodes["age"].mean(), rel_tol=1e-12)
    lengths = np.diff([0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334, 365])
    months = np.array([measured[name] for name in AGES_OF_MONTHS])
    assert math.isclose(measured["age"], (months * lengths).sum() / 365, rel_tol=1e-9)


@pytest.mark.parametrize(
    ("minutes", "pads", "after"),
    [(60, 1, (100, 100)), (30, 1, (100, 75)), (30, 2, (100, 100)), (0, 1, (40, 60))],
)
def test_batteries_are_charged_between_windows_one_after_another(write, minutes, pads, after):
    campaign = Campaign(sea(write(first_days(1)), uavs=2, pads=pads), 0, 0)
    for uav, battery in zip(campaign.fleet, (40, 60), strict=True):
        for name, value in {"x": 7, "y": 7 + uav.number, "zone": 0, "battery": battery}.items():
            uav.state[name] = value
    campaign.charge(minutes * 60 / 21)
    batteries = [int(uav.state["battery"]) for uav in campaign.fleet]
    assert np.abs(np.subtract(batteries, after)).max() <= 1  # a slot adds 7/8 %
    assert campaign.totals.uavs["charged"].tolist() == [batteries[0] - 40, batteries[1] - 60]


@pytest.mark.parametrize(("gap", "repair"), [(10, 40.0), (100, 40.0), (5, 1.0), (50, 0.0)])
def test_what_is_out_of_order_is_repaired_in_the_gap_with_its_probability(write, gap, repair):
    campaign = Campaign(sea(write(first_days(1)), uavs=2), 0, 0)
    (record,) = campaign.mission
    record.node_repair = 1 / repair if repair else 0.0
    nodes = 4000
    silent = np.ones(nodes, np.bool_)
    repair_in_gap(record, 3, float(gap), silent, np.zeros(1, np.bool_))
    stays = (1 - 1 / repair) ** gap if repair else 1.0
    assert abs(silent.mean() - stays) <= 4 * math.sqrt(stays * (1 - stays) / nodes)


@pytest.mark.parametrize(("spares", "flown"), [(0, [8, 80]), (1, [8, 32, 56, 80])])
def test_a_lost_uav_is_replaced_by_a_spare_or_after_its_delivery(write, spares, flown, monkeypatch):
    space = sea(write(first_days(4, 8, 14)), {"spares": spares, "delivery": "2 d"})
    end = Campaign.end_window
    lost = []

    def lose(self: Campaign, record: MissionRecord, state: Any, b: int) -> None:
        if not lost:  # the first one flown
            state.uavs["end"][b, 0] = BATTERY
        lost.append(self.plan.windows[self.next].first)
        end(self, record, state, b)

    monkeypatch.setattr(Campaign, "end_window", lose)
    records = simulate_batch(space, GREEDY, 0, 1)
    # Two days after the end of the first window, that of the third day has begun.
    assert lost == flown and records.uavs["down"].sum() == 1
    assert records.operations["windows"] == len(flown)


def test_records_of_years_do_not_depend_on_their_batch():
    space = load_scenario("new-jersey", uavs=1, **{"weather.operating": "11:00-12:00"})
    together = simulate_batch(space, GREEDY, 3, 2)
    for number in range(2):
        alone = simulate_batch(space, GREEDY, 3, [number])
        assert_same(alone.mission(0), together.mission(number))
        assert alone.operations.tobytes() == together.operations[number : number + 1].tobytes()


def test_years_are_drawn_in_an_order_of_the_seed_without_replacement():
    space = load_scenario("new-jersey")
    orders = [[year.year for year in years_of(space, seed)] for seed in (0, 1)]
    assert orders[0] != orders[1]
    for order in orders:
        assert sorted(order) == [*range(1990, 2021)]
    with pytest.raises(InputError, match="years: 32 years are asked for; allowed: 31 at most"):
        simulate_batch(space, GREEDY, 0, 32)


def test_costs_of_a_window_are_the_largest_of_its_hours_by_hand(tmp_path):
    winds = [(2.0, 0.0), (6.0, 90.0), (4.0, 270.0)]
    hours = np.datetime64("2021-01-01T00") + np.arange(8760).astype("timedelta64[h]")
    rows = [f"{hours[h]}:00,{w},{d}" for h, (w, d) in enumerate(winds)]
    rows += [f"{hour}:00,," for hour in hours[3:]]
    path = tmp_path / "weather.csv"
    path.write_text("\n".join(["time,wind,from", *rows]))
    space = sea(path)
    plan = plan_of(space, years_of(space, 0)[0])
    (window,) = plan.windows
    wing = RotaryWing()
    by_hour = [
        [
            math.ceil(1000 * wing.power(speed) / wing.power(15.0) - 1e-6)
            for speed in (*(airspeed_along(c, 15.0, w, d) for c in COURSES), w)
        ]
        for w, d in winds
    ]
    assert window.costs[0].tolist() == np.max(by_hour, axis=0).tolist()
    assert window.hours == 3 and plan.longest_gap == 8757


def test_another_cruise_keeps_the_cell_and_costs_what_it_takes():
    space = load_scenario("jade-bight", **{"data_sheet.cruise": "10 m/s"})
    assert space.units.cell == 315 and space.units.slot == 31.5
    wing = RotaryWing()
    of_slot = 1000 * 100 * 31.5 / (35 * 60) / wing.power(15.0)  # at the power of 1
    airspeeds = [*(airspeed_along(course, 10.0, 8.0, 225.0) for course in COURSES), 8.0]
    by_hand = [math.ceil(of_slot * wing.power(speed) - 1e-6) for speed in airspeeds]
    assert list(space.consumption.slots[0]) == by_hand
    assert space.charge_fraction == 100 * 31.5 / (40 * 60)


def test_a_window_by_itself_is_that_of_its_year(write, monkeypatch):
    space = sea(write(first_days(2, 6, 20)), uavs=2)
    flown = windows_flown(space, monkeypatch)
    monkeypatch.undo()
    for window, _, nodes in flown[3:]:
        begin = np.datetime64("2021-01-01T00") + int(window.first)
        record = simulate(space, GREEDY, 0, window=str(begin), events=True)
        np.testing.assert_array_equal(record.nodes, nodes)


def test_what_is_no_window_is_refused_in_a_line(write):
    space = sea(write(first_days(2, 6, 20)))
    for window, line in {
        "2021-01-01T07": "window: none begins at 2021-01-01T07; allowed: such as 2021-01-01T06",
        "2022-01-01T07": "window: 2022-01-01T07 is in no whole year of the weather",
        "noon": "window: 'noon' is no time; allowed: such as 2013-02-09T14",
    }.items():
        with pytest.raises(InputError) as error:
            simulate(space, GREEDY, window=window)
        assert str(error.value).startswith(line)
    with pytest.raises(InputError, match="window: is of a year with weather"):
        simulate("paper", GREEDY, window="2021-01-01T07")


def test_a_fleet_that_is_drawn_has_no_years(write):
    with pytest.raises(InputError, match=r"uavs: \[1, 3\] is drawn; allowed: one number"):
        simulate_batch(sea(write(first_days(1)), uavs=(1, 3)), GREEDY, 0, 1)


@pytest.mark.slow
def test_an_auditor_replays_windows_of_ten_years(monkeypatch):
    space = load_scenario("new-jersey", uavs=2, **{"data_sheet.cruise": "12 m/s"})
    places = np.random.default_rng(4).integers(600, size=10)
    starts: list[WindowStart] = []
    begin = Campaign.begin_window

    def keep(self: Campaign, rows: Any, b: int) -> int:
        number = begin(self, rows, b)
        if number >= 0 and 0 <= self.next - places[self.replication] < 30:
            row = type(rows)(*(array[b : b + 1].copy() for array in rows))
            row.constants["energy"] = 0
            starts.append(WindowStart(self.scenario_of_window(), row, number))
        return number

    monkeypatch.setattr(Campaign, "begin_window", keep)
    simulate_batch(space, GREEDY, 0, 10)
    assert len(starts) == 300
    for start in starts:
        about = (start.scenario, GREEDY, 0, start.replication)
        record = mission.simulate(*about, starts=start.starts, events=True)
        assert record.events is not None and record.nodes is not None
        report = audit(record.events.columns(), constants_of(start.scenario) | before(start))
        check_nodes(record.nodes, report["nodes"])
        wanted = {n: pytest.approx(record.metrics[n], abs=1e-6) for n in report["metrics"]}
        assert report["metrics"] == wanted


def before(start: WindowStart) -> dict[str, Any]:
    """What the auditor has to know of the windows before one."""
    (record,) = start.starts.constants.view(np.recarray)
    idle = float(record.idle)
    uavs = int(start.starts.ranges[0, 0, 0])
    rows = start.starts.uavs[0, :uavs]
    full = start.scenario.flying_time[0]
    batteries = [(u["battery"] if u["x"] >= 0 else full, u["remainder"]) for u in rows]
    left = start.starts.data[0, :, 0] - np.array(start.scenario.node_rates) * idle
    return {"before": {"idle": idle, "data": left, "ages": start.starts.ages[0], "uavs": batteries}}


@pytest.mark.slow
@pytest.mark.parametrize(("uavs", "operating"), [(1, "daylight"), (1, "always"), (2, "daylight")])
def test_hardly_a_uav_is_lost_where_slots_take_what_their_hours_take(uavs, operating):
    """Guard and policy plan with the most expensive hour; each hour takes what it takes."""
    weather = {"weather.operating": operating, "data_sheet.cruise": "12 m/s"}
    space = load_scenario("new-jersey", uavs=uavs, **weather)
    hours = hours_of(space)
    windows = lost = 0
    for number, year in enumerate(years_of(space, 0)[:3]):
        campaign = Campaign(space, 0, number)
        years = Years([campaign], world_of(space))
        years._begin_window(0)
        missions, shown = years.state.missions, years.world.shown()
        while years.has_window[0]:
            planned = missions["slot_costs"][0].copy()
            decide([GREEDY], years.state, shown, years.ways)
            hour = int(missions["slot"][0] * space.units.slot / 3600)
            first = year.first + campaign.plan.windows[campaign.next].first
            missions["slot_costs"][0] = hours.costs[first + hour].reshape(-1)
            assert (missions["slot_costs"][0][:5] <= planned[:5]).all()
            ended = _advance(years.has_window, years.state, years.world, years.scratch)
            missions["slot_costs"][0] = planned
            if len(ended):
                years._end_window(0)
                years._begin_window(0)
        windows += campaign.totals.windows
        lost += int(campaign.totals.uavs["down"].sum())
    assert windows > 1900 and lost <= windows / 1000


def test_a_gap_in_which_no_uav_is_there_is_repaired_once(write, monkeypatch):
    space = sea(write(first_days(4, 8, 14)), {"delivery": "2 d"})
    gaps: list[float] = []
    end = Campaign.end_window

    def lose(self: Campaign, record: MissionRecord, state: Any, b: int) -> None:
        state.uavs["end"][b, 0] = BATTERY
        end(self, record, state, b)

    monkeypatch.setattr(Campaign, "end_window", lose)
    repair = "dess.model.campaign.repair_in_gap"
    monkeypatch.setattr(repair, lambda mission, number, gap, *nodes: gaps.append(gap))
    simulate_batch(space, GREEDY, 0, 1)
    # Windows begin at hours 8, 32, 56 and 80; after the first one, no UAV is there until hour 62.
    np.testing.assert_allclose(gaps, [8 * 3600 / 21, 66 * 3600 / 21], atol=1)
