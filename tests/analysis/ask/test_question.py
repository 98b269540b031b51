"""Questions: studies made of values, kept, and asked again."""

import os
import shlex
import shutil

import numpy as np
import pytest

from dess import InputError, load_scenario
from dess.analysis import load_results, run_study
from dess.analysis.answers.diff import diff_results
from dess.analysis.ask.question import sweep_question, values_of, what_if_question
from dess.analysis.execution import effort
from dess.analysis.execution.effort import BASELINE, SECONDS
from dess.reports.cli import options
from tests.analysis.small import SHEET, files_of, write_scenario

FIELDS = {"uavs": [1, 2], "quota": [20, 40], "pads": 2}


@pytest.fixture
def asking(tmp_path):
    """Asks a sweep of the small scenario: the question, the results and the missions done."""

    def run(fields=FIELDS, missions=6, **about):
        question = sweep_of(fields, tmp_path, missions=missions, **about)
        rounds, done = [], []
        results = question.ask(1, done.append, rounds.append)
        return question, results, sum(done) - rounds[0].present

    return run


def sweep_of(fields, folder, **about):
    """A sweep of the small scenario."""
    values = {field: values_of(field, given) for field, given in fields.items()}
    about = {"policies": ["greedy"], "folder": folder / "results"} | about
    return sweep_question(values, write_scenario(folder), **about)


def check_equal_to_a_fresh_run(question, results, folder):
    assert diff_results(results, run_study(question.study, folder / "fresh")).identical


def test_a_read_only_folder_that_has_all_missions_answers(asking, tmp_path, monkeypatch):
    """Also where a rule decides how many there are; what lacks a mission is refused at once."""
    prices = {"prices": {"uav": 1.0}, "requirements": {"success": 0.01}, "missions": 20}
    searched = [asking(), asking(**prices)]
    places = sorted((tmp_path / "results").rglob("*"))
    times = [place.stat().st_mtime_ns for place in places]
    monkeypatch.setattr("os.access", lambda path, mode: mode != os.W_OK)
    for (question, results, _), about in zip(searched, ({}, prices), strict=True):
        again, found, _ = asking(**about)
        assert again.file == question.file
        assert diff_results(results, found).identical
    with pytest.raises(InputError, match="cannot be written: Permission denied"):
        asking({**FIELDS, "uavs": [2, 3]})
    assert sorted((tmp_path / "results").rglob("*")) == places
    assert [place.stat().st_mtime_ns for place in places] == times


OTHERS = {
    "wider": ({**FIELDS, "uavs": [1, 2, 3]}, 12),
    "narrower": ({**FIELDS, "uavs": 2}, 0),
    "across": ({**FIELDS, "uavs": [2, 3]}, 12),
    "another order": ({"quota": [40, 20], "uavs": [2, 1], "pads": 2}, 0),
    "other pads": ({**FIELDS, "pads": 1}, 24),
}


@pytest.mark.parametrize("case", OTHERS)
def test_only_what_is_new_is_simulated(case, asking, tmp_path):
    first = asking()[0]
    fields, new = OTHERS[case]
    question, results, done = asking(fields)
    assert question.out != first.out
    assert done == new
    check_equal_to_a_fresh_run(question, results, tmp_path)
    assert asking(fields)[2] == 0


def _no_manifest(folder):
    (folder / "manifest.json").write_text("{}")


def _cut(folder):
    for path in folder.glob("missions/*/*.parquet"):
        path.write_bytes(path.read_bytes()[:-9])


def _accepted(folder):
    path = folder / "manifest.json"
    change = '"accepted": [{"modules": ["dess.model.rules"], "missions": 3}]'
    path.write_text(path.read_text().replace('"accepted": []', change))


@pytest.mark.parametrize("damage", [_no_manifest, _cut, _accepted, shutil.rmtree])
def test_a_damaged_folder_gives_nothing(damage, asking, tmp_path):
    damage(asking()[0].out)
    question, results, done = asking(OTHERS["wider"][0])
    assert done == 36
    check_equal_to_a_fresh_run(question, results, tmp_path)


def test_a_name_is_of_one_question(asking, tmp_path):
    assert asking(name="mine")[2] == 24
    assert asking({**FIELDS, "uavs": [1, 2, 3]}, name="mine")[2] == 12
    before = files_of(tmp_path)
    line = "mine/manifest.json: holds other scenarios .*; allowed: another results folder .*, anoth"
    with pytest.raises(InputError, match=line):
        asking({**FIELDS, "uavs": [2]}, name="mine")
    assert files_of(tmp_path) == before
    assert len(load_results(tmp_path / "results" / "sweeps" / "mine").missions) == 36


VALUES = {
    "fleet": [{"slots_per_cell": 2}, {"flying_time": 60}],
    "initial_data": [5, 30],
    "names": ["Tönning 🌊", "O'Neill", 'a "b"'],
    "zones": [{"cells": [0, 6, 2, 2], "pads": 1}],
    "arrivals.service": "newest",
    "arrivals.process": "continuous",
}


