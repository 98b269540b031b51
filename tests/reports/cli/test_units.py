"""What commands tell of missions with a data sheet is in its units."""

import io
import json

import pandas as pd
import pytest

from dess import load_scenario, simulate
from dess.analysis.metrics import format_length
from dess.analysis.results.paths import path_text
from dess.model.state import sample_scenario
from dess.reports.cli import main
from dess.reports.player import Playback
from tests.analysis.small import SHEET, write_scenario

SLOT, UNIT = 21.0, 21.0 * 125e3  # of SHEET: [s] and [bit]


def test_single_missions_and_their_player_are_told_in_units(tmp_path, capsys):
    file = write_scenario(tmp_path, **SHEET)
    shown = {}
    for command in ("simulate", "evaluate --policy greedy --missions 3"):
        assert main([*command.split(), "--scenario", str(file), "--json"]) == 0
        shown[command] = json.loads(capsys.readouterr().out)
    mission, (mean,) = shown.values()
    kept = [*command.split(), "--scenario", str(file), "--json", "--out", str(tmp_path / "kept")]
    assert main(kept) == 0
    (again,) = json.loads(capsys.readouterr().out)
    assert again | {"seconds": 0} == mean | {"seconds": 0}
    assert mission["slots_h"] == pytest.approx(mission["slots"] * SLOT / 3600)
    assert mission["collected_MB"] == pytest.approx(mission["collected"] * UNIT / 8e6)
    measured = mission["operations"]
    assert measured["age_h"] == pytest.approx(measured["age"] * SLOT / 3600)
    assert mean["age_h"]["mean"] == pytest.approx(mean["age"]["mean"] * SLOT / 3600)
    scenario = sample_scenario(load_scenario(file), 0, 0)
    record = simulate(load_scenario(file), "greedy", events=True)
    playback = Playback(record.events.columns(), scenario)
    left = playback.residual[-1].sum() * UNIT / 8e6
    assert playback.describe_slot(playback.end).startswith(
        f"{format_length(record.slots, scenario.units)} of"
    )
    assert f" · {left:,.3g} MB left · " in playback.describe_slot(playback.end)
    assert playback.data["units"]["length"] == ("km", pytest.approx(0.315))
    table, features, tracks = (
        path_text(record.events.columns(), scenario, kind) for kind in ("csv", "geojson", "kml")
    )
    rows = pd.read_csv(io.StringIO(table)).query("uav == 1")
    assert rows["seconds"].tolist() == (SLOT * rows["time"]).tolist()
    times = json.loads(features)["features"][0]["properties"]
    assert times["times"] == rows["time"].tolist()
    assert times["seconds"] == rows["seconds"].tolist()
    assert "<when>1970-01-01T00:02:06Z</when>" in tracks  # the start of slot 6, after 126 s
    assert "<when>1970-01-01T00:00:01Z</when>" not in tracks
