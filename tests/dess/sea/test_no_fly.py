"""No-fly cells from maps, tables and polygons: hand-worked cases, and refusals in one line."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess import InputError, load_scenario
from dess.sea.no_fly import centres_in, no_fly_in
from dess.sea.positions import Projection

# A cell is a hundredth of a degree of latitude and, at the equator, of longitude; 0, 0 is the
# centre of the grid.
EQUATOR = Projection((0.0, 0.0), (8, 6), 1111.95)

Write = Callable[[str, Any], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def write(name: str, content: Any) -> Path:
        path = tmp_path / name
        path.write_text(content if isinstance(content, str) else json.dumps(content))
        return path

    return write


def square(west: float, south: float, east: float, north: float) -> list[list[float]]:
    return [[west, south], [east, south], [east, north], [west, north], [west, south]]


def features(*geometries: tuple[str, Any]) -> dict[str, Any]:
    shapes = [{"type": kind, "coordinates": coordinates} for kind, coordinates in geometries]
    return {"type": "FeatureCollection", "features": [{"geometry": shape} for shape in shapes]}


def test_a_map_has_a_line_for_each_row_from_north_to_south(write: Write) -> None:
    path = write("islands.txt", "..#\r\n##.  \n\n")
    assert no_fly_in(path, (3, 2), None) == ((2, 0), (0, 1), (1, 1))


def test_a_table_has_cells_or_degrees(write: Write) -> None:
    cells = write("islands.csv", "name,x,y\na,2,1\nb,0,0\nc,2,1\n")
    assert no_fly_in(cells, (3, 2), None) == ((0, 0), (2, 1))
    degrees = write("rocks.csv", "lon,lat\n0.001,0.001\n-0.001,0.001\n0.0391,-0.0291\n")
    assert no_fly_in(degrees, (8, 6), EQUATOR) == ((3, 2), (4, 2), (7, 5))


def test_a_polygon_closes_the_cells_whose_centres_lie_in_it(write: Write) -> None:
    """From 1.6 to 6.4 cells in the west-east, 0.6 to 5.4 in the north-south: 2..5 and 1..4."""
    outer, hole = square(-0.024, -0.024, 0.024, 0.024), square(-0.011, -0.011, 0.011, 0.011)
    path = write("island.geojson", features(("Polygon", [outer, hole])))
    ring = {(x, y) for x in range(2, 6) for y in range(1, 5)} - {(3, 2), (4, 2), (3, 3), (4, 3)}
    assert {*no_fly_in(path, (8, 6), EQUATOR)} == ring


def test_what_lies_beyond_the_grid_is_cut(write: Write) -> None:
    """A polygon from beyond the north-western corner, and one of two islands, the other far off."""
    corner = [square(-1, 0.0105, -0.0205, 1)]
    far, near = [square(9, 9, 10, 10)], [square(0.0295, -0.0295, 0.035, -0.0205)]
    path = write("island.json", features(("Polygon", corner), ("MultiPolygon", [far, near])))
    assert no_fly_in(path, (8, 6), EQUATOR) == ((0, 0), (1, 0), (0, 1), (1, 1), (7, 5))


def test_polygons_share_the_projection_of_the_nodes(write: Write) -> None:
    """At 60 degrees north a degree of longitude is half as long; the box is not that of land."""
    write("buoys.csv", "lon,lat\n9.91,60.045\n10.09,59.955\n")
    write("land.geojson", features(("Polygon", [square(9.5, 60.0205, 10.041, 61)])))
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


def test_polygons_on_both_sides_of_the_180th_meridian(write: Write) -> None:
    path = write("land.geojson", features(("Polygon", [square(179.99, -0.0105, 179.995, 0.0105)])))
    projection = EQUATOR._replace(middle=(-179.995, 0.0))
    assert no_fly_in(path, (8, 6), projection) == ((2, 2), (2, 3))


@given(st.lists(st.tuples(*[st.integers(-3, 12)] * 2), min_size=3, max_size=9))
def test_a_mirrored_polygon_closes_mirrored_cells(corners: list[tuple[int, int]]) -> None:
    """The corners are a little off, so that no centre of a cell lies on an edge."""
    ring = np.array([*corners, corners[0]]) * [0.61, 0.57] + [0.013, 0.0071]
    inside = centres_in([ring], (6, 5))
    assert (centres_in([ring * [-1, 1] + [6, 0]], (6, 5)) == inside[:, ::-1]).all()
    assert (centres_in([ring[:, ::-1]], (5, 6)) == inside.T).all()
    assert (centres_in([ring[::-1]], (6, 5)) == inside).all()
    assert not centres_in([ring, ring], (6, 5)).any()  # a hole as large as the island


# --- refusals ---

SQUARE = square(0, 0, 1, 1)
REFUSED: dict[str, tuple[str, Any]] = {
    "has 1 lines; allowed: 2 lines of 3 cells, as grid and rows say": ("map.txt", "..#\n"),
    "line 2: has 2 cells; allowed: 2 lines of 3 cells": ("map.txt", "..#\n##\n"),
    "line 1: has 'x'; allowed: # for a no-fly cell, . for an open one": ("map.txt", ".x#\n##x\n"),
    "has no places; allowed: one or more": ("land.csv", "x,y\n"),
    r"line 2 is off the grid of 3 x 2 cells, at \[0, 2\]; allowed: 0 <= x < 3, 0 <= y < 2": (
        *("land.csv", "x,y\n0,2\n"),
    ),
    "line 2: y is 0.5; allowed: an integer": ("land.csv", "x,y\n0,0.5\n"),
    "has degrees, and the nodes are cells; allowed: cells, or nodes from": (
        *("land.geojson", features(("Polygon", [SQUARE]))),
    ),
    "has degrees, and the nodes are cells; allowed: cells": ("land.csv", "lon,lat\n8,54\n"),
    "has no known file ending; allowed: .txt, .csv, .geojson, .json": ("land.shp", ""),
}


@pytest.mark.parametrize("line", REFUSED)
def test_files_that_are_refused(line: str, write: Write) -> None:
    path = write(*REFUSED[line])
    with pytest.raises(InputError, match=f"^{path}: {line}") as error:
        no_fly_in(path, (3, 2), None)
    assert "\n" not in str(error.value)


SHAPES: dict[str, dict[str, Any]] = {
    "features: is missing; allowed: a list": {"type": "Polygon", "coordinates": [SQUARE]},
    "features: .* is too short": {"features": []},
    "features.0.geometry.type: 'Point' is unknown; allowed: Polygon, MultiPolygon": features(
        ("Point", [8, 54])
    ),
    "features.0.geometry.Polygon.coordinates.0: is no ring; allowed: four positions": features(
        ("Polygon", [SQUARE[:4]])
    ),
    "features.0.geometry.Polygon.coordinates.0.1: lat is 91; allowed: -90..90": features(
        ("Polygon", [[[8, 54], [8, 91], [9, 54], [8, 54]]])
    ),
    r"features.1 is off the grid of 8 x 6 cells, at \[804, -798\]; allowed: polygons with": (
        features(("Polygon", [SQUARE]), ("Polygon", [square(8.005, 8.005, 9, 9)]))
    ),
}


@pytest.mark.parametrize("line", SHAPES)
def test_polygons_that_are_refused(line: str, write: Write) -> None:
    path = write("land.json", SHAPES[line])
    with pytest.raises(InputError, match=f"^{path}: {line}") as error:
        no_fly_in(path, (8, 6), EQUATOR)
    assert "\n" not in str(error.value)


def test_a_file_of_no_fly_cells_lies_in_the_folder_of_its_scenario(write: Write) -> None:
    write("secret.txt", "password\n")
    sea = write("sea.toml", 'no_fly = "../secret.txt"\n')
    with pytest.raises(InputError, match="no_fly: '../secret.txt' is not in the same folder"):
        load_scenario(sea)
