"""Plans of flights: their phases, way points, lengths and files, worked out by hand."""

import json
import math
from pathlib import Path

import jsonschema
import mavsdk
import numpy as np
import pandas as pd
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from mavsdk.plugins.mission_raw import MissionRaw
from scipy.spatial import cKDTree

from dess import InputError, load_scenario, simulate
from dess.analysis.flights import flight_plan
from dess.analysis.flights.fence import outline_pieces
from dess.analysis.flights.flight_plan import TABLE, FlightPlan
from dess.analysis.flights.places import ZonePlaces
from dess.analysis.flights.route import Craft, GeoPoint, Moment
from dess.analysis.flights.separation import Separation, Track, closest_approach
from dess.model.state import sample_scenario
from dess.physics.chart import NO_FLY
from dess.scenario.polygons import centres_in
from dess.scenario.rotary_wing import RotaryWing
from dess.scenario.scenario import Scenario, ScenarioSpace, positions_in
from tests.analysis.flights.hand import (
    CELL,
    SHEET,
    SLOT,
    SPEED,
    TYPED,
    log_of,
    middle,
    place,
    scenario_of,
    write_sea,
)

SCHEMA = json.loads(Path(__file__).with_name("plan.schema.json").read_text("utf-8"))
# A quadrotor with PX4 says that it is there: a HEARTBEAT of MAVLink 2, with its checksum.
HEARTBEAT = bytes.fromhex("fd09000000010100000000000000020c000003d7de")

# To the node in cell (2, 1), where the UAV hovers for two slots, and back.
THERE = [(1, 0), (1, 0), (2, 0), (2, 1), (2, 1), (2, 1), (2, 0), (1, 0), (0, 0), (0, 0)]


def plan_of(path, *ways, uavs=1, **fields):
    """The plan of a hand-made log of a sea."""
    scenario = scenario_of(path, uavs=uavs, **fields)
    return FlightPlan.of(log_of(*ways), scenario, positions_in(path))


def items_of(text):
    """Command and parameters of all items of a file."""
    return [(item["command"], item["params"]) for item in json.loads(text)["mission"]["items"]]


@pytest.fixture(scope="module")
def jade_bight():
    """The plan of a mission in the Jade Bight."""
    space = ScenarioSpace.of(load_scenario("jade-bight"), forbid_swaps=True)
    log = simulate(space, "tour", events=True).events.columns()
    return FlightPlan.of(log, sample_scenario(space, 0, 0), positions_in("jade-bight"))


# --- a flight by hand ---


def test_a_flight_from_cell_to_cell_has_its_turns_its_stop_and_its_times(tmp_path):
    plan = plan_of(write_sea(tmp_path), THERE)
    (name, text), (table, _) = plan.make_files().items()
    assert (name, table) == ("uav01-flight01-00h00m10s.plan", TABLE)
    node = [0.0021, -0.0012]  # latitude and longitude of the first of two nodes in the cell
    zone = [0.0035, -0.003]  # of the middle of the zone
    turn = [*reversed(middle(2, 0))]
    assert items_of(text) == [
        (22, [0, 0, 0, None, *map(pytest.approx, zone), 10]),
        (178, [1, pytest.approx(SPEED), -1, 0, 0, 0, 0]),
        (16, [0, 0, 0, None, *map(pytest.approx, turn), 10]),
        (19, [20, 0, 0, 0, *node, 10]),
        (16, [0, 0, 0, None, *map(pytest.approx, turn), 10]),
        (21, [0, 0, 0, None, *map(pytest.approx, zone), 0]),
    ]
    # The node is 0.3 of a cell east of the middle of its cell, and 0.4 south of it.
    (route,) = plan.routes.values()
    assert route.shift == pytest.approx(0.5 * CELL, rel=1e-3)
    assert route.ground_shift == pytest.approx(0.5 * CELL, rel=1e-3)
    assert route.simulated_metres == pytest.approx(5 * CELL)
    assert route.simulated_seconds == pytest.approx(7 * SLOT)
    assert route.metres == pytest.approx((3 + 2 * math.hypot(0.3, 1.4)) * CELL, rel=1e-4)
    in_the_air = route.metres / SPEED + 2 * SLOT
    climb = 10 / 3  # 10 m at the 3 m/s that the sheet assumes
    assert route.seconds == pytest.approx(in_the_air + 2 * climb)
    # By Zeng's equation 12 in still air; momentum theory takes 1.23 times as much for the climb.
    wing = RotaryWing()
    hovering = math.ceil(1000 / wing.power(SPEED)) / 1000
    climbing = 0.474 + 0.526 * (3 / 8.06 + math.sqrt((3 / 8.06) ** 2 + 1))
    vertical = climb / SLOT * (2 * hovering + (climbing - 1) / wing.power(SPEED))
    assert route.battery == pytest.approx(7 * in_the_air / 70 + vertical)
    flight = plan.entries[1]
    assert flight.battery[1] == pytest.approx(100 - route.battery)