def test_the_command_of_a_question_can_be_pasted(tmp_path):
    """Its options are read as the values that were asked about, in tables and with any letters."""
    scenario = write_scenario(tmp_path)
    made = what_if_question(VALUES, {"uavs": 2}, scenario, ["greedy"], folder=tmp_path)
    words = shlex.split(made.command)
    given = [words[n + 1] for n, word in enumerate(words) if word == "--set"]
    assert options.parse_all_settings(given) == VALUES
    sheet = write_scenario(tmp_path, **SHEET)
    fields = {"data_sheet.data_rate": ["20 kB/h", "3 MB/h"], "data_sheet.wind": ["2 m/s from W"]}
    swept = sweep_question(fields, sheet, ["greedy"], folder=tmp_path)
    words = shlex.split(swept.command)
    given = [words[n + 1] for n, word in enumerate(words) if word == "--set"]
    assert options.parse_all_values(given) == {name: tuple(of) for name, of in fields.items()}


def test_a_search_has_a_policy_for_the_missions_that_it_will_take():
    """It takes more of them than the check of its answer, so it gets a faster policy."""
    values = {"uavs": [1, 2, 3, 4, 5], "pads": [1, 2, 3, 4]}
    requirements = {"success": 0.99}
    same = sweep_question(values, "bay", missions=30).study
    search = sweep_question(values, "bay", prices={"uav": 20_000}, requirements=requirements).study
    assert SECONDS[search.policies[0]] < SECONDS[same.policies[0]]
    assert search.policies[1:] == same.policies[1:] == (BASELINE,)


def test_missions_of_other_sweeps_take_no_time(asking, tmp_path, monkeypatch):
    # Less than 24 missions take.
    monkeypatch.setattr(effort, "LONG_RUN", 0.00015)
    question = sweep_of(FIELDS, tmp_path, missions=6)
    with pytest.raises(InputError, match="24 missions to simulate"):
        question.ask()
    question.ask(yes=True)
    assert asking({**FIELDS, "uavs": [1, 2, 3]})[2] == 12  # of 36


# Field, what is given, and the values that this is.
GIVEN = [
    ("uavs", 3, (3,)),
    ("uavs", range(2, 6), (2, 3, 4, 5)),
    ("uavs", [[1, 3]], ([1, 3],)),
    ("uavs", np.array([2, 4]), (2, 4)),
    ("forbid_swaps", [False, True], (False, True)),
    ("initial_data", np.array([5, 20]), (5, 20)),
    ("initial_data", [[5, 7.5], [7.5, 10]], ([5, 7.5], [7.5, 10])),
    ("zone", [[26, 2, 4, 4], [0, 0, 2, 2]], ([26, 2, 4, 4], [0, 0, 2, 2])),
    ("nodes", [[1, 2], [3, 4]], ([[1, 2], [3, 4]],)),
]


@pytest.mark.parametrize(("field", "given", "values"), GIVEN)
def test_one_value_is_fixed_and_several_are_swept(field, given, values):
    found = values_of(field, given)
    assert found == values
    assert [type(value) for value in found] == [type(value) for value in values]


POLICIES = ["random", "greedy"]


@pytest.mark.parametrize(
    ("settings", "baseline"),
    [
        ({"uavs": 5}, {}),
        ({"uavs": 5}, {"uavs": 3, "quota": 400}),
        ({"pads": 2, "initial_data": [5, 10]}, {"initial_data": 12, "uavs": [2, 3]}),
    ],
)
def test_the_two_points_are_the_scenario_before_and_after(settings, baseline):
    study = what_if_question(settings, baseline, policies=POLICIES).study
    before, after = study.scenarios
    assert before == load_scenario("paper", **baseline)
    assert after == load_scenario("paper", **baseline | settings)


@pytest.mark.parametrize(
    ("settings", "baseline", "measured"),
    [
        ({"age.reward": -1.0}, {}, (True, True)),
        ({"uavs": 5}, {"age.reward": -1.0}, (True, True)),
        ({"age.measured": True, "uavs": 5}, {}, (True, True)),
        ({"age.reward": -1.0}, {"age.measured": False}, (False, False)),
    ],
)
def test_both_sides_measure_what_belongs_to_a_section(settings, baseline, measured):
    study = what_if_question(settings, baseline, policies=POLICIES).study
    assert tuple(space.age.measured for space in study.scenarios) == measured
    assert not any(space.charging.measured for space in study.scenarios)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"settings": {"uavs": 99}}, r"uavs: 99 is out of range"),
        ({"baseline": {"quota": 0}}, r"scenario paper: quota: .*0"),
        ({"settings": {}}, r"settings: none is given; allowed: .*uavs"),
        ({"settings": {"uavs": [1, 3]}}, r"uavs is 1 to 3 in the baseline already"),
        ({"settings": {"pads": 16}}, r"pads is 16 in the baseline already"),
        ({"policies": []}, r"question: policies: .*is too short"),
        ({"policies": "greedy"}, r"question: policies: 'greedy' has the wrong form"),
        ({"seed": -1}, r"question: seed: .*-1"),
    ],
)
def test_what_is_no_question_is_refused_in_one_line(values, message):
    with pytest.raises(InputError, match=message) as caught:
        what_if_question(**{"settings": {"uavs": 5}, "policies": ["greedy"]} | values)
    assert "\n" not in str(caught.value)
