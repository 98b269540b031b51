"""The help, and the names that commands accept."""

import re

import pytest
import typer
from click.testing import CliRunner

from dess import ScenarioSpace, load_scenario
from dess.analysis import load_study
from dess.analysis.names import declared_fields as fields_in
from dess.analysis.study.files import study_names
from dess.policies.registry import CLASSES, trained_names
from dess.reports.cli.commands import app
from dess.scenario.fields import fields_of
from dess.scenario.scenario import scenario_families, scenario_names


def test_names_are_listed(dess):
    for command, names in {
        "policies": [*CLASSES, *trained_names()],
        "scenarios": [*scenario_names(), *scenario_families()],
        "studies": study_names(),
    }.items():
        code, out, err = dess(command)
        assert (code, err) == (0, "")
        assert [line.split()[0] for line in out.splitlines()] == names


def test_a_scenario_is_shown_field_by_field(dess, dess_json):
    code, out, err = dess("scenarios", "show", "fig1", "--set", "uavs=2")
    assert (code, err) == (0, "")
    rows = {line.split()[0]: line for line in out.splitlines() if line.strip()}
    assert rows["uavs"].split()[1] == "2"
    assert {*fields_of(ScenarioSpace)} <= {*rows}
    shown_words = " ".join(" ".join(line[40:] for line in out.splitlines()).split())
    for field in fields_in(load_scenario("fig1")):  # no word is cut
        assert {*field.meaning.split()} <= {*shown_words.split()}
    full = dess("scenarios", "show", "fig1", "--set", "uavs=2", "--all")[1]
    uavs = re.search(r"^uavs = 2\n.*", full, re.M)[0]
    assert "default [1, 3]; allowed: an integer 1..16 or [low, high]" in uavs
    shown = dess_json("scenarios", "show", "small.toml")
    fields = {field.pop("name"): field for field in shown["fields"]}
    assert [*fields] == [*fields_of(ScenarioSpace)]
    assert (fields["quota"]["value"], fields["quota"]["default"]) == (60, 440)
    assert fields["pads"]["allowed"] == "an integer 1..6"


def test_hourly_weather_is_shown_without_a_simulation(dess, dess_json):
    settings = ("--set", "weather.longest=8 h", "--set", "weather.operating=06:00-18:00")
    code, out, _ = dess("scenarios", "show", "new-jersey", *settings)
    lines = [line for line in out.splitlines() if "hours" in line]
    assert code == 0
    assert lines[0] == "weather: 271,752 hours with 31 whole years, 1990 to 2020"
    assert "50.0 % not operating" in lines[1]
    assert "windows a year, each of at most 8 h; the longest gap of a year is" in lines[2]
    facts = dess_json("scenarios", "show", "new-jersey", *settings)["weather"]
    assert sum(facts["shares"].values()) == pytest.approx(1)
    assert f"{100 * facts['shares']['open']:.1f} % of the hours are open" in lines[1]


def test_a_scenario_of_ones_own_may_have_a_description(dess, dess_json, tmp_path):
    (tmp_path / "mine.toml").write_text('description = "my bay"\nuavs = 2\n')
    assert dess_json("scenarios", "show", "mine.toml")["description"] == "my bay"
    assert load_scenario(tmp_path / "mine.toml") == load_scenario("paper", uavs=2)
    code, out, _ = dess("scenarios")
    assert code == 0
    assert all(len(line.split(maxsplit=1)[1]) > 20 for line in out.splitlines())


def test_a_generated_sea_is_listed_and_shown(dess, dess_json):
    _, out, _ = dess("scenarios")
    assert re.search(r"^coast:SEED +land along one side,.* e.g. coast:7$", out, re.M)
    shown = dess_json("scenarios", "show", "coast:7", "--set", "uavs=1")
    fields = {field["name"]: field["value"] for field in shown["fields"]}
    assert (fields["uavs"], shown["scenario"]) == (1, "coast:7")
    assert fields["quota"] == load_scenario("coast:7").quota


def test_a_policy_is_shown_with_its_card(dess, dess_json, tmp_path):
    code, out, _ = dess("policies", "show", "greedy")
    assert code == 0
    assert "any scenario; of the shipped ones bay, biscay-corner, fig1" in out
    assert "Fly to the node with the most residual data" in out
    shown = dess_json("policies", "show", "ddqn")
    assert shown["scenarios"] == ["fig4", "paper"]
    assert shown["trained_on"]["uavs"] == [1, 3]


def test_a_study_is_shown_as_its_file_sets_it(dess, dess_json, tmp_path):
    code, out, _ = dess("studies", "show", "fig4")
    assert code == 0
    (tmp_path / "again.toml").write_text(out)
    assert load_study(tmp_path / "again.toml").model_dump() == load_study("fig4").model_dump()
    assert dess_json("studies", "show", "fig4")["missions"] == load_study("fig4").missions


@pytest.mark.parametrize(
    ("words", "completed"),
    [
        ("dess sim", ["simulate"]),
        ("dess simulate --scenario pap", ["paper"]),
        ("dess simulate --policy greedy,tou", ["greedy,tour"]),
        ("dess simulate --set charge_", ["charge_rate=", "charge_start=", "charge_complete="]),
        ("dess study run fig", ["fig1", "fig4", "fig5", "fig5-paper"]),
        ("dess train qui", ["quick"]),
    ],
)
def test_the_shell_completes_names(words, completed):
    asked = {"_DESS_COMPLETE": "complete_bash", "COMP_WORDS": words}
    asked["COMP_CWORD"] = str(len(words.split()) - 1)
    command = typer.main.get_command(app)
    assert CliRunner().invoke(command, prog_name="dess", env=asked).output.split() == completed


def test_the_map_of_a_sea_is_drawn_be_it_refused(dess, tmp_path):
    """A zone in the sea, and one that is not: the picture is there, the line as well."""
    for zone, expected in (("[5, 0, 3, 2]", 0), ("[7, 7, 3, 2]", 2)):
        show = ("scenarios", "show", "small.toml", "--set", f"zone={zone}", "--figure", "sea.png")
        code, _, err = dess(*show)
        assert code == expected
        assert ("zone: [7, 7, 3, 2] does not lie on" in err) == (expected == 2)
        picture = tmp_path / "sea.png"
        assert picture.read_bytes()[:4] == b"\x89PNG"
        picture.unlink()
    assert dess("scenarios", "show", "small.toml", "--figure", "sea.txt")[0] == 2