def test_a_base_that_was_typed_in_degrees_is_where_it_was_typed(tmp_path):
    """The UAV leaves it over the middle of the cell at its border, to stay in open cells."""
    way = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 0), (1, 0), (1, 0), (0, 0), (0, 0)]
    plan = plan_of(write_sea(tmp_path, TYPED), way)
    (route,) = plan.routes.values()  # a move from one of its cells to the other is no flight
    places = [tuple(point.place) for point in route.points]
    assert places[0] == places[-1] == (-0.0031, 0.0036)
    assert [*map(pytest.approx, places[1:-1])] == [
        *(middle(1, 0), middle(2, 0), middle(2, 1), middle(2, 0), middle(1, 0))
    ]
    assert route.ground_shift == pytest.approx(math.hypot(0.6, 0.1) * CELL, rel=1e-3)
    document = json.loads([*plan.make_files().values()][0])
    assert document["mission"]["plannedHomePosition"] == [0.0036, -0.0031, 0]
    assert document["rallyPoints"]["points"] == [[0.0036, -0.0031, 10.0]]
    assert [entry.kind for entry in plan.entries] == ["flight", "standing"]


def test_charging_and_standing_lie_between_the_files(tmp_path):
    hop = [(1, 0), (2, 0), (1, 0)]
    log = log_of([(1, 0), (1, 0), *hop, (1, 0), (1, 0), *hop, (1, 0)])
    rows = pd.DataFrame(log)
    charge = rows.iloc[:2].assign(time=[4.0, 7.0], event=["charge_start", "charge_end"], uav=0)
    scenario = scenario_of(write_sea(tmp_path), uavs=1)
    plan = FlightPlan.of(pd.concat([rows, charge]), scenario, positions_in(tmp_path / "sea.toml"))
    table = plan.make_table()
    kinds = ["standing", "flight", "charging", "flight"]
    assert table["phase"].tolist() == kinds
    assert (table["start"][1:].to_numpy() == table["end"][:-1].to_numpy()).all()
    assert table["file"].ne("").tolist() == [kind == "flight" for kind in kinds]


def test_a_slow_uav_is_in_the_air_as_long_as_its_moves_take(tmp_path):
    """Its log has the next cell from the first of the slots on."""
    sea = write_sea(tmp_path, sheet="[[fleet]]\nslots_per_cell = 2\n" + SHEET)
    out = [(1, 0), (2, 0), (2, 0), (3, 0), (3, 0), (3, 0)]  # it hovers for the last slot
    plan = plan_of(sea, [*out, (2, 0), (2, 0), (1, 0), (1, 0), (1, 0)])
    (route,) = plan.routes.values()
    assert route.craft.speed == pytest.approx(SPEED / 2)
    assert route.simulated_metres == pytest.approx(4 * CELL)
    assert [point.seconds for point in route.points] == [0, SLOT, 0]
    # From the middle of the zone, which is half a cell further than that of its last cell.
    later = 2 * (0.5 * CELL) / (SPEED / 2) + 2 * 10 / 3
    assert route.simulated_seconds == 9 * SLOT
    assert route.seconds == pytest.approx(route.simulated_seconds + later, rel=1e-4)


