"""Seas from files as people have them: coasts, platforms, maps; each kind of file is read or told.

The files are small ones of the same kinds as those that were tried.
"""

import hashlib
import json
import logging
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from dess import InputError, load_scenario, simulate
from dess.analysis.names import node_placing_sentence
from dess.model.batch import simulate_batch
from dess.physics.chart import chart_at, spread
from dess.policies import load_team
from dess.scenario import no_fly
from dess.scenario.consistency import distance_error
from dess.scenario.no_fly import NoFlyFile
from dess.scenario.nodes import NodesFile, NodesFound
from dess.scenario.projection import Projection
from tests import compiled
from tests.dess.scenario.shapes import CELL, EQUATOR, EXACT, box, collection, feature

Sea = Callable[..., Path]


@pytest.fixture
def sea(tmp_path):
    """Writes files into a folder, and a scenario with the given lines beside them."""

    def write(lines: str = "", **files: Any) -> Path:
        for name, content in files.items():
            path = tmp_path / name.replace("__", "/").replace("_", ".")
            path.parent.mkdir(exist_ok=True)
            if isinstance(content, dict):
                content = json.dumps(content)
            path.write_bytes(content if isinstance(content, bytes) else content.encode())
        path = tmp_path / "sea.toml"
        path.write_text(lines)
        return path

    return write


def closed(path: Path, projection: Projection, **source: Any) -> np.ndarray:
    """(H, W) the no-fly cells of a file."""
    source_of = NoFlyFile(file=path.name, **source)
    return no_fly.no_fly_in(path, projection.size, projection, source_of, altitude=10.0)


def test_the_charts_of_shipped_seas_are_those_of_before():
    """Polygons, maps and tables close to the bit the cells that they have always closed."""
    kept = {"german-bight": "b937320433580aa2", "gulf-of-finland": "672faa533c324bb9"}
    kept |= {"saronic-gulf": "9d0383cfc4633d20", "tokyo-bay": "87b13b00eea774ed"}
    kept |= {"san-francisco-bay": "b410e2dc8a4237be", "bay": "fa069320b6cde2b0"}
    for name, digest in kept.items():
        space = load_scenario(name)
        text = json.dumps([space.nodes, space.no_fly, space.rectangles])
        assert hashlib.sha256(text.encode()).hexdigest()[:16] == digest, name


# --- polygons across meridians ---

# The centre of the grid, the rings of a polygon, and the share of the cells that it closes.
ACROSS = {
    "far away": ((-126.0, 47.5), [box(-10, 40, 170, 60)], 0),
    "far away, half of the rows": ((-126.0, 47.5), [box(-10, 47.5, 170, 60)], 0),
    "very long": ((-126.0, 47.5), [box(-110, 40, 150, 60)], 0),
    "around the sea": ((-126.0, 47.5), [box(-170, 40, -10, 60)], 1),
    "half of it": ((-126.0, 47.5), [box(-126, 40, -10, 60)], 0.5),
    "the whole Earth": ((179.99, 0.0), [box(-180, -90, 180, 90)], 1),
    "uncut at 180 degrees": ((-179.99, 0.0), [box(170, -9, -170, 9)], 1),
    "uncut, from its other side": ((179.99, 0.0), [box(170, -9, -170, 9)], 1),
    "uncut, elsewhere": ((0.0, 0.0), [box(170, -9, -170, 9)], 0),
    "a hole beyond": ((-175.0, 0.0), [box(170, -9, -170, 9), box(-176, -2, -174, 2)], 0),
    "a polar cap": ((30.0, -80.0), [box(-180, -90, 180, -70)], 1),
}  # fmt: skip


@pytest.mark.parametrize(("centre", "rings", "share"), ACROSS.values(), ids=ACROSS)
def test_a_polygon_closes_what_lies_in_it_wherever_meridians_are(
    centre, rings, share, sea, tmp_path
):
    sea(land_json=collection(feature("Polygon", rings)))
    cells = closed(tmp_path / "land.json", Projection(centre, (32, 32), 4000.0))
    assert cells.mean() == share


