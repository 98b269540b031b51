"""Nodes from files: hand-worked projections, and refusals in one clear line."""

import json
from pathlib import Path
from typing import Any

import pytest

from dess import InputError, load_scenario
from dess.sea import positions
from dess.sea.nodes import nodes_in


def _csv(folder: Path, text: str) -> Path:
    path = folder / "buoys.csv"
    path.write_text(text, "utf-8")
    return path


def _geojson(folder: Path, *features: Any) -> Path:
    path = folder / "buoys.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}), "utf-8")
    return path


def _point(*coordinates: float) -> dict[str, Any]:
    return {"type": "Feature", "geometry": {"type": "Point", "coordinates": coordinates}}


def test_columns_x_and_y_are_cells(tmp_path: Path) -> None:
    text = "\ufeffname, y ,x\na,3,1\n\nb,0,7\r\n"
    assert nodes_in(_csv(tmp_path, text), (8, 8), 800.0) == ((1, 3), (7, 0))


def test_degrees_are_projected_about_the_centre_of_their_box(tmp_path: Path) -> None:
    """At 60 degrees north a degree of longitude is half a degree of latitude long: 55,597 m."""
    places = [(10.0, 60.0), (9.91, 60.0), (10.09, 60.0), (10.0, 60.045), (10.0, 59.955)]
    # 0.09 x 55,597 m = 5,004 m and 0.045 x 111,195 m = 5,004 m: five cells of 1 km and a bit.
    expected = ((10, 10), (4, 10), (15, 10), (10, 4), (10, 15))
    rows = "".join(f"{lon},{lat}\n" for lon, lat in places)
    assert nodes_in(_csv(tmp_path, f"lon,lat\n{rows}"), (20, 20), 1000.0) == expected
    across = [(lon + 170 - 360 * (lon >= 10), lat - 60) for lon, lat in places]
    rows = "".join(f"{lon},{lat}\n" for lon, lat in across)  # at the 180th meridian and equator
    assert len({x for x, _ in nodes_in(_csv(tmp_path, f"lon,lat\n{rows}"), (40, 40), 1000.0)}) == 3
    features = [_point(*place, 0.5) for place in places]  # with an altitude
    assert nodes_in(_geojson(tmp_path, *features), (20, 20), 1000.0) == expected


def test_a_grid_that_is_not_square_has_the_same_centre(tmp_path: Path) -> None:
    """0.09 degrees of latitude at the equator are ten cells of 1 km and a bit."""
    path = _csv(tmp_path, "lon,lat\n0,0.045\n0,-0.045\n0.045,0\n-0.045,0\n")
    assert nodes_in(path, (20, 12), 1000.0) == ((10, 0), (10, 11), (15, 6), (4, 6))
    with pytest.raises(InputError, match=r"at \[10, -1\]; allowed: grid = 20, rows = 12 or"):
        nodes_in(path, (20, 10), 1000.0)


# --- in a scenario ---


def test_a_scenario_names_a_file_beside_it(tmp_path: Path) -> None:
    """It may be a link within the folder."""
    _csv(tmp_path, "lon,lat\n8.50,54.25\n8.52,54.26\n")
    (tmp_path / "nodes.csv").symlink_to("buoys.csv")
    path = tmp_path / "sea.toml"
    path.write_text('nodes = "nodes.csv"\ngrid = 12\nzone = [0, 0, 2, 2]\n')
    space = load_scenario(path)
    # 0.02 degrees are 1,299 m at 54.255 degrees: 0.8 cells to both sides; 0.7 cells north, south.
    assert space.nodes == ((5, 6), (6, 5))
    assert load_scenario(path, grid=14).nodes == ((6, 7), (7, 6))
    assert load_scenario(path, nodes=[[1, 2]]).nodes == ((1, 2),)
    again = tmp_path / "again.toml"
    again.write_text(space.to_toml())
    assert load_scenario(again) == space


# --- refusals ---