# --- what cannot be a plan ---


def test_a_mission_in_which_a_uav_does_not_land_is_refused(tmp_path):
    scenario = scenario_of(write_sea(tmp_path), uavs=1)
    positions = positions_in(tmp_path / "sea.toml")
    with pytest.raises(InputError, match="UAV 1 was lost .* without having landed; allowed: "):
        FlightPlan.of(log_of(THERE, landed=False), scenario, positions)
    log = pd.DataFrame(log_of(THERE))
    failure = log.iloc[:1].assign(event="uav_failure")
    with pytest.raises(InputError, match="UAV 1 fails in this mission; allowed: "):
        FlightPlan.of(pd.concat([log, failure]), scenario, positions)


def test_a_mission_for_which_there_are_no_times_of_day_is_refused(tmp_path, monkeypatch):
    scenario = scenario_of(write_sea(tmp_path, sheet=SHEET.replace("300 s", "9 d")), uavs=1)
    monkeypatch.setattr(flight_plan, "MOST_DAYS", 8)
    with pytest.raises(InputError, match="--plan: the mission lasts for 9 d; allowed: 8 d at most"):
        flight_plan.check_plannable(scenario)


def test_a_grid_that_reaches_beyond_a_pole_is_refused():
    """In cells of 95 km, with all that is flown to about the middle."""
    sheet = {"endurance": "10 d", "cruise": "11 m/s", "charging": "10 d", "data_rate": "1 kB/h"}
    sheet |= {"bandwidth": "1 MHz", "snr": "20 dB at 100 m", "horizon": "20 d"}
    world = {"grid": 128, "centre": (0, 50), "nodes": [(64, 64)], "zone": (63, 64, 1, 1)}
    scenario = Scenario.of(uavs=1, pads=1, data_sheet=sheet, **world)
    with pytest.raises(InputError, match="--plan: the grid reaches beyond a pole"):
        flight_plan.check_plannable(scenario)


# --- where way points are ---


def test_no_way_point_lies_in_a_no_fly_polygon(tmp_path):
    """The polygon covers the node, and not the middle of its cell, which is therefore open."""
    ring = [[-0.0013, 0.002], [-0.0011, 0.002], [-0.0011, 0.0022], [-0.0013, 0.002]]
    polygon = {"type": "Polygon", "coordinates": [ring]}
    (tmp_path / "land.geojson").write_text(json.dumps({"features": [{"geometry": polygon}]}))
    sea = write_sea(tmp_path, fields='no_fly = "land.geojson"\n')
    assert load_scenario(sea).no_fly == ()
    assert positions_in(sea).nodes == {(5, 5): (0.0018, -0.0012)}
    assert plan_of(sea, THERE).summarise()["largest_shift_m"] == 0


def test_places_that_the_files_do_not_decide_are_the_middles_of_cells(tmp_path):
    sea = write_sea(tmp_path, TYPED)
    assert positions_in(sea).nodes.keys() == {(2, 1), (5, 5)}
    other = positions_in(sea, nodes=[[2, 1]], zone=[3, 3, 2, 2])
    assert (other.nodes, other.zones) == ({}, {})


def test_the_ways_of_a_mission_stay_in_open_cells_of_the_grid(jade_bight):
    sea = jade_bight.sea
    zones = sea.scenario.chart.zones
    for route in jade_bight.routes.values():
        spots = sea.projection.cells(np.array([point.place for point in route.points]))
        for start, end in zip(spots, spots[1:], strict=False):
            x, y = np.floor(np.linspace(start, end, 99).T).astype(int)
            assert (zones[y, x] != NO_FLY).all()


