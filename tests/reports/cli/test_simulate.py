"""``dess simulate``: its JSON, the event log, the figure."""

import io
import json
import os
import resource
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from dess import load_scenario
from dess.analysis import load_results
from dess.analysis.figures.missions import sea_figure
from dess.model.events import EventLog
from dess.scenario.projection import Projection
from tests.analysis.small import files_of

# What the JSON of a mission and a record have in common.
SHARED = ["seed", "replication", "slots", "success", "collection_ratio"]
SHARED += ["collection_ratio_and_communication", "initial", "arrived", "collected", "residual"]


def test_what_ended_a_mission_is_printed_and_on_its_page(dess, tmp_path):
    """UAVs have the same numbers in the table, in the sentences and on the page."""
    failing = ("--policy", "random-unguarded", "--set", "uavs=2", "--set", "max_slots=9")
    code, out, _ = dess("simulate", "--scenario", "small.toml", *failing, "--animation", "m.html")
    lines = [f"UAV {uav} was still active at the horizon of 9 slots, with" for uav in range(3)]
    assert code == 0
    assert [line in out for line in lines] == [False, True, True]
    page = (tmp_path / "m.html").read_text("utf-8")
    assert [line in page for line in lines] == [False, True, True]


def test_a_mission_of_a_results_folder_is_simulated_again(dess, dess_json, tmp_path):
    """With the scenario of its design point, the policy and the seed of the study."""
    text = (tmp_path / "trial.toml").read_text()
    (tmp_path / "grid.toml").write_text(
        f"{text}\n[design]\nkind = 'grid'\nvalues.quota = [20, 60]\n"
    )
    assert dess("study", "run", "grid.toml", "--out", "out")[0] == 0
    (tmp_path / "small.toml").unlink()  # the folder has it
    results = load_results(tmp_path / "out")
    rows = results.missions.query("policy == 'random' and point == 1 and replication == 6")
    command = results.command("random", 1, 6, "out")
    assert command == "dess simulate --of out --point 1 --policy random --replication 6"
    command = shlex.split(command)
    mission = dess_json(*command[1:])
    assert list(mission)[:6] == ["policy", "scenario", *SHARED[:2], "study", "point"]
    assert (mission["scenario"], mission["study"], mission["point"]) == ("small.toml", "grid", 1)
    assert {key: mission[key] for key in SHARED} == rows.iloc[0][SHARED].to_dict()
    assert dess_json(*command[1:-2])["replication"] == 0


def test_other_code_than_that_of_the_results_is_noted(dess, tmp_path):
    assert dess("study", "run", "trial.toml", "--policy", "tour", "--out", "out")[0] == 0
    path = tmp_path / "out" / "manifest.json"
    path.write_text(path.read_text().replace('"numpy": "', '"numpy": "0.'))
    code, _, err = dess("simulate", "--of", "out")
    assert code == 0
    assert err.startswith("note: out: made with other versions of numpy: the mission may be")


# Arguments beside --of, and what the line on stderr must name.
BAD_OF = {
    "": "--policy: the study has 2; allowed: one of greedy, random",
    "--policy random --point 1": "--point: 1 is not in the study; allowed: 0..0",
    "--seed 7": "--seed: comes from the study; allowed: --of without --seed",
    "--scenario paper": "--scenario: comes from the study",
}


def test_a_mission_that_the_study_has_not_gets_one_line(dess, refusal):
    assert dess("study", "run", "trial.toml", "--missions", 2, "--out", "out")[0] == 0
    for arguments, words in BAD_OF.items():
        asked = ("simulate", "--of", "out", "--events", "log.parquet", *arguments.split())
        assert words in refusal(*asked)


def test_packets_in_continuous_time_are_measured_and_printed(dess, dess_json, tmp_path):
    setting = ("--set", "arrivals.process=continuous", "--set", "age.measured=true")
    operations = dess_json("simulate", "--scenario", "small.toml", *setting)["operations"]
    assert operations["generated"] > operations["delivered"] > 0
    files = ("--events", "log.parquet", "--figure", "mission.png", "--animation", "mission.html")
    code, printed, _ = dess("simulate", "--scenario", "small.toml", *setting, *files)
    assert code == 0
    assert "Packets lost" in printed and "Latency [mission slots]" in printed
    log = pq.read_table(tmp_path / "log.parquet")
    assert log.column_names == [*EventLog().columns()]
    assert log["event"].to_pylist().count("delivery") == operations["delivered"]
    assert (tmp_path / "mission.png").read_bytes().startswith(b"\x89PNG")