# --- features that close no cell, lanes ---

# A lane that is 0.17 cells wide lies beside the centres of the cells of a row.
LANE = collection(feature("Polygon", [box(-1, 0.0012, 1, 0.0029)]))
LINE = collection(feature("LineString", [[-1, 0.002], [1, 0.002]]))
ROW = {(x, 2) for x in range(8)}


def test_what_closes_no_cell_is_told_and_can_close_all_it_touches(sea, tmp_path, caplog):
    sea(lane_json=LANE, far_json=collection(feature("Polygon", [box(9, 9, 10, 10)])))
    with caplog.at_level(logging.WARNING):
        assert not closed(tmp_path / "lane.json", EQUATOR).any()
        assert not closed(tmp_path / "far.json", EQUATOR).any()
    lane, far = caplog.messages
    assert "lane.json: features.0 close no cell; touched = true" in lane
    assert "far.json closes no cell: it is not on the grid" in far
    touched = closed(tmp_path / "lane.json", EQUATOR, touched=True)
    assert {(x, y) for y, x in np.argwhere(touched).tolist()} == ROW


def test_lines_are_lanes_and_everything_can_have_a_buffer(sea, tmp_path):
    """The line is 0.3 cells south of the centres of row 2, and 0.7 north of those of row 3."""
    sea(line_json=LINE, rock_json=collection(feature("Point", [0.005, 0.005])))
    line, rock = tmp_path / "line.json", tmp_path / "rock.json"

    def rows(**source: Any) -> list[int]:
        return [*np.unique(np.argwhere(closed(line, EQUATOR, **source))[:, 0])]

    assert rows() == [2]  # without a width, what it touches
    assert rows(width=0.5 * CELL) == [2]  # a lane is never less than the line
    assert rows(width=0.7 * CELL) == [2]
    assert rows(width=0.2 * CELL, buffer=0.7 * CELL) == [2, 3]
    assert closed(rock, EQUATOR).sum() == 1
    assert closed(rock, EQUATOR, buffer=1.1 * CELL).sum() == 5  # its cell and the four beside it


EDGES: dict[str, tuple[str, Any, bool, list[tuple[int, int]]]] = {
    "a line": ("LineString", [[-1, 0], [1, 0]], False, [(x, y) for y in (2, 3) for x in range(8)]),
    "a line, touched": (
        "LineString",
        [[0, -1], [0, 0.011]],
        True,
        [(x, y) for x in (3, 4) for y in range(1, 6)],
    ),
    "at the rim": ("LineString", [[-1, -0.03], [1, -0.03]], False, [(x, 5) for x in range(8)]),
    "half of a line": (
        "LineString",
        [[-0.05, 0.005], [-0.02, 0], [0.05, 0]],
        False,
        [(0, 2), (1, 2), (1, 3), *((x, y) for y in (2, 3) for x in range(2, 8))],
    ),
    "a point": ("Point", [-0.02, 0.01], False, [(1, 1), (2, 1), (1, 2), (2, 2)]),
    "a polygon": ("Polygon", [box(-0.02, -0.01, 0.01, 0)], False, [(2, 3), (3, 3), (4, 3)]),
    "a polygon, touched": ("Polygon", [box(-0.02, -0.01, 0.01, 0)], True, [(2, 3), (3, 3), (4, 3)]),
    "a polygon of no width": (
        "Polygon",
        [box(-0.015, 0, 0.015, 0)],
        True,
        [(x, y) for y in (2, 3) for x in (2, 3, 4, 5)],
    ),
}  # fmt: skip


@pytest.mark.parametrize(("kind", "coordinates", "touched", "cells"), EDGES.values(), ids=EDGES)
def test_what_lies_on_an_edge_of_cells_touches_both_sides(
    kind, coordinates, touched, cells, sea, tmp_path
):
    """A polygon ends at its border: the cells beyond its edges stay open."""
    sea(lane_json=collection(feature(kind, coordinates)))
    found = np.argwhere(closed(tmp_path / "lane.json", EXACT, touched=touched))
    assert sorted((x, y) for y, x in found.tolist()) == sorted(cells)


