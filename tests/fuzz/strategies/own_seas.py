"""Own seas as people have them: columns and quantities in any notation, features of any length."""

import json

from hypothesis import strategies as st

from tests.fuzz.case import Case
from tests.fuzz.steps import write
from tests.fuzz.strategies.commands import line
from tests.fuzz.strategies.values import numbers, texts

_QUANTITIES = st.sampled_from(
    ["3 MB/h", "3,5 MB/h", "1,000 kB/h", "20 kB", "0 MB", "35 min", "54 kmph", "15 kn", "2 km"]
    + ["12 dB at 2 km", "12 dB at 0 m", "5 m/s from W", "5 m/s from 1e9 deg", "3", "", " ", "KB"]
    + ["nan MB", "1e99 h", "-1 MB/h", "9" * 40 + " m", "\N{ARABIC-INDIC DIGIT THREE} MB/h", "3 µW"]
)
_ITEMS = _QUANTITIES | st.sampled_from(["3 MB/h", "3 MB", "", "2"]) | numbers | texts
_COLUMNS = ("name", "rate", "data_rate", "data", "backlog", "radius", "Data_Rate")
_LISTS = ("{}", "{}", "[{}, {}]", "[{}", "{},{}", '"{}"', "[{}],[{}]", "{}..{}:3")
# Degrees on both sides of a meridian, and cells.
_PLACES = {
    ("lon", "lat"): ["8.2", "8.21", "8.25", "8.28", "8.2", "8.22", "-179.99", "179.98"],
    ("x", "y"): ["1", "2", "5", "7", "9", "1.0"],
}
_SHEET = {"endurance": "35 min", "cruise": "15 m/s", "charging": "40 min", "bandwidth": "125 kHz"}
_SHEET |= {"snr": "12 dB at 2 km", "data_rate": "3 MB/h"}
_COMMANDS = (
    (("scenarios", "show"), {"scenarios show name": "../in/own.toml"}),
    (("sweep",), {"--scenario": "../in/own.toml", "--dry-run": None}),
)
_KINDS = ("Point", "LineString", "MultiPoint", "MultiLineString", "Polygon", "GeometryCollection")


@st.composite
def _tables(draw: st.DrawFn) -> str:
    """A table of nodes or of circles."""
    axes = draw(st.sampled_from(sorted(_PLACES)))
    parting = draw(st.sampled_from([",", ";", "\t"]))
    columns = draw(st.lists(st.sampled_from(_COLUMNS), unique=True, max_size=3))
    rows = [[*axes, *columns]]
    cell = draw(st.sampled_from(["{}", '"{}"']))
    for _ in range(draw(st.sampled_from([0, 1, 2, 2, 3]))):
        places = [draw(st.sampled_from(_PLACES[axes])) for _ in axes]
        rows.append([*places, *(cell.replace("{}", draw(_ITEMS)) for _ in columns)])
    return "\n".join(parting.join(row) for row in rows)


@st.composite
def _geometries(draw: st.DrawFn, depth: int = 1) -> dict:
    kind = draw(st.sampled_from(_KINDS))
    if kind == "GeometryCollection":
        inner = [draw(_geometries(depth - 1))] if depth else []
        return {"type": kind, "geometries": inner}
    position = st.lists(st.sampled_from([8.2, 8.21, 8.25, 8.28, 180, -180]), max_size=3)
    places = st.lists(position, max_size=4)
    nested = {"Point": position, "LineString": places, "MultiPoint": places}
    return {"type": kind, "coordinates": draw(nested.get(kind, st.lists(places, max_size=2)))}


@st.composite
def _documents(draw: st.DrawFn) -> str:
    """A GeoJSON file of features, circles among them."""
    properties = draw(st.fixed_dictionaries({}, optional={"radius": _ITEMS, "data_rate": _ITEMS}))
    feature = {"type": "Feature", "properties": properties, "geometry": draw(_geometries())}
    return json.dumps({"type": "FeatureCollection", "features": [feature]})


@st.composite
def _fences(draw: st.DrawFn) -> str:
    """A plan with polygons and circles in which UAVs stay, or which they do not enter."""
    corner = st.lists(st.sampled_from([8.2, 8.21, 8.25, 8.28, 90, 200, "8"]), max_size=3)
    polygon = st.fixed_dictionaries(
        {"polygon": st.lists(corner, max_size=4), "inclusion": st.booleans()}
    )
    radius = st.sampled_from([100, 0, 1e9, -1, "100"])
    circle = st.fixed_dictionaries({"center": corner, "radius": radius})
    circles = st.fixed_dictionaries({"circle": circle, "inclusion": st.booleans()})
    lists = {"polygons": st.lists(polygon, max_size=2), "circles": st.lists(circles, max_size=2)}
    fence = draw(st.fixed_dictionaries({}, optional=lists))
    return json.dumps({"fileType": "Plan", "geoFence": fence})


@st.composite
def own_seas(draw: st.DrawFn) -> Case:
    """A scenario with drawn files, or with a quantity that is set without quotes of its own."""
    head = 'nodes = "own.csv"\nuavs = 1\ngrid = 64\nzone = [30, 30, 2, 2]\n'
    no_fly = draw(st.sampled_from(["", "own.geojson", "own.geojson", "own.plan"]))
    if no_fly:
        head += f'no_fly = "{no_fly}"\n'
    if draw(st.booleans()):
        head += "[data_sheet]\n" + "\n".join(f'{name} = "{of}"' for name, of in _SHEET.items())
    steps = (
        write("in/own.toml", head.encode()),
        write("in/own.csv", draw(_tables()).encode("utf-8", "surrogatepass")),
        write("in/own.geojson", draw(_documents()).encode("utf-8", "surrogatepass")),
        write("in/own.plan", draw(_fences()).encode()),
    )
    # A sweep loads the scenario several times, and may tell of a file before it refuses a value.
    words, values = _COMMANDS[0] if "no_fly" in head else draw(st.sampled_from(_COMMANDS))
    arguments = line(words, values)
    if draw(st.integers(0, 2)) == 2:
        name = draw(st.sampled_from(sorted(_SHEET)))
        given = draw(st.sampled_from(_LISTS)).replace("{}", draw(_QUANTITIES))
        arguments = (*arguments, f"--set=data_sheet.{name}={given}")
    return Case("own sea", arguments, steps, lasting=5)