TABLES = {
    "": "has columns none; allowed: x and y, or lon and lat",
    "lat,y\n8,54\n": "has columns lat, y; allowed",
    "x,y,lon,lat\n1,1,8,54\n": "has columns x, y, lon, lat; allowed",
    "x,y\n": "has 0 nodes; allowed: 1..1024",
    "x,y\n1,1\n\n2\n": "line 4: y is ''; allowed: a number",
    "x,y\nnan,1\n": "line 2: x is nan; allowed: -99,999..99,999",
    "x,y\n1.5,1\n": "line 2: x is 1.5; allowed: an integer",
    "x,y\n1,-1\n": r"line 2 is off the grid of 8 x 8 cells, at \[1, -1\]; allowed: 0 <= x, y < 256",
    "x,y\n1,1\n3,11\n": r"line 3 is off .* at \[3, 11\]; allowed: grid = 12 or more$",
    "x,y\n1,999\n": "allowed: 0 <= x, y < 256",
    "x,y\n1,1\n2,2\n1,1\n": r"line 2 and line 4 lie in one cell, \[1, 1\]; allowed: distinct",
    "lon,lat\n181,54\n": "line 2: lon is 181; allowed: -180..180",
    "lon,lat\n8,54\n8.02,54.02\n8.00001,54.00001\n": "line 2 and line 4 lie.*cell_size below 800 m",
    # 0.09 degrees are 10,008 m, 12.5 cells: 6.25 to both sides of the middle, at 4.
    "lon,lat\n0,0\n0,0.09\n": r"line 2 is off .* at \[4, 10\]; allowed: grid = 14 or more, or a l",
    "lon,lat\n0,0\n0,80\n": "off the grid .*; allowed: a larger cell_size$",
    'x,y\n"1,1\n': "is not a CSV file",
}


@pytest.mark.parametrize("text", TABLES)
def test_a_table_that_is_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=f"buoys.csv: .*{TABLES[text]}") as error:
        nodes_in(_csv(tmp_path, text), (8, 8), 800.0)
    assert "\n" not in str(error.value)


FEATURES: dict[str, Any] = {
    "features: is missing; allowed: a list": {"type": "Point", "coordinates": [8, 54]},
    "features.0.geometry.type: 'LineString' is unknown; allowed: Point": {
        "features": [{"geometry": {"type": "LineString", "coordinates": [8, 54]}}]
    },
    "features.1.geometry: ": {"features": [_point(8, 54), {"geometry": None}]},
    "features.0.geometry.coordinates: has not two numbers; allowed: ": {"features": [_point(8)]},
    "features.0.geometry.coordinates: lat is 91; allowed: -90..90": {"features": [_point(8, 91)]},
    "features.0 and features.1 lie in one cell": {"features": [_point(8, 54), _point(8, 54)]},
}


@pytest.mark.parametrize("line", FEATURES)
def test_a_geojson_file_that_is_refused(line: str, tmp_path: Path) -> None:
    path = tmp_path / "buoys.json"
    path.write_text(json.dumps(FEATURES[line]))
    with pytest.raises(InputError, match=f"buoys.json: {line}"):
        nodes_in(path, (8, 8), 800.0)


FILES = {
    "nowhere.csv": "no such file; allowed: a CSV file",
    "nowhere.json": "no such file; allowed: a GeoJSON",
    "buoys.xlsx": "has no known file ending; allowed: .csv, .geojson, .json",
    "bytes.csv": "cannot be read: it is not text",
    "no.json": "not valid JSON",
    "large.csv": "is too large; allowed: 7 bytes at most",
}


@pytest.mark.parametrize("name", FILES)
def test_a_file_that_is_none(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "bytes.csv").write_bytes(b"x,y\n\xff")
    (tmp_path / "no.json").write_text("{")
    (tmp_path / "large.csv").write_text("x,y\n1,1\n")
    monkeypatch.setattr(positions, "LIMIT", 7)
    with pytest.raises(InputError, match=f"{name}: {FILES[name]}"):
        nodes_in(tmp_path / name, (8, 8), 800.0)


@pytest.mark.parametrize(
    "name", ["../secret.csv", "{}/secret.csv", "in/../../secret.csv", "link.csv", "deep.csv"]
    + ["in/own.csv", "", "..", ".", "a\0b", "/etc/passwd", "/etc/shadow", "loop/secret.csv"],
)  # fmt: skip
def test_a_table_lies_in_the_folder_of_its_scenario(name: str, tmp_path: Path) -> None:
    """What a stranger's scenario names is neither read nor shown, be it by a link."""
    secret, folder = tmp_path / "secret.csv", tmp_path / "sea"
    secret.write_text("password\n")
    (folder / "in").mkdir(parents=True)
    (folder / "in" / "own.csv").write_text("password\n")
    (folder / "link.csv").symlink_to(secret)
    (folder / "deep.csv").symlink_to("in/own.csv")
    (folder / "loop").symlink_to("loop")
    path, named = folder / "sea.toml", json.dumps(name.format(tmp_path))
    path.write_text(f"nodes = {named}\n")
    with pytest.raises(InputError, match=f"^{path}: nodes: .*allowed: the name of a file") as error:
        load_scenario(path)
    assert "password" not in str(error.value)


def test_the_shipped_bay_has_its_nodes_beside_it() -> None:
    bay = load_scenario("bay")
    assert (len(bay.nodes), bay.grid, bay.quota) == (36, 40, 600)
    assert bay.nodes[0] == (2, 2)  # B01, in the north-west