def test_a_point_with_a_radius_is_a_circle(sea, tmp_path, caplog):
    """In metres or with a unit, beside the buffer of the file; a small one closes its own cell."""
    for given, buffer, count in (
        (1.1 * CELL, 0.0, 5),
        ("1.22 km", 0.0, 5),
        (f"{0.55 * CELL}", 0.55 * CELL, 5),
        (1.0, 0.0, 1),
        (None, 0.0, 1),
    ):
        sea(rock_json=collection(feature("Point", [0.005, 0.005], Radius=given)))
        assert closed(tmp_path / "rock.json", EQUATOR, buffer=buffer).sum() == count, given
    for given in (-1, "wide", 1e9, "2 min"):
        sea(rock_json=collection(feature("Point", [0.005, 0.005], radius=given)))
        with pytest.raises(InputError, match=r"features\.0: radius: .*; allowed: "):
            closed(tmp_path / "rock.json", EQUATOR)
    sea(cells_csv="x,y,radius\n3,3,500\n")
    with caplog.at_level(logging.WARNING):
        assert closed(tmp_path / "cells.csv", EQUATOR).sum() == 1
    assert "cells.csv: the column radius is not used" in caplog.text


@pytest.mark.parametrize(
    "said", [{"radius_m": "1223"}, {"Radius (m)": 1223}, {"RADIUS_KM": 1.22}, {"radius nm": 0.66}]
    + [{"radius [ft]": "4010"}, {"zone": {"radius": "1.22 km"}}, {"radius": 9, "radius_m": 1223}],
)  # fmt: skip
def test_columns_of_radii_have_units_in_their_names(said, sea, tmp_path):
    sea(rock_json=collection(feature("Point", [0.005, 0.005], **said)))
    assert closed(tmp_path / "rock.json", EQUATOR).sum() == 5


def test_zones_of_ed_318_are_read_with_their_extent_and_layer(sea, tmp_path, caplog):
    """Also where the parts of a collection have their own."""
    circle = feature("Point", [0.005, 0.005])
    circle["geometry"]["extent"] = {"subType": "Circle", "radius": 1.1 * CELL}
    circle["geometry"]["layer"] = {"lower": 0, "lowerReference": "AGL", "upper": 120, "uom": "m"}
    sea(zone_json=collection(circle))
    assert closed(tmp_path / "zone.json", EQUATOR).sum() == 5
    high = {**circle["geometry"], "coordinates": [0.035, 0.005], "layer": {"lower": 300}}
    both = feature("GeometryCollection", [])
    both["geometry"]["geometries"] = [circle["geometry"], high]
    sea(zones_json=collection(both))
    with caplog.at_level(logging.WARNING):
        assert closed(tmp_path / "zones.json", EQUATOR).sum() == 5 + 4
    [note] = caplog.messages
    assert "limits of altitude features.0.geometry.geometries.1 lie above or below" in note


@pytest.mark.parametrize(
    ("said", "is_told"),
    [
        ({"lower": 0, "upper": 120}, False),
        ({"lower": "GND", "upper": "FL100"}, False),
        ({"lower": "300 m"}, True),
        ({"lowerLimit": {"value": 1000, "unit": 1, "referenceDatum": 1}}, True),
        ({"lower_limit_height": 30, "lower_limit_unit": "FT", "lower_limit_ref": "AGL"}, False),
        ({"lower_limit_height": 40, "lower_limit_unit": "FT"}, True),
        ({"upper": 5, "upper_unit": "FL", "lower": 30, "lower_unit": "FT"}, False),
        ({"floor": 1, "floor_unit": "FL"}, True),
        ({"upper": 5, "uom": "m"}, True),
    ],
)  # fmt: skip
def test_zones_above_the_uavs_are_told(said, is_told, sea, tmp_path, caplog):
    """They close their cells; the UAVs fly 10 m high."""
    sea(zone_json=collection(feature("Point", [0.005, 0.005], **said)))
    with caplog.at_level(logging.WARNING):
        assert closed(tmp_path / "zone.json", EQUATOR).sum() == 1
    assert ("features.0 lie above or below the UAVs, 10 m high" in caplog.text) is is_told


