"""Nodes and no-fly cells from files: hand-worked projections and polygons, refusals in one line."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess import InputError, load_scenario
from dess.physics.chart import Cell
from dess.scenario import no_fly
from dess.scenario.no_fly import NoFlyFile
from dess.scenario.nodes import NodesFile, NodesFound
from dess.scenario.polygons import centres_in
from dess.scenario.projection import Projection, Size
from tests.dess.scenario.shapes import EQUATOR, box, collection, feature
from tests.outside import install_package


def nodes_in(path: Path, size: Size, cell_size: float, **source: Any) -> tuple[Cell, ...]:
    """The cells of the nodes of a file, on a grid about their centre."""
    found = NodesFound.read(path, NodesFile(file=path.name, **source))
    projection = found.projection(size, cell_size)
    return tuple(found.fields(size, projection, np.zeros(size[::-1], np.bool_))["nodes"])


def no_fly_in(
    path: Path, size: Size, projection: Projection | None, **source: Any
) -> tuple[Cell, ...]:
    """The no-fly cells of a file, row by row."""
    closed = no_fly.no_fly_in(path, size, projection, NoFlyFile(file=path.name, **source), 10.0)
    return tuple((x, y) for y, x in np.argwhere(closed).tolist())


Write = Callable[[str, Any], Path]


@pytest.fixture
def write(tmp_path):
    def write(name: str, content: Any) -> Path:
        path = tmp_path / name
        if isinstance(content, bytes):
            path.write_bytes(content)
        elif content is not None:
            path.write_text(content if isinstance(content, str) else json.dumps(content), "utf-8")
        return path

    return write


def features(*geometries: tuple[str, Any]) -> dict[str, Any]:
    return collection(*(feature(*geometry) for geometry in geometries))


def points(*places: tuple[float, ...]) -> dict[str, Any]:
    return features(*(("Point", place) for place in places))


# --- nodes ---


def test_degrees_are_projected_about_the_centre_of_their_box(write):
    """At 60 degrees north a degree of longitude is half a degree of latitude long: 55,597 m."""
    places = [(10.0, 60.0), (9.91, 60.0), (10.09, 60.0), (10.0, 60.045), (10.0, 59.955)]
    # 0.09 x 55,597 m = 5,004 m and 0.045 x 111,195 m = 5,004 m: five cells of 1 km and a bit.
    expected = ((10, 10), (4, 10), (15, 10), (10, 4), (10, 15))
    rows = "".join(f"{lon},{lat}\n" for lon, lat in places)
    assert nodes_in(write("buoys.csv", f"lon,lat\n{rows}"), (20, 20), 1000.0) == expected
    altitudes = points(*((*place, 0.5) for place in places))
    assert nodes_in(write("buoys.json", altitudes), (20, 20), 1000.0) == expected
    across = [(lon + 170 - 360 * (lon >= 10), lat - 60) for lon, lat in places]
    rows = "".join(f"{lon},{lat}\n" for lon, lat in across)  # at the 180th meridian and equator
    found = nodes_in(write("across.csv", f"lon,lat\n{rows}"), (40, 40), 1000.0)
    assert len({x for x, _ in found}) == 3


def test_longitudes_go_on_beyond_the_180th_meridian():
    """In places on the Earth, and in the centre of nodes on its both sides."""
    projection = Projection.about(np.array([[179.9, 53.0], [-179.7, 53.0]]), (40, 8), 1000.0)
    assert projection.centre == pytest.approx((-179.9, 53.0))
    row = np.stack([np.arange(41.0), np.full(41, 4.0)], axis=1)
    degrees = projection.degrees(row)
    assert np.allclose(np.diff(degrees[:, 0]), np.diff(degrees[:2, 0]))
    assert np.allclose(projection.cells(degrees), row)


def test_a_grid_that_is_not_square_has_the_same_centre(write):
    """0.09 degrees of latitude at the equator are ten cells of 1 km and a bit."""
    path = write("buoys.csv", "lon,lat\n0,0.045\n0,-0.045\n0.045,0\n-0.045,0\n")
    assert nodes_in(path, (20, 12), 1000.0) == ((10, 0), (10, 11), (15, 6), (4, 6))
    with pytest.raises(InputError, match=r"at \[10, -1\].*; allowed: grid = 20, rows = 12 or"):
        nodes_in(path, (20, 10), 1000.0)


def test_a_scenario_names_a_file_beside_it(write, tmp_path):
    """It may be a link within the folder."""
    write("buoys.csv", "lon,lat\n8.50,54.25\n8.52,54.26\n")
    (tmp_path / "nodes.csv").symlink_to("buoys.csv")
    path = write("sea.toml", 'nodes = "nodes.csv"\ngrid = 12\nzone = [0, 0, 2, 2]\n')
    space = load_scenario(path)
    # 0.02 degrees are 1,299 m at 54.255 degrees: 0.8 cells to both sides; 0.7 cells north, south.
    assert space.nodes == ((5, 6), (6, 5))
    assert load_scenario(path, grid=14).nodes == ((6, 7), (7, 6))
    assert load_scenario(path, nodes=[[1, 2]]).nodes == ((1, 2),)
    assert load_scenario(write("again.toml", space.to_toml())) == space


@pytest.mark.parametrize(
    "name", ["../secret.csv", "{}/secret.csv", "in/../../secret.csv", "link.csv", "deep.csv"]
    + ["in/../../sea/../secret.csv", "", "..", ".", "a\0b", "/etc/passwd", "/etc/shadow"]
    + ["loop/secret.csv", "out/secret.csv"],
)  # fmt: skip
@pytest.mark.parametrize("key", ["nodes", "no_fly"])
def test_a_table_lies_in_the_folder_of_its_scenario(key, name, tmp_path):
    """What a stranger's scenario names elsewhere is neither read nor shown, be it by a link."""
    secret, folder = tmp_path / "secret.csv", tmp_path / "sea"
    secret.write_text("password\n")
    (folder / "in").mkdir(parents=True)
    (folder / "in" / "own.csv").write_text("password\n")
    (folder / "link.csv").symlink_to(secret)
    (folder / "deep.csv").symlink_to("in/../../secret.csv")
    (folder / "out").symlink_to(tmp_path)
    (folder / "loop").symlink_to("loop")
    path, named = folder / "sea.toml", json.dumps(name.format(tmp_path))
    path.write_text(f"{key} = {named}\n")
    lines = f"^{path}: {key}: .*allowed: the name of a file|^{folder}/loop/secret.csv: cannot be"
    with pytest.raises(InputError, match=lines) as error:
        load_scenario(path)
    assert "password" not in str(error.value)