def test_flights_agree_with_the_simulation_within_what_is_told(jade_bight):
    """The lengths are computed from the files again, on a sphere as well."""
    summary = jade_bight.summarise()
    table = jade_bight.make_table().query("phase == 'flight'").set_index("file")
    assert summary["flights"] == len(table) > 3
    for name, text in jade_bight.make_files().items():
        if name not in table.index:
            continue
        places = [params[4:6] for command, params in items_of(text) if command != 178]
        lat, lon = np.radians(np.array(places)).T
        steps = np.hypot(np.diff(lat), np.diff(lon) * np.cos((lat[1:] + lat[:-1]) / 2))
        metres = 6_371_008.8 * steps.sum()
        waits = sum(params[0] for command, params in items_of(text) if command == 19)
        row = table.loc[name]
        assert row["metres"] == pytest.approx(metres, abs=1)
        climbs = 2 * row["altitude"] / row["climb"]
        assert row["seconds"] == pytest.approx(metres / row["speed"] + waits + climbs, abs=1)
        assert abs(metres - row["simulated_metres"]) <= summary["largest_difference_m"] + 1
        late = row["seconds"] - row["simulated_seconds"]
        assert abs(late) <= summary["largest_difference_s"] + 0.2
        assert row["seconds"] == pytest.approx(row["end"] - row["start"], abs=0.1)
        assert row["shift"] <= summary["largest_shift_m"]


def test_longitudes_are_those_of_the_earth_on_both_sides_of_the_180th_meridian(tmp_path):
    sea = write_sea(tmp_path)
    (tmp_path / "nodes.csv").write_text("lon,lat\n179.9994,-0.0012\n")
    sea.write_text(sea.read_text().replace("centre = [0, 0]", "centre = [180, 0]"))
    way = [(1, 0), *((x, 0) for x in range(2, 7)), *((x, 0) for x in range(5, 0, -1)), (1, 0)]
    plan = plan_of(sea, way)
    (route,) = plan.routes.values()
    assert [point.place.lon for point in route.points] == pytest.approx(
        [179.997, -179.9975, 179.997]
    )
    assert route.metres == pytest.approx(route.simulated_metres + CELL, rel=1e-4)
    assert json.loads([*plan.make_files().values()][0])["geoFence"]["polygons"] == []
    assert any(line.startswith("There is no geofence") for line in plan.list_sentences())


# --- who is near ---


def test_the_closest_approach_of_two_uavs_is_that_of_their_ways_and_altitudes(tmp_path):
    """One flies east and the other north, and crosses the way of the first 10 s after it."""
    sea = plan_of(write_sea(tmp_path), THERE).sea
    ways = [((0, 4), (8, 4), 0.0, 10), ((4, 8), (4, 0), 10.0, 21)]
    tracks = []
    for uav, (start, end, time, altitude) in enumerate(ways):
        moments = [Moment(time, sea.place_at(*start), altitude)]
        moments.append(Moment(time + 80, sea.place_at(*end), altitude))
        tracks.append(Track.of(uav, moments, sea))
    approach = closest_approach(tracks, sea)
    assert approach.metres == pytest.approx(math.hypot(CELL / math.sqrt(2), 11), rel=1e-3)
    assert approach.seconds == pytest.approx(45, rel=1e-3)
    assert closest_approach(tracks, sea, ground=True) is None


# Two UAVs that go out and come back in the same slots, to and from neighbouring cells.
TOGETHER = (
    [(0, 0), (0, 1), (0, 2), (0, 1), (0, 0), (0, 0)],
    [(1, 0), (1, 1), (1, 2), (1, 1), (1, 0), (1, 0)],
)


