"""What is told of nodes that no UAV can serve: before a sweep, and in its answer."""

import json
from typing import Any

import pytest

from dess import ScenarioSpace, analysis, load_scenario
from dess.analysis.sheet import scenario_notes, unreachable_sentences
from dess.reports.cli import ask, main
from dess.reports.cli.options import print_notes
from tests.dess.model.test_reach import SHEET

NODES = {"nodes": [[3, 0], [55, 0], [60, 0]], "names": ["near", "between", "far"]}
SEA = {**NODES, "grid": 64, "rows": 4, "zone": [0, 0, 2, 2]}


def _spaces(*fleets: int) -> list[ScenarioSpace]:
    sheet = SHEET | {"horizon": "50 min"}
    return [ScenarioSpace.of(**SEA, uavs=uavs, data_sheet=sheet) for uavs in fleets]


def test_of_several_fleets_the_one_that_reaches_least_is_told(capsys):
    lost = "out of reach of a UAV from a full battery: far"
    assert unreachable_sentences(_spaces(1)) == [
        lost,
        "without these nodes a collection ratio of 66.7 % is the highest",
    ]
    sentences = unreachable_sentences(_spaces(1, 2, 1))
    assert sentences == [
        lost,
        "beyond the margins that the return guard keeps for 2 UAVs: between",
        "without these nodes a collection ratio of 33.3 % is the highest",
    ]
    print_notes(scenario_notes(_spaces(1, 2)))
    assert capsys.readouterr().err == "".join(f"note: {line}\n" for line in sentences)
    assert unreachable_sentences([ScenarioSpace.of()]) == []


def test_an_answer_tells_it_of_what_it_names(tmp_path):
    """One UAV is as good as two, whose margins would leave out one more node."""
    [space] = _spaces(1)
    (tmp_path / "sea.toml").write_text(space.to_toml())
    found = analysis.sweep(
        tmp_path / "sea.toml", ["greedy"], 2, folder=tmp_path, progress=False, uavs=[1, 2]
    )
    assert [fact.found for fact in found.facts() if fact.label == "note"] == [
        "out of reach of a UAV from a full battery: far",
        "without these nodes a collection ratio of 66.7 % is the highest",
    ]


@pytest.mark.parametrize(
    "more", [(), ("--dry-run",), ("--price", "uav=1", "--require", "ratio=0.01")]
)
def test_a_command_tells_it_once(more, tmp_path, capsys, monkeypatch):
    """It was told twice on stderr, in the answer, and among what is assumed."""
    [space] = _spaces(1)
    (tmp_path / "sea.toml").write_text(space.to_toml())
    monkeypatch.setattr(ask, "missing", lambda *_: "not here")  # no page is made
    command = ["sweep", "--scenario", str(tmp_path / "sea.toml"), "--set", "uavs=1,2"]
    command += ["--policy", "greedy", "--missions", "2", "--results", str(tmp_path / "results")]
    assert main([*command, *more]) == 0
    told = " ".join("".join(capsys.readouterr()).split())
    assert told.count("% is the highest") == 1


def _crowded(**fields: Any) -> ScenarioSpace:
    """A further zone of one cell, and pads in both zones that are enough for 4 UAVs in number."""
    zones = [{"cells": [9, 9, 1, 1], "pads": 1}]
    return load_scenario("paper", **({"uavs": 4, "pads": 1, "zones": zones} | fields))


def test_a_zone_without_room_for_all_uavs_is_told(tmp_path, capsys):
    told = (
        "UAVs may be lost: the pads have room for 3 UAVs, and up to 4 fly, as zones.0 has 1 cell; "
        "give more cells or pads, or landing = true"
    )
    assert scenario_notes([_crowded(uavs=3), _crowded()]) == [told]
    print_notes(scenario_notes([_crowded()]))
    assert capsys.readouterr().err == f"note: {told}\n"
    (tmp_path / "sea.toml").write_text(_crowded().to_toml())
    assert main(["scenarios", "show", str(tmp_path / "sea.toml")]) == 0
    assert told in " ".join(capsys.readouterr().out.split())
    assert main(["scenarios", "show", str(tmp_path / "sea.toml"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["notes"] == [told]


@pytest.mark.parametrize(
    "fields",
    [
        {"uavs": 3},
        {"landing": True},  # a wait on the ground takes no battery
        {"pads": 2},
        {"zones": [{"cells": [9, 9, 2, 1], "pads": 1}]},
        {"uavs": 5},  # no number of cells would be enough for these pads
        {"flight_cost": 0},
    ],
)
def test_other_zones_are_not_told(fields):
    assert scenario_notes([_crowded(**fields)]) == []