def test_what_a_file_says_of_extent_and_is_not_read_is_told(sea, tmp_path, caplog):
    lane = feature("LineString", [[-1, 0], [1, 0]], width_m=500, radius=40)
    sea(
        a_json=collection(
            lane, feature("Point", [0, 0], Diameter=30, radius=2, range_nm=3, orange=1)
        ),
        b_csv="x,y,radius_m\n3,3,500\n",
        c_txt="........\n" * 6,
        d_json=collection(
            feature("Polygon", [[[-1, 0.001], [1, -0.03], [1, -0.025], [-1, 0.001]]])
        ),
    )
    with caplog.at_level(logging.WARNING):
        closed(tmp_path / "a.json", EQUATOR, colours=("#00ff00",))
        closed(tmp_path / "b.csv", EQUATOR, touched=True)
        closed(tmp_path / "c.txt", EQUATOR, buffer=100.0, width=3.0)
        closed(tmp_path / "d.json", EQUATOR)
    notes = [line.partition(": ")[2].partition(": ")[2] for line in caplog.messages]
    assert [line.replace(f"{tmp_path}/", "") for line in notes] == [
        "a.json is a file of places, for which colours has no effect",
        "a.json: Diameter, radius, range_nm, width_m of its places is not read; width and buffer "
        "are",
        "b.csv is a table of cells, for which touched has no effect",
        "b.csv: the column radius is not used, since its places are cells and no degrees",
        "c.txt is a map, for which buffer, width has no effect",
        "d.json: features.0 are narrower than a cell at places that stay open; touched = true "
        "closes all cells that they touch",
    ]


def test_where_that_takes_nothing_is_refused(sea, tmp_path):
    land = collection(
        feature("Point", [0, 0], country="DK"), feature("Point", [0, 0], country="DE")
    )
    sea(land_json=land)
    for where, line in (
        (
            {"country": "dk"},
            "where: no place has country = 'dk' .did you mean DK.*; allowed: DK, DE",
        ),
        ({"Country": "DK"}, "has no Country .did you mean country.*; allowed: id, country"),
        ({"country": "DK", "id": "7"}, "where: no place has id = '7'; allowed: None"),
    ):
        with pytest.raises(InputError, match=line):
            closed(tmp_path / "land.json", EQUATOR, where=where)
        with pytest.raises(InputError, match=line):
            NodesFound.read(tmp_path / "land.json", NodesFile(file="land.json", where=where))


def test_a_note_is_not_told_before_a_refusal(sea, caplog):
    far = collection(feature("Polygon", [box(9, 9, 10, 10)]))
    lines = f'nodes = "n.csv"\nno_fly = "far-away.json"\ngrid = 8\ncell_size = {CELL}\n'
    path = sea(lines + "zone = [0, 0, 2, 2]\n", n_csv="lon,lat\n0.005,0.005\n")
    (path.parent / "far-away.json").write_text(json.dumps(far))
    with caplog.at_level(logging.WARNING), pytest.raises(InputError, match="zone: "):
        load_scenario(path, zone=[7, 7, 2, 2])
    assert not caplog.messages
    with caplog.at_level(logging.WARNING):
        load_scenario(path)
    assert "far-away.json closes no cell" in caplog.text


# --- coasts as they are published ---