def test_the_json_has_all_that_the_table_prints(dess, dess_json):
    printed = dess("simulate", "--scenario", "small.toml")[1].partition("UAV ")[0]
    rows = [line.split() for line in printed.splitlines() if len(line.split()) == 2]
    data = dess_json("simulate", "--scenario", "small.toml")
    shown = {name: float(value) for name, value in rows if name[0].isalpha()}
    assert len(shown) > 12 and shown.pop("uavs") == len(data["uavs"])
    assert {name: data[name] for name in shown} == pytest.approx(shown, rel=1e-5)


def test_the_event_log_is_written_as_its_ending_says(dess, tmp_path):
    for name in ("log.parquet", "log.csv", "LOG.CSV"):
        assert dess("simulate", "--scenario", "small.toml", "--events", name)[0] == 0
    log, written = (pd.read_csv(tmp_path / name) for name in ("log.csv", "LOG.CSV"))
    pd.testing.assert_frame_equal(log, written)
    table = pd.read_parquet(tmp_path / "log.parquet")
    pd.testing.assert_frame_equal(log, table, check_dtype=False)


def test_a_name_in_an_event_log_is_no_formula(dess, tmp_path):
    """A spreadsheet runs what begins so; Parquet and --json have the name as it is."""
    (tmp_path / "names.csv").write_text("name,x,y\n=1+1,3,4\nplain,5,6\n")
    (tmp_path / "names.toml").write_text(
        'nodes = "names.csv"\nuavs = 1\ngrid = 12\nzone = [0, 0, 2, 2]\n'
    )
    for name in ("log.csv", "log.parquet"):
        assert dess("simulate", "--scenario", "names.toml", "--events", name)[0] == 0
    names = {*pd.read_csv(tmp_path / "log.csv")["name"].dropna()}
    assert names == {"'=1+1", "plain"}
    assert {*pd.read_parquet(tmp_path / "log.parquet")["name"].dropna()} == {"=1+1", "plain"}


BUOYS = "name,lon,lat\nAlpha,179.985,54.25\nBeta,-179.985,54.27\n"
AT_SEA = ("--scenario", "buoys.toml", "--set", "uavs=2", "--policy", "greedy")


@pytest.fixture
def buoys(tmp_path):
    """A sea with names and degrees, on both sides of the 180th meridian, and with a slow UAV."""
    (tmp_path / "buoys.csv").write_text(BUOYS)
    lines = ['nodes = "buoys.csv"', "grid = 8", "zone = [5, 0, 3, 2]", "quota = 60"]
    lines += ["[[fleet]]", "[[fleet]]", "slots_per_cell = 2"]
    (tmp_path / "buoys.toml").write_text("\n".join(lines))
    return load_scenario(tmp_path / "buoys.toml", uavs=2)


