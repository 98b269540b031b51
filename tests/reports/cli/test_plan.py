"""``dess simulate --plan`` and ``--start``: files, what is printed, what is refused."""

import json
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

from dess.analysis.flights import flight_plan
from tests.analysis.flights.hand import FIELDS, SHEET, write_sea
from tests.analysis.small import files_of

AT_SEA = ("simulate", "--scenario", "sea.toml", "--policy", "tour")


@pytest.fixture
def sea(tmp_path):
    """A sea with degrees and a data sheet in the folder of the command."""
    return write_sea(tmp_path)


def test_the_flights_of_a_mission_are_written_and_told(dess, dess_json, tmp_path, sea):
    code, out, err = dess(*AT_SEA, "--plan", "plans", "--start", "2026-06-01T10:00+02:00")
    assert "time zone" not in err
    assert code == 0
    table = pd.read_csv(tmp_path / "plans" / "plan.csv")
    flights = table["file"].dropna()
    assert {*flights, "plan.csv"} == {path.name for path in (tmp_path / "plans").iterdir()}
    assert len(flights) > 0 and table["from"][0] == "2026-06-01T08:00:00+00:00"
    told = dess_json(*AT_SEA, "--plan", "again")["plan"]
    assert told["flights"] == len(flights)
    shift = f"Way points are up to {told['largest_shift_m']:g} m from the middles of their cells"
    assert shift in out
    for name in flights:
        files = [(tmp_path / folder / name).read_bytes() for folder in ("plans", "again")]
        assert files[0] == files[1]


def test_swaps_are_forbidden_in_missions_that_are_planned(dess, tmp_path, sea):
    log = ("--set", "uavs=2", "--json", "--events")
    assert dess(*AT_SEA, *log, "planned.csv", "--plan", "plans")[0] == 0
    assert dess(*AT_SEA, *log, "forbidden.csv", "--set", "forbid_swaps=true")[0] == 0
    planned, forbidden = ((tmp_path / f"{n}.csv").read_bytes() for n in ("planned", "forbidden"))
    assert planned == forbidden


def test_a_plan_is_written_completely_or_not_at_all(dess, refusal, tmp_path, sea, monkeypatch):
    (tmp_path / "empty").mkdir()
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "own.plan").touch()
    assert "full: is a folder with files" in refusal(*AT_SEA, "--plan", "full")
    assert "no folder none" in refusal(*AT_SEA, "--plan", "none/plans")
    assert "cannot be written: Not a directory" in refusal(*AT_SEA, "--plan", "sea.toml")
    lost = ("--policy", "random-unguarded")
    assert "without having landed; allowed: a mission in which" in refusal(
        *AT_SEA, *lost, "--plan", "plans"
    )
    before = files_of(tmp_path)

    def fail(*arguments):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(flight_plan, "plan_text", fail)
        code, out, err = dess(*AT_SEA, "--path", "p.csv", "--plan", "plans")
        assert (code, out) == (2, "") and "No space left on device" in err
    assert files_of(tmp_path) == before and not (tmp_path / "plans").exists()
    assert dess(*AT_SEA, "--plan", "empty")[0] == 0


