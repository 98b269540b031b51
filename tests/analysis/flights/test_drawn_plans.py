"""Plans of drawn seas, checked by geometry of our own on what the files say.

The seas have fleets of one to six UAVs, zones in degrees, land and a data sheet, all drawn.
"""

import io
import json
import math
from itertools import combinations

import numpy as np
import pandas as pd
import pytest

from dess import InputError, load_scenario, simulate
from dess.analysis.flights.flight_plan import TABLE, FlightPlan
from dess.model.state import sample_scenario
from dess.scenario.scenario import ScenarioSpace, positions_in

TAKE_OFF, WAY_POINT, LOITER, LAND, CHANGE_SPEED = 22, 16, 19, 21, 178
RADIUS = 6_371_008.8  # of the Earth [m]
AIR, GROUND = 10.0, 3.0  # the distances that are promised [m]
GRID = 20  # cells
POLICIES = ("greedy", "tour", "nearest", "age")


def draw_sea(folder, number):
    """Write a drawn sea into a folder; its number is the seed."""
    draw = np.random.default_rng(number)
    lat, lon = draw.uniform(-60, 60), draw.uniform(-170, 170)
    uavs = 1 + number % 6
    cruise, minutes = draw.uniform(6, 18), draw.uniform(10, 40)
    cell = 0.6 * minutes * cruise  # m: the way of the hundredth part of the endurance
    degree = np.array([math.cos(math.radians(lat)), 1]) * math.radians(1) * RADIUS / cell

    def place(x, y):
        return np.array([lon, lat]) + [(x - GRID / 2), (GRID / 2 - y)] / degree

    sides = [2 if uavs < 3 else 3, int(draw.integers(1, 3))]
    zones = [(3, 3), (int(draw.integers(9, 17)), int(draw.integers(9, 17)))]
    tables = []
    for (x, y), side in zip(zones, sides, strict=True):
        off = draw.uniform(-0.45, 0.45, 2)
        zone_lon, zone_lat = place(x + off[0], y + off[1])
        tables.append(f"{{lon = {zone_lon}, lat = {zone_lat}, width = {side}, height = {side}}}")
    nodes, land = [], []
    while len(nodes) < 8:
        spot = draw.uniform(0.2, GRID - 0.2, 2)
        if all(np.abs(spot - zone).max() > 2.5 for zone in zones):
            nodes.append(spot)
    islands = []
    for _ in range(int(draw.integers(0, 120))):
        corner = draw.integers(0, GRID, 2) + 0.1
        size = draw.integers(1, 3, 2) - 0.2
        middle = corner + size / 2
        clear = [np.abs(middle - zone).max() > 3.5 for zone in zones]
        clear += [np.abs(middle - node).max() > 1.6 for node in nodes]
        clear += [np.abs(middle - other).max() > 2.9 for other in islands]  # UAVs fly between them
        if all(clear):
            islands.append(middle)
            x, y = corner
            ring = [(x, y), (x + size[0], y), (x + size[0], y + size[1]), (x, y + size[1]), (x, y)]
            land.append([place(*spot).tolist() for spot in ring])
    features = [
        {"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [ring]}} for ring in land
    ]
    lines = [",".join(map(str, place(*spot))) for spot in nodes]
    (folder / "nodes.csv").write_text("\n".join(["lon,lat", *lines]))
    no_fly = ""
    if land:
        no_fly = 'no_fly = "land.geojson"'
        (folder / "land.geojson").write_text(
            json.dumps({"type": "FeatureCollection", "features": features})
        )
    pads = int(draw.integers(1, 3))
    path = folder / "sea.toml"
    path.write_text(
        f"""
uavs = {uavs}
grid = {GRID}
centre = [{lon}, {lat}]
nodes = {{file = "nodes.csv", place = "merge"}}
{no_fly}
zone = {tables[0]}
pads = {pads}
[[zones]]
cells = {tables[1]}
pads = 1
[data_sheet]
endurance = "{minutes:.3f} min"
cruise = "{cruise:.3f} m/s"
charging = "{draw.uniform(15, 60):.1f} min"
reserve = "{draw.choice([0, 10, 20])} %"
data_rate = "500 kB/h"
bandwidth = "5 MHz"
snr = "15 dB at 500 m"
range = "3 km"
altitude = "{draw.choice([5, 10, 30])} m"
climb = "{draw.uniform(1.5, 5):.2f} m/s"
horizon = "{minutes * 3:.2f} min"
"""
    )
    return path


class FromFiles:
    """The plan as its files tell it.

    Attributes:
        places: (T, I, 3) the UAVs on a flat map [m] and their altitudes, at each second.
        lines: The ways of all flights on this map, (K, 2) places each.
        fences: The corners of the polygons of the fence on this map, and whether UAVs stay in them.
    """

    def __init__(self, files):
        table = pd.read_csv(io.StringIO(files[TABLE]))
        self._origin = table[["lon", "lat"]].to_numpy()[0]
        self._scale = np.array([math.cos(math.radians(self._origin[1])), 1])
        moments = {uav: [] for uav in table["uav"].unique()}
        self.lines = []
        for row in table.sort_values(["uav", "start"]).itertuples():
            if row.phase in ("flight", "move"):
                moments[row.uav] += self._fly(row, json.loads(files[row.file]))
            else:
                spot = self.flat(row.lon, row.lat)
                moments[row.uav] += [(row.start, *spot, 0), (row.end, *spot, 0)]
        seconds = np.arange(math.ceil(table["end"].max()) + 1)
        # What is said of the time between two moments, it is flown or stood evenly.
        self.places = np.stack(
            [
                np.stack([np.interp(seconds, *np.array(of)[:, [0, axis]].T) for axis in (1, 2, 3)])
                for of in moments.values()
            ]
        ).transpose(2, 0, 1)
        self.fences = []
        document = json.loads(next((t for n, t in files.items() if n != TABLE), "{}"))
        for polygon in document.get("geoFence", {"polygons": []})["polygons"]:
            corners = [self.flat(corner[1], corner[0]) for corner in polygon["polygon"]]
            self.fences.append((np.array(corners), polygon["inclusion"]))

    def flat(self, lon, lat):
        """A place on the map [m]."""
        away = (np.array([lon, lat]) - self._origin + 180) % 360 - 180
        return np.radians(away * self._scale) * RADIUS

    def _fly(self, row, document):
        """The moments of a flight; its end is that of the table to a second."""
        time, speed = row.start, None
        spot, altitude, moments, line = None, 0.0, [], []
        for item in document["mission"]["items"]:
            if item["command"] == CHANGE_SPEED:
                speed = item["params"][1]
                continue
            target = self.flat(item["params"][5], item["params"][4])
            if item["command"] == TAKE_OFF:
                spot, altitude = target, item["params"][6]
                moments += [(time, *spot, 0), (time + altitude / row.climb, *spot, altitude)]
            else:
                time = moments[-1][0] + np.hypot(*(target - spot)) / speed
                spot = target
                moments.append((time, *spot, altitude))
            if item["command"] == LOITER:
                moments.append((time + item["params"][0], *spot, altitude))
            if item["command"] == LAND:
                moments.append((time + altitude / row.climb, *spot, 0))
            line.append(spot)
        assert moments[-1][0] == pytest.approx(row.end, abs=1 + 0.005 * row.seconds)
        self.lines.append(np.array(line))
        return moments


def least_distances(places):
    """The least distances with a UAV in the air, and with both on the ground, at any second."""
    air = ground = math.inf
    for one, other in combinations(range(places.shape[1]), 2):
        distance = np.linalg.norm(places[:, one] - places[:, other], axis=1)
        stand = (places[:, one, 2] == 0) & (places[:, other, 2] == 0)
        air = min(air, np.where(stand, math.inf, distance).min())
        ground = min(ground, np.where(stand, distance, math.inf).min())
    return air, ground


def holds(polygon, spots):
    """(N,) whether places lie in a polygon, by the even-odd rule."""
    inside = np.zeros(len(spots), bool)
    for start, end in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        crosses = (start[1] <= spots[:, 1]) != (end[1] <= spots[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            share = (spots[:, 1] - start[1]) / (end[1] - start[1])
        inside ^= crosses & (spots[:, 0] < start[0] + share * (end[0] - start[0]))
    return inside


def check_plan(folder, number):
    """Check the plan of a drawn sea; whether there is one."""
    path = draw_sea(folder, number)
    space = ScenarioSpace.of(load_scenario(path), forbid_swaps=True)
    policy = POLICIES[number % len(POLICIES)]
    log = simulate(space, policy, number, events=True).events.columns()
    scenario = sample_scenario(space, number, 0)
    try:
        plan = FlightPlan.of(log, scenario, positions_in(path))
    except InputError as error:
        print(number, error)
        return False
    written = FromFiles(plan.make_files())
    air, ground = least_distances(written.places)
    assert air >= AIR - 0.1, number  # the map is flat
    assert ground >= GROUND, number
    assert sum(len(polygon) for polygon, _ in written.fences) <= 64
    for line in written.lines:
        steps = np.concatenate(
            [np.linspace(start, end, 200) for start, end in zip(line, line[1:], strict=False)]
        )
        for polygon, inside in written.fences:
            assert (holds(polygon, steps) == inside).all(), number
    return True


def check_plans(folder, numbers):
    """At most one in twenty plans is refused."""
    refused = sum(not check_plan(folder, number) for number in numbers)
    assert refused <= len(numbers) / 20


def test_uavs_of_drawn_plans_keep_their_distances_and_stay_within_the_fence(tmp_path):
    check_plans(tmp_path, range(6))


@pytest.mark.slow
def test_uavs_of_two_hundred_drawn_plans_keep_their_distances(tmp_path):
    check_plans(tmp_path, range(200))