# --- no-fly cells ---


def test_a_table_has_cells_or_degrees(write):
    cells = write("islands.csv", "name,x,y\na,2,1\nb,0,0\nc,2,1\n")
    assert no_fly_in(cells, (3, 2), None) == ((0, 0), (2, 1))
    degrees = write("rocks.csv", "lon,lat\n0.001,0.001\n-0.001,0.001\n0.0391,-0.0291\n")
    assert no_fly_in(degrees, (8, 6), EQUATOR) == ((3, 2), (4, 2), (7, 5))


def test_a_polygon_closes_the_cells_whose_centres_lie_in_it(write):
    """From 1.6 to 6.4 cells in the west-east, 0.6 to 5.4 in the north-south: 2..5 and 1..4."""
    outer, hole = box(-0.024, -0.024, 0.024, 0.024), box(-0.011, -0.011, 0.011, 0.011)
    path = write("island.geojson", features(("Polygon", [outer, hole])))
    ring = {(x, y) for x in range(2, 6) for y in range(1, 5)} - {(3, 2), (4, 2), (3, 3), (4, 3)}
    assert {*no_fly_in(path, (8, 6), EQUATOR)} == ring


def test_what_lies_beyond_the_grid_is_cut(write):
    """A polygon from beyond the north-western corner, and one of two islands, the other far off."""
    corner = [box(-1, 0.0105, -0.0205, 1)]
    far, near = [box(9, 9, 10, 10)], [box(0.0295, -0.0295, 0.035, -0.0205)]
    path = write("island.json", features(("Polygon", corner), ("MultiPolygon", [far, near])))
    assert no_fly_in(path, (8, 6), EQUATOR) == ((0, 0), (1, 0), (0, 1), (1, 1), (7, 5))