def test_a_coast_is_read_as_it_is_published(sea, tmp_path):
    """Rounding beyond 180 degrees, features elsewhere and of all kinds, empty ones, and large."""
    empty = {"type": "Feature", "geometry": None, "properties": None}
    mixed = {"type": "GeometryCollection", "geometries": []}
    mixed["geometries"] = [feature("Polygon", [box(0, 0, 0.0101, 0.0101)])["geometry"]]
    far = [180.00000000000003, 1.0]
    coast = collection(
        feature("Polygon", [[[179, 0], far, [179, 2], [179, 0]]], note="x" * 2**21),
        feature("Polygon", []),
        feature("MultiPoint", [[-0.005, -0.005]]),
        empty,
        {"type": "Feature", "geometry": mixed},
    )
    sea(coast_geojson=b"\xef\xbb\xbf" + json.dumps(coast).encode())
    cells = closed(tmp_path / "coast.geojson", EQUATOR)
    assert np.argwhere(cells).tolist() == [[2, 4], [3, 3]]


# --- several nodes in a cell ---

NEAR = "lon,lat,name\n0,0,A\n0.0001,-0.0001,B\n0.5,0.1,C\n-0.5,-0.1,D\n0,0,E\n"
GRID = f"grid = 120\ncell_size = {CELL}\nzone = [0, 0, 2, 2]\n"


def test_nodes_of_a_cell_are_merged_with_their_data_and_rates(sea):
    nodes = 'nodes = {file = "n.csv", place = "merge"}\n'
    space = load_scenario(sea(nodes + GRID + "uavs = 2\ninitial_data = [5, 20]", n_csv=NEAR))
    assert space.names == ("A +2", "C", "D")
    assert space.arrivals.merged == (3, 1, 1)
    assert space.node_data == ((15.0, 60.0), (5.0, 20.0), (5.0, 20.0))
    assert "5 nodes in 3 cells; those of one cell are one node" in node_placing_sentence(space)
    space = load_scenario(sea(nodes + GRID, n_csv=NEAR), arrival_rate=0.25)
    assert space.node_rates == (0.75, 0.25, 0.25)


def test_a_node_whose_cell_is_taken_or_closed_takes_the_nearest_free_one(sea):
    lines = 'nodes = {file = "n.csv", place = "nearest"}\nno_fly = [[1, 1]]\ngrid = 6\n'
    table = "x,y\n1,1\n4,4\n4,4\n4,4\n"
    space = load_scenario(sea(lines + "zone = [0, 4, 1, 1]\nuavs = 1", n_csv=table))
    steps = [
        abs(x - a) + abs(y - b)
        for (x, y), a, b in zip(space.nodes, (1, 4, 4, 4), (1, 4, 4, 4), strict=True)
    ]
    assert (steps, len({*space.nodes}), space.moved) == ([1, 0, 1, 1], 4, (0, 2, 3))
    assert "Of the 4 nodes, 3 are in the nearest free cell" in node_placing_sentence(space)


def test_the_advice_for_shared_cells_can_be_followed(sea):
    """Where no cell size parts the nodes, none is named; otherwise the one that is does."""
    pairs = {"0.0011,-0.0011": False, "0.001,-0.001": False, "0.007,-0.005": True}
    for other, is_parted in pairs.items():
        table = f"lon,lat\n0.001,-0.001\n{other}\n0.5,0.1\n-0.5,-0.1\n"
        with pytest.raises(InputError, match="lie in one cell") as error:
            load_scenario(sea('nodes = "n.csv"\n' + GRID, n_csv=table))
        _, _, advice = str(error.value).partition("; allowed: ")
        assert 'place = "merge", place = "nearest"' in advice
        assert ("cell_size" in advice) == is_parted
        if is_parted:
            words = advice.replace(",", "").split()
            size, grid = float(words[words.index("as") + 1]), int(words[words.index("grid") + 2])
            space = load_scenario(tmp_of(sea), cell_size=size, grid=grid)
            assert len(space.nodes) == 4


def tmp_of(sea: Sea) -> Path:
    """The scenario that was written last."""
    return sea.__closure__[0].cell_contents / "sea.toml"  # type: ignore[attr-defined]


# --- columns ---