def test_uavs_of_a_zone_have_places_of_their_own(tmp_path):
    """At e1931ad2 both stood, took off and landed at the place that was typed."""
    plan = plan_of(write_sea(tmp_path, TYPED), *TOGETHER, uavs=2, pads=1)
    table = plan.make_table()
    places = table[["lon", "lat"]].drop_duplicates().to_numpy()
    assert len(places) == 2
    [one, other] = (GeoPoint(*place) for place in places)
    assert one.distance_to(other) >= 10
    assert plan.summarise()["closest_approach_on_ground_m"] >= 10
    assert plan.summarise()["closest_approach_m"] >= 10
    assert [place["place"] for place in plan.list_places()] == ["pad 1", "place 1", "place 2"]
    altitudes = [route.craft.altitude for route in plan.routes.values()]
    assert altitudes == [10.0, 21.0]


def test_a_plan_in_which_uavs_come_too_near_is_refused(tmp_path, monkeypatch):
    """Nobody waits until the way is free: one lands where the other one is."""
    places = ZonePlaces((GeoPoint(-0.0031, 0.0036),), (GeoPoint(-0.0031, 0.0036),) * 2)
    monkeypatch.setattr(ZonePlaces, "lay_out", lambda *_: places)
    with pytest.raises(InputError) as refusal:
        plan_of(write_sea(tmp_path, TYPED), *TOGETHER, uavs=2, pads=1)
    assert "two UAVs come too near: 0.0 m, after 00h00m00s at 0.003600, -0.003100" in str(
        refusal.value
    )
    assert "uav01-flight01" in str(refusal.value) and "uav02-flight01" in str(refusal.value)
    assert "allowed: 10 m and more in the air" in str(refusal.value)


def test_a_zone_without_room_is_refused(tmp_path):
    far = Separation(air=150)
    with pytest.raises(InputError, match="zone 1 of 222 x 111 m has no room for 3 places, 151 m"):
        sea = write_sea(tmp_path, TYPED)
        scenario = scenario_of(sea, uavs=2, pads=1)
        FlightPlan.of(log_of(*TOGETHER), scenario, positions_in(sea), separation=far)


def test_a_climb_that_is_longer_than_the_way_is_told(tmp_path):
    sheet = SHEET + 'altitude = "400 m"\n'
    plan = plan_of(write_sea(tmp_path, sheet=sheet), [(1, 0), (2, 0), (1, 0), (1, 0)])
    told = "The climb of 1 flight is longer than the way: uav01-flight01-00h00m00s.plan."
    assert told in plan.list_sentences()
    assert "UAVs climb and descend at 3 m/s, which is assumed (climb in the data sheet)." in (
        plan.list_sentences()
    )


def test_what_climbs_take_is_what_the_docs_say():
    text = Path("docs/concepts/left-out.md").read_text("utf-8")
    table = text.split("| altitude [m] |")[1].split("\n\n")[0].splitlines()[2:]
    scenario = Scenario.of(load_scenario("jade-bight"), uavs=1)
    for row in table:
        altitude, seconds, battery = (float(cell) for cell in row.strip("| ").split("|"))
        craft = Craft.of(scenario, 0, altitude)
        assert seconds == pytest.approx(2 * craft.vertical_seconds, abs=0.05)
        assert battery == pytest.approx(craft.vertical_battery, abs=0.005)


def test_who_waits_for_a_pad_moves_to_it_and_away_from_it(tmp_path):
    """The second UAV stands until the first one is charged, which makes room for it."""
    stay = [(0, 0)] * 12
    ways = [[(0, 0), (0, 1), *stay], [(1, 0), (1, 1), (1, 0), *[(1, 0)] * 11]]
    log = pd.DataFrame(log_of(*ways))
    charges = [(3.0, "charge_start", 0), (6.0, "charge_end", 0)]
    charges += [(6.0, "charge_start", 1), (9.0, "charge_end", 1)]
    rows = [log.iloc[:1].assign(time=time, event=event, uav=uav) for time, event, uav in charges]
    sea = write_sea(tmp_path, TYPED)
    scenario = scenario_of(sea, uavs=2, pads=1)
    plan = FlightPlan.of(pd.concat([log, *rows]), scenario, positions_in(sea))
    table = plan.make_table()
    on_pads = table[table["phase"] == "charging"]
    assert on_pads["place"].tolist() == ["pad 1", "pad 1"]
    assert (table["phase"] == "move").any()
    ends = on_pads.sort_values("start")["end"].tolist()
    assert on_pads["start"].max() > ends[0]


