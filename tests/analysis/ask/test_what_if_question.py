"""Questions: two design points in the same realisations, and what their missions answer."""

import shlex
import tomllib
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from analysis import load_study
from analysis.ask import what_if
from analysis.ask.what_if import BASELINE, VARIATION
from analysis.metrics import PRODUCT
from analysis.stats.intervals import LEVEL
from analysis.stats.verdict import ABOVE, BELOW, INCONCLUSIVE
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
    before, after = study.scenarios
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
    assert tuple(space.age.measured for space in study.scenarios) == measured
    assert not any(space.charging.measured for space in study.scenarios)


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
    assert [*study.scenarios] == [results.scenario(p) for p in (0, 1)]
    assert (study.policies, study.missions, study.seed) == (tuple(POLICIES), MISSIONS, 3)


def row(difference, low, high, p=0.01, n=100):
    """A row of an answer."""
    return pd.Series({"difference": difference, "low": low, "high": high, "p": p, "n": n})


def test_measures_of_sections_are_compared_and_nothing_fails_where_nothing_can(tmp_path):
    changes = {"age.reward": -1.0, "failures.uav_rate": 0.2}
    results = asked(tmp_path, 6, settings=changes, policies=["greedy"])
    assert {"age", "failures"} <= {*what_if.measured(results)}
    answers = what_if.answers(results).set_index("metric")
    sides = results.missions.pivot(index="replication", columns="point", values="age")
    change = (sides[VARIATION] - sides[BASELINE]).mean()
    assert answers.loc["age", "difference"] == pytest.approx(change)
    assert (answers.loc["failures", "before"], answers.loc["failures", "n"]) == (0, 6)
    failed = results.missions.query("point == @VARIATION")["failures"].mean()
    assert answers.loc["failures", "difference"] == pytest.approx(failed) and failed > 0
    assert what_if.means(results).query("metric == 'age'")["mean"].tolist() == (
        pytest.approx(answers.loc["age", ["before", "after"]].tolist())
    )


def test_what_one_side_measures_has_no_difference(tmp_path):
    results = asked(tmp_path, 4, settings={"age.measured": True}, policies=["greedy"])
    table = what_if.answers(results)
    answers = table.set_index("metric")
    assert np.isnan(answers.loc["age", ["before", "difference"]].astype(float)).all()
    assert (answers.loc["age", "n"], answers.loc["success", "n"]) == (0, 4)
    lines = what_if.answer_table(table, "greedy").set_index("Mean per mission")
    line = lines.loc["Age of information [mission slots]"]
    mean = results.missions["age"].mean()
    assert line.tolist() == ["–", f"{mean:.2f}", ""]


@pytest.mark.parametrize(
    ("answer", "side"),
    [
        (row(0.2, 0.1, 0.3), ABOVE),
        (row(-0.2, -0.3, -0.1), BELOW),
        (row(0.1, -0.1, 0.3), INCONCLUSIVE),
        (row(0.0, 0.0, 0.0, p=1.0), INCONCLUSIVE),
        (row(0.5, 0.5, 0.5, p=0.5, n=2), INCONCLUSIVE),  # two equal differences prove nothing
        (row(0.5, 0.5, 0.5, p=0.002, n=10), ABOVE),
    ],
)
def test_the_whole_interval_decides(answer, side):
    assert what_if.verdict(answer) == side


def test_so_many_missions_show_the_difference_that_was_seen():
    """So many normal differences of that mean and spread are significant with that power."""
    n, gap, spread = 400, 0.05, 0.8
    half = stats.t.isf((1 - LEVEL) / 2, n - 1) * spread / np.sqrt(n)
    needed = what_if.missions_needed(row(gap, gap - half, gap + half, n=n))
    edge = stats.t.isf((1 - LEVEL) / 2, needed - 1)
    power = stats.nct.sf(edge, needed - 1, gap / spread * np.sqrt(needed))
    assert power == pytest.approx(what_if.POWER, abs=0.02)
    assert what_if.missions_needed(row(-gap, -gap - half, -gap + half, n=n)) == needed
    for nothing in (row(0.0, -half, half), row(0.0, 0.0, 0.0), row(gap, gap, gap)):
        assert what_if.missions_needed(nothing) == np.inf


def with_missions(results, before, after, ratios):
    """The results with other missions of a single policy."""
    columns = {"replication": range(len(before)), "policy": "greedy"}
    sides = [
        pd.DataFrame({**columns, "point": p, PRODUCT: values, "collection_ratio": ratios})
        for p, values in ((BASELINE, before), (VARIATION, after))
    ]
    return replace(results, missions=pd.concat(sides, ignore_index=True))


def test_the_typical_mission_has_the_median_difference_and_the_worst_the_least_left(results):
    before, after = [0.5, 0.5, 0.9, 0.1, 0.9], [0.6, 0.4, 0.0, 0.3, 0.0]
    made = with_missions(results, before, after, [0.6, 0.4, 0.8, 0.3, 0.7])
    # Differences: +0.1, -0.1, -0.9, +0.2, -0.9.
    assert what_if.typical(made, "greedy") == 1
    assert what_if.worst(made, "greedy") == 4
    assert what_if.differences(made, "greedy").tolist() == pytest.approx(
        [0.1, -0.1, -0.9, 0.2, -0.9]
    )
    even = with_missions(results, [0.0] * 4, [0.4, 0.1, 0.2, 0.2], [0.5] * 4)
    assert what_if.typical(even, "greedy") == 2  # the lower middle, of those alike the first
    assert what_if.worst(even, "greedy") == 1


def test_the_best_policy_of_each_side_is_found(results):
    table = what_if.means(results)
    for point in (BASELINE, VARIATION):
        side = table[(table["point"] == point) & (table["metric"] == PRODUCT)]
        best = side.loc[side["mean"].idxmax(), "policy"]
        assert what_if.best_policy(results, point) == best


def answer_of(metric, difference, low, high, **more):
    """A table of answers with a single row."""
    values = {"policy": "greedy", "metric": metric, "before": 0.9, "after": 0.9 + difference}
    values |= {"difference": difference, "low": low, "high": high, "p": 0.2, "n": 100}
    return pd.DataFrame([values | more])


@pytest.mark.parametrize(
    ("ends", "words"),
    [
        ((0.05, 0.04, 0.06), "is **higher** in the variation, by +5.0 [+4.0, +6.0] points"),
        ((-0.05, -0.06, -0.04), "is **lower** in the variation, by −5.0 [−6.0, −4.0] points"),
        ((0.0, -0.01, 0.01), "is **inconclusive**, by 0.0 [−1.0, +1.0] points"),
    ],
)
def test_a_conclusion_names_the_side_of_the_whole_interval(ends, words):
    text = what_if.conclusions(answer_of(PRODUCT, *ends))
    assert text.startswith(f"- **greedy**: product {words}: from 90.0 %")


def test_an_inconclusive_answer_says_how_many_missions_it_takes():
    few = what_if.conclusions(answer_of(PRODUCT, 0.01, -0.01, 0.03))
    assert "about 820 missions (instead of 100) show it with a probability of 80 %" in few
    none = what_if.conclusions(answer_of(PRODUCT, 0.0, 0.0, 0.0))
    assert "These missions do not tell how many would show a difference." in none