# Heads and rows of tables of the same two buoys.
TABLES = [
    "Longitude,Latitude,Name\n0.005,0.005,Alpha\n-0.005,-0.005,Beta\n",
    "LON,LAT,ID\n0.005,0.005,Alpha\n-0.005,-0.005,Beta\n",
    "label;lng;lat\nAlpha;0,005;0,005\nBeta;-0,005;-0,005\n",
    "long\tlatitude\tname\n0.005\t0.005\tAlpha\n-0.005\t-0.005\tBeta\n",
    "name,X,Y\nAlpha,4,2\nBeta,3,3\n",
    "\ufeff\nname,X,Y\nAlpha,4,2\nBeta,3,3\n",
    "\ufeffsep=;\r\nlabel;lng;lat\r\nAlpha;0,005;0,005\r\nBeta;-0,005;-0,005\r\n",
]


@pytest.mark.parametrize("table", TABLES)
def test_columns_and_numbers_are_read_as_people_write_them(table, sea):
    lines = f'nodes = "n.csv"\ngrid = 8\nrows = 6\ncell_size = {CELL}\nzone = [0, 0, 2, 2]\n'
    space = load_scenario(sea(lines, n_csv=table))
    assert (space.nodes, space.names) == (((4, 2), (3, 3)), ("Alpha", "Beta"))


def test_a_column_gives_each_node_its_rate_and_initial_data(sea):
    """Both engines have them, and the mean of arrivals is that of each node."""
    table = "x,y,rate,data\n3,3,2.5,0\n5,3,0,40\n"
    lines = 'nodes = "n.csv"\ngrid = 8\nzone = [0, 0, 2, 2]\nuavs = 1\nmax_slots = 200\n'
    space = load_scenario(sea(lines, n_csv=table))
    log = simulate(space, load_team("greedy"), 1, 0, events=True)
    events = log.events.columns()
    of_node = {k: events["node"] == k for k in (0, 1)}
    begins, arrives = (events["event"] == name for name in ("mission_start", "arrival"))
    assert [events["value"][begins & of_node[k]].tolist() for k in (0, 1)] == [[0.0], [40.0]]
    assert not (arrives & of_node[1]).any()
    mean = events["value"][arrives & of_node[0]].sum() / log.slots
    assert abs(mean - 2.5) < 4 * (2.5 / log.slots) ** 0.5
    batch = simulate_batch(space, load_team("greedy"), 1, 3)
    assert batch.missions[0] == log.metrics
    with pytest.raises(InputError, match="n.csv: line 3: rate is 'some'; allowed: a number"):
        load_scenario(sea(lines, n_csv="x,y,rate\n1,1,1\n2,2,some\n"))


def test_an_empty_field_of_a_node_is_that_of_the_scenario(sea):
    table = "x,y,rate,data\n3,3,2.5,\n5,3,,40\n"
    lines = 'nodes = "n.csv"\ngrid = 8\nzone = [0, 0, 2, 2]\narrival_rate = 0.5\n'
    space = load_scenario(path := sea(lines + "initial_data = 7", n_csv=table))
    assert (space.arrivals.rates, space.arrivals.initial) == ((2.5, 0.5), (7.0, 40.0))
    # What is set for all nodes replaces what each has.
    assert load_scenario(path, arrival_rate=0.25).node_rates == (0.25, 0.25)
    assert type(space).of(space, initial_data=3).node_data == ((3.0, 3.0), (3.0, 3.0))
    with pytest.raises(InputError, match="line 2: data: is empty; allowed: a number, or one in"):
        load_scenario(sea(lines + "initial_data = [5, 20]", n_csv=table))
    with pytest.raises(InputError, match=r"line 3: rate: '101' is out of range; allowed: 0\.\.100"):
        load_scenario(sea(lines, n_csv=table.replace(",,40", ",101,40")))
    with pytest.raises(InputError, match="may part thousands or decimals; allowed: 1000 or 1.000"):
        load_scenario(sea(lines, n_csv="x;y;rate\n3;3;1,000\n"))