def test_the_flown_path_is_written_with_its_times_in_degrees(dess, refusal, tmp_path, buoys):
    """The places of all files are the same; a slow UAV is also between two cells."""
    for kind in ("csv", "geojson", "kml"):
        assert dess("simulate", *AT_SEA, "--path", f"p.{kind}", "--json")[0] == 0
    table = pd.read_csv(tmp_path / "p.csv")
    projection = Projection(buoys.centre, buoys.size, buoys.cell_size)
    places = projection.cells(table[["lon", "lat"]].to_numpy())
    assert np.allclose(places, table[["x", "y"]] + 0.5)
    for uav, of in table.groupby("uav"):
        assert of["time"].tolist() == [*range(len(of))]
        steps = of[["x", "y"]].diff().abs().sum(axis=1).iloc[1:]
        assert set(steps) == {0.0, 1.0 / uav}  # the second one takes two slots for a cell
        assert of["lon"].diff().abs().max() < 0.02
    assert table["lon"].min() < 180 < table["lon"].max()
    features = json.loads((tmp_path / "p.geojson").read_text())["features"]
    lines = [line for of in features for line in of["geometry"]["coordinates"]]
    assert np.allclose(lines, table[["lon", "lat", "altitude"]])
    assert sum((of["properties"]["times"] for of in features), []) == table["time"].tolist()
    spaces = {"gx": "http://www.google.com/kml/ext/2.2", "": "http://www.opengis.net/kml/2.2"}
    tracks = ElementTree.parse(tmp_path / "p.kml").findall(".//gx:Track", spaces)
    coords = [c.text.split() for of in tracks for c in of.findall("gx:coord", spaces)]
    assert np.allclose(np.array(coords, float), lines)
    small = ("simulate", "--scenario", "small.toml")
    assert dess(*small, "--path", "q.geojson")[0] == 0  # in cells
    assert "no degrees" in refusal(*small, "--path", "q.kml")
    assert refusal(*small, "--path", "q.txt").endswith("allowed: .geojson, .kml, .gpx, .csv")


def test_nodes_have_their_names_in_table_log_and_maps(dess, tmp_path, buoys):
    code, out, _ = dess("simulate", *AT_SEA, "--events", "e.parquet", "--animation", "m.html")
    assert code == 0
    assert "Alpha" in out and "data at the start" in out
    log = pq.read_table(tmp_path / "e.parquet").to_pandas()
    named = log[log["node"] >= 0]
    assert (named["name"] == np.array(["Alpha", "Beta"])[named["node"]]).all()
    assert log.loc[log["node"] < 0, "name"].isna().all()
    page = (tmp_path / "m.html").read_text().replace(" ", "")
    assert '"names":["Alpha","Beta"]' in page
    texts = [text.get_text() for text in sea_figure(buoys).axes[0].texts]
    assert texts == ["Alpha", "Beta"]


def test_a_video_needs_ffmpeg(refusal, monkeypatch):
    monkeypatch.setattr("matplotlib.animation.FFMpegWriter.isAvailable", lambda: False)
    line = refusal("simulate", "--animation", "mission.mp4")
    assert "animation: .mp4 needs the program ffmpeg, which is not installed; allowed" in line


OUTPUTS = {"events": "log.parquet", "figure": "mission.png", "animation": "mission.gif"}


@contextmanager
def full_disk(size: int) -> Iterator[None]:
    """Files cannot grow beyond a size, as on a disk that is full."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def test_an_error_leaves_none_of_the_files_of_a_command(dess, tmp_path):
    os.mkfifo(tmp_path / "mission.gif")
    before = files_of(tmp_path)
    options = [word for name, file in OUTPUTS.items() for word in (f"--{name}", file)]
    code, out, err = dess("simulate", "--scenario", "small.toml", *options)
    assert (code, out) == (2, "")
    assert "mission.gif: is a pipe; allowed: a file" in err
    (tmp_path / "mission.gif").unlink()
    assert dess("simulate", "--scenario", "small.toml", *options)[0] == 0
    for file in OUTPUTS.values():
        (tmp_path / file).unlink()
    with full_disk(7000):  # the log fits, which is written first
        assert dess("simulate", "--scenario", "small.toml", *options)[0] == 2
    assert files_of(tmp_path) == before


@pytest.mark.parametrize("name", ["-", "/dev/stdout"])
def test_the_event_log_can_be_standard_output(dess, refusal, tmp_path, monkeypatch, name):
    command = ("simulate", "--scenario", "small.toml", "--events")
    assert dess(*command, "log.parquet")[0] == 0
    stream = io.TextIOWrapper(binary := io.BytesIO())
    with monkeypatch.context() as patches:
        patches.setattr(sys, "stdout", stream)
        assert dess(*command, name)[0] == 0
    assert binary.getvalue() == (tmp_path / "log.parquet").read_bytes()
    assert "--json: standard output has the event log" in refusal(*command, name, "--json")
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    line = refusal(*command, name)
    assert "-: standard output is a terminal; allowed: a file, or a pipe" in line
