"""A question is two design points in the same realisations, kept in a folder of its own."""

import shlex
import tomllib

import pandas as pd
import pytest

from analysis import load_study
from analysis.ask import what_if
from analysis.ask.what_if import BASELINE, VARIATION
from dess import InputError, load_scenario
from tests.analysis.small import asked, files_of, write_scenario

POLICIES = ["random", "greedy"]
MISSIONS = 12
SETTINGS = {"uavs": 6, "pads": 1}


@pytest.fixture(scope="module")
def ask(tmp_path_factory):
    folder = tmp_path_factory.mktemp("what-if")
    return lambda **changes: asked(folder, **changes)


@pytest.fixture(scope="module")
def results(ask):
    return ask()


@pytest.mark.parametrize(
    ("settings", "baseline"),
    [
        ({"uavs": 5}, {}),
        ({"uavs": 5}, {"uavs": 3, "quota": 400}),
        ({"pads": 2, "initial_data": [5, 10]}, {"initial_data": 12, "uavs": [2, 3]}),
    ],
)
def test_the_two_points_are_the_scenario_before_and_after(settings, baseline):
    study = what_if.question(settings, baseline, policies=POLICIES)
    before, after = (point.scenario for point in study.points)
    assert before == load_scenario("paper", **baseline)
    assert after == load_scenario("paper", **baseline | settings)


@pytest.mark.parametrize(
    ("settings", "baseline", "measured"),
    [
        ({"age.reward": -1.0}, {}, (True, True)),
        ({"age": {"reward": -1.0}}, {}, (True, True)),
        ({"uavs": 5}, {"age.reward": -1.0}, (True, True)),
        ({"age.measured": True}, {}, (False, True)),
        ({"age.measured": True, "uavs": 5}, {}, (True, True)),
        ({"age.reward": -1.0}, {"age.measured": False}, (False, False)),
        ({"wind.strength": 1.0}, {}, (False, False)),
    ],
)
def test_both_sides_measure_what_belongs_to_a_section(settings, baseline, measured):
    study = what_if.question(settings, baseline, policies=POLICIES)
    assert tuple(point.scenario.age.measured for point in study.points) == measured
    assert not any(point.scenario.charging.measured for point in study.points)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"settings": {"uav": 5}},
            r"scenario paper: uav: unknown key .did you mean uavs",
        ),
        ({"settings": {"uavs": 99}}, r"uavs: 99 is out of range; allowed: 1\.\.16"),
        ({"baseline": {"quota": 0}}, r"scenario paper: quota: .*0"),
        ({"settings": {}}, r"settings: none is given; allowed: .*uavs"),
        ({"settings": {"uavs": [1, 3]}}, r"uavs is 1 to 3 in the baseline already; allowed: an"),
        ({"settings": {"uavs": 2}, "baseline": {"uavs": 2}}, r"uavs is 2 in the baseline already"),
        ({"settings": {"pads": 16}}, r"pads is 16 in the baseline already"),
        (
            {"policies": ["gredy"]},
            r"question: policies: .*'gredy' is unknown .did you mean greedy",
        ),
        ({"policies": []}, r"question: policies: .*is too short"),
        ({"policies": 3}, r"question: policies: 3 has the wrong form"),
        ({"policies": "greedy"}, r"question: policies: 'greedy' has the wrong form"),
        ({"missions": 1}, r"missions: 1 is too few; allowed: 2 or more"),
        ({"missions": "many"}, r"question: missions: .*'many'"),
        ({"seed": -1}, r"question: seed: .*-1"),
        ({"scenario": "papr"}, r"papr: no such scenario .did you mean paper"),
    ],
)
def test_what_is_no_question_is_refused_in_one_line(values, message):
    with pytest.raises(InputError, match=message) as caught:
        what_if.question(**{"settings": {"uavs": 5}, "policies": ["greedy"]} | values)
    assert "\n" not in str(caught.value)


def test_who_is_shown_must_be_asked_about():
    study = what_if.question({"uavs": 5}, policies=["greedy"])
    what_if.check_policy(study, "greedy")
    with pytest.raises(InputError, match="shown: 'tour' is not asked about; allowed: greedy"):
        what_if.check_policy(study, "tour")