def test_nodes_are_chosen_by_their_properties(sea, tmp_path):
    kinds = [("DK1", "up", 0.1), ("DK2", "down", 0.2), ("NO1", "up", 0.3)]
    places = [
        feature("Point", [lon, 0.0], Code=code, State=s, Title=f"T {code}")
        for code, s, lon in kinds
    ]
    land = feature("Polygon", [box(9, 9, 10, 10)], Code="DK3")
    sea(n_geojson=collection(*places, land))
    where = {"Code": "DK*", "State": "up"}
    source = NodesFile(file="n.geojson", where=where, name="Title")
    found = NodesFound.read(tmp_path / "n.geojson", source)
    fields = found.fields((8, 6), EQUATOR._replace(centre=(0.1, 0.0)), np.zeros((6, 8), bool))
    assert (fields["nodes"], fields["names"]) == ([(4, 3)], ["T DK1"])


def test_marks_folders_and_backslashes(sea, tmp_path):
    lines = 'nodes = "data/n.csv"\ngrid = 8\nzone = [0, 0, 2, 2]\n'
    path = sea(lines, data__n_csv="x,y\n3,3\n")
    assert load_scenario(path).nodes == ((3, 3),)
    path.write_bytes(b"\xef\xbb\xbf" + lines.encode())
    assert load_scenario(path).nodes == ((3, 3),)
    path.write_text(lines.replace('"data/n.csv"', r"'data\n.csv'"))
    with pytest.raises(InputError, match=r"'data\\\\n.csv' is no file; allowed: data/n.csv"):
        load_scenario(path)


# --- maps of the field ---


def test_maps_of_the_field(sea, tmp_path, caplog):
    """The header and letters of the MAPF benchmark, a blank first line, colours of a picture."""
    benchmark = "type octile\nheight 2\nwidth 3\nmap\n.@T\nGSW\n"
    pixels = np.zeros((2, 3, 3), np.uint8)
    pixels[0, 1], pixels[0, 2], pixels[1, 2] = (255, 0, 0), (255, 255, 0), (0, 255, 0)
    pixels[1, 0] = (0, 0, 255)
    sea(a_map=benchmark, b_txt="\n.@T\n...\n", c_png=b"")
    Image.fromarray(pixels).save(tmp_path / "c.png")
    grid = EQUATOR._replace(size=(3, 2))
    found = {name: closed(tmp_path / name, grid) for name in ("a.map", "b.txt", "c.png")}
    assert np.argwhere(found["a.map"]).tolist() == [[0, 1], [0, 2], [1, 2]]
    for name in ("b.txt", "c.png"):
        assert np.argwhere(found[name]).tolist() == [[0, 1], [0, 2]]
    green = closed(tmp_path / "c.png", grid, colours=("#00ff00",))
    assert np.argwhere(green).tolist() == [[1, 2]]
    with caplog.at_level(logging.WARNING):
        closed(tmp_path / "c.png", grid)
    assert "c.png: 1 pixels of #00ff00 close no cell; colours says which do" in caplog.text
    lines = 'zone = "c.png"\nno_fly = "c.png"\ngrid = 3\nrows = 2\nnodes = [[0, 0]]\nuavs = 1\n'
    assert load_scenario(sea(lines)).zone == (0, 1, 1, 1)
    pixels[:, 0] = (0, 0, 255)
    pixels[0, 1] = (0, 0, 255)
    Image.fromarray(pixels).save(tmp_path / "c.png")
    with pytest.raises(InputError, match=r"blue pixels at x 0..1, y 0..1 do not fill their rect"):
        load_scenario(sea(lines))
    Image.fromarray(0 * pixels).save(tmp_path / "c.png")
    with pytest.raises(InputError, match="has no blue pixels, of which zones are; allowed: one"):
        load_scenario(sea(lines))
    with pytest.raises(InputError, match="has 3 x 2 pixels; allowed: 4 x 2, as grid"):
        closed(tmp_path / "c.png", EQUATOR._replace(size=(4, 2)))
    with pytest.raises(InputError, match="d.png: is no picture"):
        closed(sea(d_png="no picture").with_name("d.png"), grid)