def test_batteries_are_read_from_full(tmp_path):
    """In the model the battery of a UAV begins above its reserve: 80 % are full there."""
    sheet = SHEET + 'reserve = "20 %"\n'
    sea = write_sea(tmp_path, sheet=sheet)
    scenario = scenario_of(sea, uavs=1)
    log = pd.DataFrame(log_of(THERE))
    log["value"] -= 20 * log["event"].isin(["move", "mission_start"]) * (log["uav"] >= 0)
    plan = FlightPlan.of(log, scenario, positions_in(sea))
    assert plan.make_table()["battery_start"][0] == 100
    assert plan.summarise()["lowest_battery"] == 92


# --- files ---


@given(st.lists(st.lists(st.booleans(), min_size=7, max_size=7), min_size=1, max_size=7))
def test_the_pieces_of_a_fence_cover_the_no_fly_cells_and_no_others(rows):
    closed = np.array(rows)
    covered = np.zeros(closed.shape, int)
    for corners in outline_pieces(closed):
        ring = np.array([*corners, corners[0]], float)
        covered += centres_in([ring], closed.shape[::-1])
        x, y = ring.T
        # On the grid y grows south, so that a positive area is clockwise on a map.
        assert (x[:-1] * y[1:] - x[1:] * y[:-1]).sum() > 0
    assert (covered == closed).all()


def test_the_fence_has_at_most_64_corners_and_covers_what_is_near(jade_bight):
    """At e1931ad2 it had 178; PX4 keeps 64 in all polygons together."""
    fence = jade_bight.fence
    assert fence.all_corners == 178 and fence.corners <= 64
    sea = jade_bight.sea
    size = sea.scenario.size
    fenced = np.zeros(size[::-1], bool)
    ways = np.concatenate([route_spots(sea, route) for route in jade_bight.routes.values()])
    for polygon in fence.outside:
        corners = sea.spots(polygon)
        fenced |= centres_in([np.concatenate([corners, corners[:1]])], size)
        assert not shapely.contains_xy(shapely.Polygon(corners), *ways.T).any()
    closed = sea.scenario.chart.zones == NO_FLY
    near = np.inf if fence.left_out is None else fence.left_out
    rows, columns = np.nonzero(closed & ~fenced)
    distances, _ = cKDTree(ways).query(np.stack([columns, rows], axis=1) + 0.5)
    assert (distances * sea.scenario.cell_size >= near - sea.scenario.cell_size).all()


def route_spots(sea, route):
    """(N, 2) places along a way [cells]."""
    spots = sea.spots([point.place for point in route.points])
    return np.concatenate([np.linspace(a, b, 99) for a, b in zip(spots, spots[1:], strict=False)])


def test_dess_reads_the_geofence_of_its_own_plan(tmp_path, caplog):
    """Beside the sea of the plan, it closes what that sea has closed, nothing else, and no note."""
    grid = ["........"] * 8
    grid[4] = "...##..#"
    grid[5] = "...#...."
    (tmp_path / "land.txt").write_text("\n".join(grid))
    sea = write_sea(tmp_path, fields='no_fly = "land.txt"\n')
    files = plan_of(sea, THERE).make_files()
    (tmp_path / "own.plan").write_text([*files.values()][0])
    assert len(load_scenario(sea).no_fly) == 4
    again = write_sea(tmp_path, fields='no_fly = "own.plan"\n')
    assert load_scenario(again).no_fly == ((3, 4), (4, 4), (7, 4), (3, 5))
    assert caplog.text == ""