# What is replaced in the file of the sea by what, the options, and what the line says.
PLACES = FIELDS.removeprefix("uavs = 1\n")
IN_CELLS = "grid = 8\nnodes = [[2, 1]]\n"
REFUSED = {
    "no degrees": (PLACES, IN_CELLS, (), "--plan: the sea has no degrees"),
    "no sheet": (SHEET, "", (), "--plan: the scenario has no cruise and no slot in seconds"),
    "no landing": (
        *("uavs = 1\n", "uavs = 1\nlanding = false\nquota = 9\n", ()),
        "--plan: the UAVs do not land",
    ),
    "no time": ("", "", ("--start", "soon"), "--start: 'soon' is no time"),
    "no such time": ("", "", ("--start", "2900-01-01"), "--start: '2900-01-01' is out of range"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_a_plan_is_refused_in_one_line(refusal, sea, case):
    replaced, by, options, line = REFUSED[case]
    sea.write_text(sea.read_text().replace(replaced, by))
    assert line in refusal(*AT_SEA, "--plan", "plans", *options)


def test_a_start_without_times_is_refused(refusal, sea):
    assert "--start: no output has times" in refusal(*AT_SEA, "--start", "2026-06-01")


def test_missions_of_studies_have_no_plan(dess, refusal):
    assert dess("study", "run", "trial.toml", "--missions", 2, "--out", "out")[0] == 0
    line = refusal("simulate", "--of", "out", "--policy", "random", "--plan", "plans")
    assert "--plan: needs the files of the sea" in line


def test_tracks_have_the_times_of_day(dess, tmp_path, sea):
    """In UTC, a slot of the sheet apart; without a start, GPX counts from 1970 on as KML does."""
    begin = ("--start", "2026-06-01T23:59:55")
    for kind in ("csv", "geojson", "kml", "gpx"):
        code, _, err = dess(*AT_SEA, *begin, "--path", f"p.{kind}", "--json")
        assert (
            code == 0 and "--start 2026-06-01T23:59:55 has no time zone and is taken as UTC" in err
        )
    times = pd.read_csv(tmp_path / "p.csv")["utc"].tolist()
    assert times[:3] == ["2026-06-01T23:59:55Z", "2026-06-02T00:00:05Z", "2026-06-02T00:00:15Z"]
    (feature,) = json.loads((tmp_path / "p.geojson").read_text())["features"]
    assert feature["properties"]["coordTimes"] == times
    kml, gpx = (ElementTree.parse(tmp_path / f"p.{kind}") for kind in ("kml", "gpx"))
    assert [mark.text for mark in kml.iter("{http://www.opengis.net/kml/2.2}when")] == times
    space = "{http://www.topografix.com/GPX/1/1}"
    assert [mark.text for mark in gpx.iter(f"{space}time")] == times
    places = [[float(p.get("lon")), float(p.get("lat"))] for p in gpx.iter(f"{space}trkpt")]
    written = [place[:2] for place in feature["geometry"]["coordinates"]]
    assert np.allclose(places, written, rtol=0, atol=1e-9)
    assert dess(*AT_SEA, "--path", "p.gpx", "--json")[0] == 0
    assert "<time>1970-01-01T00:00:10Z</time>" in (tmp_path / "p.gpx").read_text()


def test_tracks_say_what_a_pilot_reads(dess, tmp_path, sea):
    """At e1931ad2: UAVs from 0, 80 % for a full battery, and 10 m high on the ground."""
    sea.write_text(sea.read_text() + 'reserve = "20 %"\n')
    assert dess(*AT_SEA, "--set", "uavs=2", "--path", "p.csv", "--json")[0] == 0
    track = pd.read_csv(tmp_path / "p.csv")
    assert [*track["uav"].unique()] == [1, 2]
    for uav, rows in track.groupby("uav"):
        assert rows["battery"].iloc[0] == 100 and rows["battery"].min() >= 20
        assert rows["altitude"].iloc[0] == rows["altitude"].iloc[-1] == 0
        assert {*rows["altitude"]} == {0, 10 + 11 * (uav - 1)}
        in_cells = rows[["x", "y"]].to_numpy()
        away = (in_cells[:, 1] > 0) | (in_cells[:, 0] > 1)
        assert (rows["altitude"][away] > 0).all()
    assert dess(*AT_SEA, "--path", "p.gpx", "--air-distance", "20 m", "--json")[0] == 0


def test_uavs_have_the_numbers_of_their_files_in_the_printed_table(dess, sea):
    out = dess(*AT_SEA, "--set", "uavs=2")[1]
    lines = [line.split() for line in out.splitlines()]
    first = next(n for n, line in enumerate(lines) if line[:2] == ["UAV", "quota"])
    assert [line[0] for line in lines[first + 2 : first + 4]] == ["1", "2"]


def test_distances_are_options_that_are_checked(refusal, dess, tmp_path, sea):
    plan = ("--plan", "plans", "--set", "uavs=2")
    assert "--air-distance: '10' has no unit" in refusal(*AT_SEA, *plan, "--air-distance", "10")
    far = refusal(*AT_SEA, *plan, "--ground-distance", "2 km")
    assert "--ground-distance: '2 km' is out of range; allowed: 1 m..100 m" in far
    assert "no output has altitudes" in refusal(*AT_SEA, "--air-distance", "9 m")
    assert dess(*AT_SEA, *plan, "--air-distance", "30 m", "--json")[0] == 0
    table = pd.read_csv(tmp_path / "plans" / "plan.csv")
    assert {*table["altitude"].dropna()} == {30, 61}


def test_the_places_and_the_climb_are_printed(dess, sea):
    out = dess(*AT_SEA, "--set", "uavs=2", "--set", "pads=1", "--plan", "plans")[1]
    assert "UAVs climb and descend at 3 m/s, which is assumed" in out
    assert "Places of zone 1 (latitude, longitude): pad 1 at 0.003" in out
    assert "; place 2 at " in out