def test_a_policy_that_cannot_act_in_the_variation_leaves_nothing_behind(tmp_path):
    study = what_if.question({"zone": [0, 0, 4, 4]}, policies=["ddqn"], missions=2)
    with pytest.raises(InputError, match="policy ddqn: has learned zone_x 26, not 0; allowed: "):
        what_if.ask(study, tmp_path)
    assert not list(tmp_path.iterdir())


def test_questions_lie_side_by_side_and_the_same_one_is_found_again(ask, results):
    folders = {results.store.folder}
    for changes in (
        {"settings": {"uavs": 5}},
        {"baseline": {}},
        {"policies": ["greedy"]},
        {"seed": 4},
    ):
        folders.add(ask(missions=2, **changes).store.folder)
    assert len(folders) == 5
    assert {folder.parent for folder in folders} == {results.store.folder.parent}
    before = files_of(results.store.folder)
    assert ask().store.folder == results.store.folder
    assert files_of(results.store.folder) == before


def test_more_missions_top_up_what_is_there(ask):
    few = ask(missions=5, seed=8)
    kept = {name for name in files_of(few.store.folder) if name.startswith("missions")}
    more = ask(missions=9, seed=8)
    assert more.store.folder == few.store.folder
    assert kept < files_of(more.store.folder).keys()
    first = more.missions[more.missions["replication"] < 5].reset_index(drop=True)
    pd.testing.assert_frame_equal(first, few.missions)
    pd.testing.assert_frame_equal(ask(missions=5, seed=8).missions, few.missions)


def test_both_sides_meet_the_same_realisations(results):
    sides = results.missions.pivot(
        index=["policy", "replication"], columns="point", values=["initial", "flying_time", "uavs"]
    )
    for field in ("initial", "flying_time"):
        assert (sides[field, BASELINE] == sides[field, VARIATION]).all()
        assert sides[field, BASELINE].nunique() > 1
    assert (sides["uavs", BASELINE] == 2).all() and (sides["uavs", VARIATION] == 6).all()


def test_fields_that_change_come_before_those_of_both_sides(ask):
    table = what_if.field_table(ask(missions=2, baseline={"uavs": 2, "quota": 50}))
    sides = table.set_index("Field")[["Baseline", "Variation"]]
    assert sides.index[:3].tolist() == ["uavs", "pads", "quota"]
    assert sides.loc["uavs"].tolist() == ["2", "6"]
    assert sides.loc["pads"].tolist() == ["6", "1"]  # the zone of the small scenario has six cells
    assert sides.loc["quota"].tolist() == ["50", "50"]
    assert sides.loc["flying_time"].tolist() == ["20 to 30", "20 to 30"]


def test_values_in_words():
    paper = load_scenario("paper")
    words = {field: what_if.in_words(paper, field) for field in ("nodes", "zone", "forbid_swaps")}
    assert words == {"nodes": "25 cells", "zone": "26, 2, 4, 4", "forbid_swaps": "no"}
    assert what_if.in_words(paper, "arrival_rate") == "0.02"
    assert what_if.in_words(load_scenario("paper", initial_data=12.5), "initial_data") == "12.5"


def test_the_command_asks_the_same_question(results):
    words = shlex.split(what_if.command(results))
    assert words[:3] == ["dess", "report", "what-if"]
    read = {"--set": {}, "--parameter": {}}
    for option, text in zip(words[3::2], words[4::2], strict=True):
        field, _, value = text.partition("=")
        read[option] |= {field: tomllib.loads(f"value = {value}")["value"]}
    assert read["--set"] == SETTINGS
    asked = read["--parameter"]
    assert asked == {
        "baseline": {"uavs": 2},
        "scenario": "small.toml",
        "policies": POLICIES,
        "missions": MISSIONS,
        "seed": 3,
    }


def test_the_question_is_a_study_file(results, tmp_path):
    write_scenario(tmp_path)
    (tmp_path / "sweep.toml").write_text(what_if.as_toml(results), "utf-8")
    study = load_study(tmp_path / "sweep.toml")
    assert [point.scenario for point in study.points] == [results.scenario(p) for p in (0, 1)]
    assert (study.policies, study.missions, study.seed) == (tuple(POLICIES), MISSIONS, 3)