def test_fences_of_others_have_circles_and_what_uavs_stay_in(tmp_path):
    """All cells outside of a polygon of 6 x 6 cells are closed, and a circle in it."""
    corners = [[lat, lon] for lon, lat in map(place, (1, 7, 7, 1), (0, 0, 6, 6))]
    circle = {"center": [*reversed(middle(4, 4))], "radius": 100}
    fence = {
        "polygons": [{"inclusion": True, "polygon": corners, "version": 1}],
        "circles": [{"inclusion": False, "circle": circle, "version": 1}],
        "version": 2,
    }
    (tmp_path / "own.plan").write_text(json.dumps({"fileType": "Plan", "geoFence": fence}))
    sea = write_sea(tmp_path, zone="zone = [2, 0, 2, 1]\n", fields='no_fly = "own.plan"\n')
    closed = set(load_scenario(sea).no_fly)
    inside = {(x, y) for x in range(1, 7) for y in range(6)}
    assert closed & inside == {(4, 4)}
    assert len(closed) == 64 - 36 + 1


@pytest.mark.parametrize(
    ("fence", "problem"),
    [
        ({}, "geoFence"),
        ({"geoFence": {"polygons": [{"polygon": [[0, 0], [0, 1]], "inclusion": True}]}}, "corners"),
        (
            {"geoFence": {"polygons": [{"polygon": [[0, 200]] * 3, "inclusion": True}]}},
            "lon is 200",
        ),
        ({"geoFence": {"polygons": [{"polygon": [5] * 3, "inclusion": True}]}}, "two numbers"),
    ],
)
def test_what_is_no_fence_is_refused_in_one_line(tmp_path, fence, problem):
    (tmp_path / "own.plan").write_text(json.dumps(fence))
    sea = write_sea(tmp_path, fields='no_fly = "own.plan"\n')
    with pytest.raises(InputError, match=problem):
        load_scenario(sea)


def test_the_files_have_the_form_of_qgroundcontrol(jade_bight, tmp_path):
    validator = jsonschema.Draft202012Validator(SCHEMA)
    plans = [jade_bight, plan_of(write_sea(tmp_path), THERE)]
    for name, text in (entry for plan in plans for entry in plan.make_files().items()):
        if name != TABLE:
            validator.validate(json.loads(text))
    wrong = json.loads(text := [*plans[1].make_files().values()][0])
    wrong["mission"]["items"][0]["params"].pop()
    assert not validator.is_valid(wrong) and validator.is_valid(json.loads(text))


def test_mavsdk_reads_the_files(jade_bight):
    """Its importer, with no autopilot but a message that says that there is one."""
    component = mavsdk.ComponentType.GROUND_STATION
    with mavsdk.Mavsdk(mavsdk.Configuration.create_with_component_type(component)) as station:
        station.add_any_connection("raw://")
        station.pass_received_raw_bytes(HEARTBEAT)
        importer = MissionRaw(station.first_autopilot())
        for name, text in jade_bight.make_files().items():
            if name == TABLE:
                continue
            data = importer.import_qgroundcontrol_mission_from_string(text)
            document = json.loads(text)
            items = document["mission"]["items"]
            assert [item.command for item in data.mission_items] == [i["command"] for i in items]
            for item, written in zip(data.mission_items, items, strict=True):
                assert [item.x, item.y] == [round(1e7 * part) for part in written["params"][4:6]]
                assert item.z == pytest.approx(written["params"][6])
                assert item.frame == written["frame"]
            corners = sum(len(p["polygon"]) for p in document["geoFence"]["polygons"])
            assert len(data.geofence_items) == corners == jade_bight.fence.corners
            assert len(data.rally_items) == 2