def test_polygons_share_the_projection_of_the_nodes(write):
    """At 60 degrees north a degree of longitude is half as long; the box is not that of land."""
    write("buoys.csv", "lon,lat\n9.91,60.045\n10.09,59.955\n")
    write("land.geojson", features(("Polygon", [box(9.5, 60.0205, 10.041, 61)])))
    sea = write(
        "sea.toml",
        'nodes = "buoys.csv"\nno_fly = "land.geojson"\ngrid = 12\nzone = [9, 4, 2, 2]\n'
        "cell_size = 1111.95\n",
    )
    # The centre of the grid is 10 E, 60 N: land is west of 6 + 2 cells, and north of 6 - 2.
    land = {(x, y) for x in range(8) for y in range(4)}
    with pytest.raises(InputError, match=r"sea.toml: nodes: \[1, 1\] is a no-fly cell"):
        load_scenario(sea)
    assert {*load_scenario(sea, nodes=[[1, 9]]).no_fly} == land
    assert load_scenario(sea, no_fly=[]).nodes == ((1, 1), (10, 10))


@given(st.lists(st.tuples(*[st.integers(-3, 12)] * 2), min_size=3, max_size=9))
def test_a_mirrored_polygon_closes_mirrored_cells(corners):
    """The corners are a little off, so that no centre of a cell lies on an edge."""
    ring = np.array([*corners, corners[0]]) * [0.61, 0.57] + [0.013, 0.0071]
    inside = centres_in([ring], (6, 5))
    assert (centres_in([ring * [-1, 1] + [6, 0]], (6, 5)) == inside[:, ::-1]).all()
    assert (centres_in([ring[:, ::-1]], (5, 6)) == inside.T).all()
    assert (centres_in([ring[::-1]], (6, 5)) == inside).all()
    assert not centres_in([ring, ring], (6, 5)).any()  # a hole as large as the island


# --- refusals ---

