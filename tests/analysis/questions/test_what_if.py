"""A question is two design points on the same seas, and its answer follows from their missions."""

import shlex
import tomllib
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from analysis import load_study
from analysis.figures import what_if as what_if_figures
from analysis.names import METRICS, PRODUCT
from analysis.questions import what_if
from analysis.questions.what_if import BASELINE, HIGHER, INCONCLUSIVE, LOWER, VARIATION
from analysis.stats.intervals import LEVEL
from analysis.stats.paired import paired
from dess import load_scenario
from dess.errors import InputError
from tests.analysis.small import files_of, write_scenario

POLICIES = ["random", "greedy"]
MISSIONS = 12
SETTINGS = {"uavs": 6, "pads": 1}


@pytest.fixture(scope="module")
def ask(tmp_path_factory):
    """The small scenario asked, about more UAVs at a single pad."""
    folder = tmp_path_factory.mktemp("what-if")
    scenario = write_scenario(folder)

    def ask(missions=MISSIONS, **changes):
        values = {"settings": SETTINGS, "baseline": {"uavs": 2}, "policies": POLICIES, "seed": 3}
        values |= {"scenario": scenario, "missions": missions}
        return what_if.ask(what_if.question(**values | changes), folder)

    return ask


@pytest.fixture(scope="module")
def results(ask):
    return ask()


def row(difference, low, high, p=0.01, n=100):
    """A row of an answer."""
    return pd.Series({"difference": difference, "low": low, "high": high, "p": p, "n": n})


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
    ("values", "told"),
    [
        ({"settings": {"uav": 5}}, r"scenario paper: uav: unknown key; allowed: .*uavs"),
        ({"settings": {"uavs": 99}}, r"uavs: 99 is not within 1\.\.16"),
        ({"baseline": {"quota": 0}}, r"scenario paper: quota: .*0"),
        ({"settings": {}}, r"settings: none is given; allowed: .*uavs"),
        ({"settings": {"uavs": [1, 3]}}, r"uavs is 1 to 3 in the baseline already; allowed: an"),
        ({"settings": {"uavs": 2}, "baseline": {"uavs": 2}}, r"uavs is 2 in the baseline already"),
        ({"settings": {"pads": 16}}, r"pads is 16 in the baseline already"),
        ({"policies": ["gredy"]}, r"question: policies: .*'gredy' is unknown; allowed: .*greedy"),
        ({"policies": []}, r"question: policies: .*at least 1"),
        ({"missions": 1}, r"missions: 1 is too few; allowed: 2 or more"),
        ({"missions": "many"}, r"question: missions: .*'many'"),
        ({"seed": -1}, r"question: seed: .*-1"),
        ({"scenario": "papr"}, r"papr: no such scenario; allowed: .*paper"),
    ],
)
def test_what_is_no_question_is_refused_in_one_line(values, told):
    with pytest.raises(InputError, match=told) as caught:
        what_if.question(**{"settings": {"uavs": 5}, "policies": ["greedy"]} | values)
    assert "\n" not in str(caught.value)


def test_who_is_shown_must_be_asked_about():
    study = what_if.question({"uavs": 5}, policies=["greedy"])
    what_if.check_policy(study, "greedy")
    with pytest.raises(InputError, match="shown: 'tour' is not asked about; allowed: greedy"):
        what_if.check_policy(study, "tour")


def test_a_policy_that_cannot_fly_the_variation_leaves_nothing_behind(tmp_path):
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


def test_both_sides_meet_the_same_seas(results):
    sides = results.missions.pivot(
        index=["policy", "replication"], columns="point", values=["initial", "flying_time", "uavs"]
    )
    for field in ("initial", "flying_time"):
        assert (sides[field, BASELINE] == sides[field, VARIATION]).all()
        assert sides[field, BASELINE].nunique() > 1
    assert (sides["uavs", BASELINE] == 2).all() and (sides["uavs", VARIATION] == 6).all()


def test_measures_are_those_of_the_uavs(results):
    missions = what_if.missions_of(results)
    assert len(missions) == len(results.missions) == 2 * 2 * MISSIONS
    for mission in missions.itertuples():
        own = results.uavs.query(
            "policy == @mission.policy and point == @mission.point "
            "and replication == @mission.replication"
        )
        assert mission.dry == 100 * list(own["end"]).count("battery")
        assert mission.waiting_per_uav == pytest.approx(own["slots_waiting"].mean())
        assert mission.charging_per_uav == pytest.approx(own["slots_charging"].mean())
        assert mission.collected_per_uav == pytest.approx(own["collected"].mean())
    assert missions["waiting_per_uav"].max() > 0 and missions["dry"].max() > 0


def test_answers_are_paired_comparisons(results):
    answers = what_if.answers(results)
    missions = what_if.missions_of(results)
    assert len(answers) == len(POLICIES) * (len(METRICS) + len(what_if.MEASURES))
    for answer in answers.itertuples():
        own = missions[missions["policy"] == answer.policy]
        before, after = (own[own["point"] == p][answer.metric].to_numpy(float) for p in (0, 1))
        assert answer.before == pytest.approx(before.mean())
        assert answer.after == pytest.approx(after.mean())
        same = paired(after, before, share=answer.metric == "success")
        found = (answer.difference, answer.low, answer.high, answer.n)
        assert found == pytest.approx((same.difference, same.low, same.high, MISSIONS))