def test_ways_on_a_large_grid_are_the_shortest():
    """To parking cells and nodes, from them, and between any other cells."""
    wall = tuple((60, y) for y in range(100) if y != 7)
    chart = chart_at(120, 100, ((0, 0, 2, 2),), wall, ((110, 90), (30, 50)))
    assert chart.rows is not None and len(chart.ways) == 6
    ends = np.array([(0, 1), (110, 90), (30, 50), (5, 99), (90, 3), (60, 7)])
    pairs = np.array([(*a, *b) for a in ends for b in ends])
    found = compiled.distances(chart, pairs[:, 0], pairs[:, 1], pairs[:, 2:])
    ways = [spread(chart.zones, np.array([end]))[0].reshape(100, 120) for end in ends]
    assert found.tolist() == [way[y, x] for way in ways for x, y in ends]


# --- what is wrong with a sea ---


def test_all_bad_nodes_are_named_at_once(sea):
    table = "name,x,y\nA,1,1\nB,2,1\nC,7,7\nD,5,5\n"
    lines = 'nodes = "n.csv"\ngrid = 8\nzone = [4, 4, 2, 2]\nuavs = 1\n'
    islands = "no_fly = [[1, 1], [2, 1], [6, 7], [7, 6]]\n"
    line = (
        r"nodes: A at \[1, 1\], B at \[2, 1\] are no-fly cells, and C at \[7, 7\] cannot be reached"
    )
    with pytest.raises(InputError, match=line):
        load_scenario(sea(lines + islands, n_csv=table))
    with pytest.raises(InputError, match=r"line 4 \(C\) at \[7, 7\], line 5 \(D\) at .* off the"):
        load_scenario(sea(lines.replace("8", "5"), n_csv=table))


def test_the_error_of_distances_is_told_and_refused(sea, caplog):
    """Along the parallel at 60 + d degrees they are too long by cos(60) / cos(60 + d)."""
    lines = 'nodes = "n.csv"\ngrid = 60\ncell_size = 8000\nzone = [30, 30, 1, 1]\nuavs = 1\n'

    def load(half: float) -> Any:
        return load_scenario(sea(lines, n_csv=f"lon,lat\n8,{60 - half}\n8,{60 + half}\n"))

    def error(half: float) -> float:
        return math.cos(math.radians(60)) / math.cos(math.radians(60 + half)) - 1

    with caplog.at_level(logging.WARNING):
        assert distance_error(load(0.3)) == pytest.approx(error(0.3), abs=1e-3)
        assert not caplog.messages
        assert distance_error(load(1.0)) == pytest.approx(error(1.0), abs=1e-3)
    assert "sea.toml: distances between nodes and zones are up to 3 % wrong" in caplog.text
    with pytest.raises(InputError, match=r"centre: distances .* up to 6\.. % wrong.*less than 5 %"):
        load(2.0)
    assert distance_error(load_scenario("paper")) == 0


def test_charging_zones_are_places_on_the_earth(sea):
    """A zone lies as near about its place as cells allow."""
    place = "{lon = 0.01, lat = 0.0, width = 2, height = 2}"
    lines = f"grid = 8\nrows = 6\ncell_size = {CELL}\nnodes = [[0, 0]]\nuavs = 1\nzone = {place}\n"
    further = "[[zones]]\npads = 1\ncells = {lon = -0.025, lat = -0.025, width = 1, height = 1}\n"
    space = load_scenario(sea("centre = [0.0, 0.0]\n" + lines + further))
    assert space.rectangles == ((4, 2, 2, 2), (1, 5, 1, 1))
    with pytest.raises(InputError, match="zone: has degrees, and the nodes are cells; allowed: "):
        load_scenario(sea(lines))
    with pytest.raises(InputError, match="sea.toml: zone: lat: 91 is out of range"):
        load_scenario(sea(lines.replace("lat = 0.0", "lat = 91")))