LINE = {"features": [{"geometry": {"type": "LineString", "coordinates": [8, 54]}}]}
ODD = features(("Circle", [8, 54]))
# Of nodes on a grid of 8 x 8 cells of 800 m: the name of a file, what it has, and the line.
NODES: list[tuple[str, Any, str]] = [
    ("n.csv", "", "has columns none; allowed: x and y, or lon and lat"),
    ("n.csv", "lat,y\n8,54\n", "has columns lat, y; allowed"),
    (
        *("n.csv", "x,Y,lon,lat\n1,1,8,54\n"),
        "has columns x, Y, lon, lat; allowed: one pair: x and y are cells, lon and lat degrees",
    ),
    ("n.csv", "sep=;\nx;y\n1;1\n2;one\n", "line 4: y is 'one'; allowed: a number"),
    ("n.csv", "sep=|\r\nx;y\r\n1;1\r\n", "has columns x;y; allowed: x and y, or lon and lat"),
    ("n.csv", "x,y\n", "has 0 nodes; allowed: 1..1024"),
    ("n.csv", "x,y\n1,1\n\n2\n", "line 4: y is ''; allowed: a number"),
    ("n.csv", "x,y\nnan,1\n", "line 2: x is nan; allowed: -99,999..99,999"),
    ("n.csv", "x,y\n1.5,1\n", "line 2: x is 1.5; allowed: an integer"),
    ("n.csv", "x,y\n1,-1\n", r"line 2 at \[1, -1\] is off .*8 x 8 .*; allowed: 0 <= x, y < 256"),
    ("n.csv", "x,y\n1,1\n3,11\n", r"line 3 at \[3, 11\] is off .*; allowed: grid = 12 or more$"),
    ("n.csv", "x,y\n1,999\n", ".*allowed: 0 <= x, y < 256"),
    ("n.csv", "x,y\n1,1\n2,2\n1,1\n", r"line 2 and line 4 lie in one cell, \[1, 1\]; .* distinct"),
    ("n.csv", "lon,lat\n181,54\n", "line 2: lon is 181; allowed: -180..180"),
    (
        "n.csv",
        "lon,lat\n8,54\n8.02,54.02\n8.001,54.001\n",
        "line 2 .*cell_size below 800 m, such as",
    ),
    (
        "n.csv",
        "lon,lat\n8,54\n8.02,54.02\n8,54\n",
        'line 2 and .*; allowed: place = "merge", place',
    ),
    # 0.09 degrees are 10,008 m, 12.5 cells: 6.25 to both sides of the middle, at 4.
    (
        "n.csv",
        "lon,lat\n0,0\n0,0.09\n",
        r"line 2 at \[4, 10\].*; allowed: grid = 14 or more, or a",
    ),
    ("n.csv", "lon,lat\n0,0\n0,80\n", ".*off the grid .*; allowed: a larger cell_size$"),
    ("n.csv", 'x,y\n"1,1\n', "is not a CSV file"),
    ("n.csv", b"x,y\n\xff", "cannot be read: it is not text"),
    ("n.csv", b"x,y\n" + b"\n" * 2**26, "is too large; allowed: 67,108,864 bytes at most"),
    ("none.csv", None, "no such file; allowed: a CSV file"),
    ("n.xlsx", "", "has no known file ending; allowed: .csv, .tsv, .geojson, .json"),
    ("n.json", "{", "not valid JSON"),
    ("n.json", {"type": "Point"}, "features: is missing; allowed: a list"),
    ("n.json", LINE, "features.0.geometry.coordinates: has not two numbers; allowed: "),
    ("n.json", ODD, "features.0.geometry.type: 'Circle' is unknown; allowed: Point, "),
    ("n.json", features(("Polygon", [box(0, 0, 1, 1)])), "has 0 nodes; allowed: 1..1024"),
    ("n.json", points((8,)), "features.0.geometry.coordinates: has not two numbers; allowed: "),
    ("n.json", points((8, 91)), "features.0.geometry.coordinates: lat is 91; allowed: -90..90"),
    ("n.json", points((8, 54), (8, 54)), "features.0 and features.1 lie in one cell"),
]
RING, SHAPE = box(0, 0, 1, 1), "features.0.geometry.coordinates.0"
DEGREES = "has degrees, and the nodes are cells; allowed: cells, nodes from a file with degrees, or"
# Of no-fly cells on a grid of 3 x 2 cells, or of 8 x 6 where the nodes have degrees.
NO_FLY: list[tuple[str, Any, str]] = [
    ("map.txt", "..#\n", "has 1 lines; allowed: 2 lines of 3 cells, as grid and rows say"),
    ("map.txt", "..#\n##\n", "line 2: has 2 cells; allowed: 2 lines of 3 cells"),
    ("map.txt", ".x#\n##x\n", "line 1: has 'x'; allowed: # for a no-fly cell, . for an open one"),
    ("land.csv", "x,y\n", "has no places; allowed: one or more"),
    ("land.csv", "x,y\n0,2\n", r"line 2 .* 3 x 2 cells, at \[0, 2\]; allowed: 0 <= x < 3, 0"),
    ("land.csv", "lon,lat\n8,54\n", DEGREES),
    ("land.geojson", features(("Polygon", [RING])), DEGREES),
    ("land.shp", "", "has no known file ending; allowed: .txt, .map, .png, .csv, .tsv, .geojson"),
]
_SHORT = {"type": "LineString", "coordinates": [[8, 54]]}
COLLECTED = collection(feature("GeometryCollection", []))
COLLECTED["features"][0]["geometry"]["geometries"] = [_SHORT]
POLYGONS: list[tuple[str, Any, str]] = [
    ("p.json", {"features": []}, "features: .* is too short"),
    ("p.json", features(("Polygon", [RING[:4]])), f"{SHAPE}: is no ring; allowed: four positions"),
    (
        *("p.json", features(("Polygon", [[[8, 54], [8, 91], [9, 54], [8, 54]]]))),
        f"{SHAPE}.1: lat is 91; allowed: -90..90",
    ),
    ("p.json", features(("LineString", [[8, 54]])), f"{SHAPE[:-2]}: is no line; allowed: two"),
    ("p.json", features(("MultiLineString", [[[8, 54]]])), f"{SHAPE}: is no line; allowed: "),
    ("p.json", COLLECTED, "features.0.geometry.geometries.0.coordinates: is no line; allowed: two"),
    ("p.json", features(("MultiPolygon", [5])), "features.0.geometry.coordinates.0.0: has not two"),
]
READERS: dict[Any, list[tuple[str, Any, str]]] = {
    (nodes_in, (8, 8), 800.0): NODES,
    (no_fly_in, (3, 2), None): NO_FLY,
    (no_fly_in, (8, 6), EQUATOR): POLYGONS,
}
REFUSED = [(reader, *row) for reader, rows in READERS.items() for row in rows]