def test_means_are_of_the_papers_metrics(results):
    table = what_if.means(results).set_index(["policy", "point", "metric"])
    assert len(table) == len(POLICIES) * 2 * len(METRICS)
    for answer in what_if.answers(results).itertuples():
        if answer.metric in METRICS:
            key = (answer.policy, VARIATION, answer.metric)
            assert table.loc[key, "mean"] == pytest.approx(answer.after)


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        (row(0.2, 0.1, 0.3), HIGHER),
        (row(-0.2, -0.3, -0.1), LOWER),
        (row(0.1, -0.1, 0.3), INCONCLUSIVE),
        (row(0.0, 0.0, 0.0, p=1.0), INCONCLUSIVE),
        (row(0.5, 0.5, 0.5, p=0.5, n=2), INCONCLUSIVE),  # two equal differences prove nothing
        (row(0.5, 0.5, 0.5, p=0.002, n=10), HIGHER),
    ],
)
def test_the_whole_interval_decides(answer, told):
    assert what_if.verdict(answer) == told


def test_so_many_missions_tell_the_difference_that_was_seen():
    """With that many, normal differences of that mean and spread are told as often as said."""
    n, gap, spread = 400, 0.05, 0.8
    half = stats.t.isf((1 - LEVEL) / 2, n - 1) * spread / np.sqrt(n)
    needed = what_if.missions_to_tell(row(gap, gap - half, gap + half, n=n))
    edge = stats.t.isf((1 - LEVEL) / 2, needed - 1)
    power = stats.nct.sf(edge, needed - 1, gap / spread * np.sqrt(needed))
    assert power == pytest.approx(what_if.POWER, abs=0.02)
    assert what_if.missions_to_tell(row(-gap, -gap - half, -gap + half, n=n)) == needed
    for nothing in (row(0.0, -half, half), row(0.0, 0.0, 0.0), row(gap, gap, gap)):
        assert what_if.missions_to_tell(nothing) == np.inf


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
        own = table[(table["point"] == point) & (table["metric"] == PRODUCT)]
        best = own.loc[own["mean"].idxmax(), "policy"]
        assert what_if.best_policy(results, point) == best


def test_values_are_told_in_words(results):
    assert [(c.field, c.before, c.after) for c in what_if.changes(results)] == [
        ("uavs", "2", "6"),
        ("pads", "6", "1"),  # the zone of the small scenario has six cells
    ]
    assert what_if.shared(results) == {}
    drawn = what_if.drawn(results)
    assert drawn["flying_time"] == "20 to 30" and "uavs" not in drawn
    paper = load_scenario("paper")
    told = {field: what_if.told(paper, field) for field in ("nodes", "zone", "forbid_swaps")}
    assert told == {"nodes": "25 cells", "zone": "26, 2, 4, 4", "forbid_swaps": "no"}
    assert what_if.told(paper, "arrival_rate") == "0.02"
    assert what_if.told(load_scenario("paper", initial_data=12.5), "initial_data") == "12.5"


def test_the_command_asks_the_same_question(results):
    words = shlex.split(what_if.command(results))
    assert words[:3] == ["dess", "report", "what-if"]
    found = {"--set": {}, "--parameter": {}}
    for option, text in zip(words[3::2], words[4::2], strict=True):
        field, _, value = text.partition("=")
        found[option] |= {field: tomllib.loads(f"value = {value}")["value"]}
    assert found["--set"] == SETTINGS
    asked = found["--parameter"]
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


def drawn_interval(bar, axis):
    """(N, 2) the ends of error bars."""
    return np.array([segment[:, axis] for segment in bar.lines[2][0].get_segments()])


def test_figures_show_the_means_and_the_gains(results):
    table, answers = what_if.means(results), what_if.answers(results)
    settings = (["uavs 2", "pads 6"], ["uavs 6", "pads 1"])
    for metric in METRICS:
        (ax,) = what_if_figures.means(table, metric, settings).axes
        ticks = [tick.get_text() for tick in ax.get_xticklabels()]
        assert ticks == ["baseline\nuavs 2\npads 6", "variation\nuavs 6\npads 1"]
        for bar, policy in zip(ax.containers, POLICIES, strict=True):
            own = table[(table["metric"] == metric) & (table["policy"] == policy)]
            assert bar.lines[0].get_ydata() == pytest.approx(own["mean"])
            assert drawn_interval(bar, 1) == pytest.approx(own[["low", "high"]].to_numpy())
    (ax,) = what_if_figures.gains(answers).axes
    for bar, policy in zip(ax.containers, POLICIES, strict=True):
        own = answers[answers["policy"] == policy].set_index("metric").loc[[*METRICS]]
        assert bar.lines[0].get_xdata() == pytest.approx(own["difference"])
        assert drawn_interval(bar, 0) == pytest.approx(own[["low", "high"]].to_numpy())


def test_the_spread_is_the_share_of_missions_up_to_a_difference():
    gaps = {
        "ours": pd.Series([0.0, 0.1, -0.5, 0.1]),
        "theirs": pd.Series(np.linspace(-0.02, 0.04, 100)),
    }
    above, below = what_if_figures.spread(gaps).axes
    for ax in (above, below):
        for line, own in zip(ax.lines, gaps.values(), strict=False):
            for x, share in list(zip(line.get_xdata(), line.get_ydata(), strict=True))[1:]:
                assert share <= (own <= x).mean()
            assert line.get_ydata()[0] == 0 and line.get_ydata()[-1] == 1
    assert below.get_xlim()[0] > above.get_xlim()[0]


def test_figures_of_missions_all_alike_are_drawn():
    what_if_figures.spread({"ours": pd.Series([0.0, 0.0])}).canvas.draw()