@pytest.mark.parametrize(
    ("reader", "name", "content", "line"), REFUSED, ids=[row[3][:40] for row in REFUSED]
)
def test_files_that_are_refused(reader, name, content, line, write):
    (read, *arguments), path = reader, write(name, content)
    with pytest.raises(InputError, match=f"^{path}: {line}") as error:
        read(path, *arguments)
    assert "\n" not in str(error.value)


# --- readers of other packages ---

GPX = """<gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1">
<wpt lat="54.005" lon="8.0"><name>North</name></wpt>
<wpt lat="53.995" lon="8.0"><name>South</name></wpt>
</gpx>"""
READER = '''
from xml.etree import ElementTree

import numpy as np

from dess.scenario.places import POINT, Place, Places

NAMES = {"": "http://www.topografix.com/GPX/1/1"}


def read_gpx(path):
    """The waypoints of a GPX file."""
    places = []
    for number, point in enumerate(ElementTree.parse(path).iterfind("wpt", NAMES)):
        spot = np.array([[float(point.get("lon")), float(point.get("lat"))]])
        name = point.findtext("name", "", NAMES)
        places.append(Place(f"wpt {number}", {"name": name}, [(POINT, [spot])]))
    return Places(True, places)
'''


def test_a_package_reads_files_of_another_ending(tmp_path, monkeypatch):
    """Nodes and no-fly cells come from the waypoints of a GPX file; a broken file is named."""
    (tmp_path / "buoys.gpx").write_text(GPX)
    sea = tmp_path / "sea.toml"
    sea.write_text('nodes = "buoys.gpx"\ngrid = 16\ncell_size = 100\nzone = [0, 0, 4, 1]\n')
    with pytest.raises(InputError, match="has no known file ending; allowed: .csv, .tsv"):
        load_scenario(sea)
    entry = {".gpx": "gpx_reader:read_gpx"}
    install_package(tmp_path / "site", monkeypatch, "gpx_reader", READER, "dess.readers", **entry)
    assert load_scenario(sea).names == ("North", "South")
    assert [y for _, y in load_scenario(sea).nodes] == [2, 13]
    sea.write_text(sea.read_text() + 'no_fly = {file = "buoys.gpx", where = {name = "South"}}\n')
    with pytest.raises(InputError, match="South at .* is a no-fly cell"):
        load_scenario(sea)
    (tmp_path / "buoys.gpx").write_text("<gpx>")
    line = "buoys.gpx: cannot be read by gpx_reader:read_gpx: ParseError: .*; allowed: a .gpx file"
    with pytest.raises(InputError, match=line):
        load_scenario(sea)
