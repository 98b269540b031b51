"""``dess.analysis.sweep`` and ``dess.analysis.what_if``: what the answers to questions offer."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import tqdm.notebook
from matplotlib.figure import Figure
from scipy import stats

from dess import InputError
from dess.analysis import numbers, sweep, what_if
from dess.analysis.answers import sides as paired
from dess.analysis.answers.settings.points import varied_values
from dess.analysis.answers.sides import BASELINE, VARIATION
from dess.analysis.answers.variation import Variation, format_change
from dess.analysis.ask.answer import _progress_bar
from dess.analysis.metrics import PRODUCT, SUCCESS
from dess.analysis.stats.corrections import adjust_p_values
from dess.analysis.stats.differences import compare_pairs
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.verdict import (
    ABOVE,
    BELOW,
    INCONCLUSIVE,
    SEEN_ABOVE,
    SEEN_BELOW,
    judge_difference,
)
from tests.analysis.small import asked, found_of, write_scenario

POLICIES = ["random", "greedy"]


@pytest.fixture
def asking(tmp_path):
    """Asks a sweep of the small scenario."""

    def run(missions=6, progress=False, **fields):
        return sweep(
            write_scenario(tmp_path), POLICIES, missions, 3, tmp_path, progress=progress, **fields
        )

    return run


def test_settings_are_ranked(asking):
    answer = asking(uavs=range(1, 3), quota=np.array([20, 40]), pads=2)
    assert [*varied_values(answer.results)] == ["uavs", "quota"]
    table = answer.table()
    assert len(table) == 2 * 2 * 2
    assert [*table["rank"]] == [*range(1, 9)]
    assert table[PRODUCT].is_monotonic_decreasing
    best = answer.best()
    assert [*best["policy"]] == [*table["policy"].unique()]
    assert best["rank"].iloc[0] == 1
    assert answer.headline().startswith(f"The best is {table['policy'][0]} with ")
    assert numbers.format_percent(table[PRODUCT][0]) in answer.headline()
    found = table[table["policy"] != table["policy"][0]].iloc[0]
    other = found_of(answer.facts())[f"with {found['policy']}"]
    assert other.startswith(f"{found['uavs']} UAV")
    assert numbers.format_percent(found[PRODUCT]) in other


def test_the_cheapest_settings_are_the_best(asking):
    fleets = {"uavs": [1, 2], "quota": [20, 40]}
    best = asking(prices={"uav": 7}, requirements={"ratio": 0.1}, **fleets).best()
    assert best[["uavs", "quota"]].drop_duplicates().to_numpy().tolist() == [[1, 20], [1, 40]]


def test_a_plot_is_over_the_first_fields(asking):
    answer = asking(missions=2, uavs=[1, 2], quota=[20, 40])
    assert isinstance(answer.plot(), Figure)
    assert answer.plot().axes[0].get_xlabel() == answer.plot("uavs", "quota").axes[0].get_xlabel()
    with pytest.raises(InputError, match="pads: has not several values"):
        answer.plot("pads")
    with pytest.raises(InputError, match="x: no field is swept"):
        asking(missions=2, uavs=1).plot()


MISSIONS = 12


@pytest.fixture(scope="module")
def answer(tmp_path_factory):
    return asked(tmp_path_factory.mktemp("what-if"))


def row_of(before, difference, low, high):
    """A row of ``compare_sides`` on the product of greedy."""
    about = {"policy": "greedy", "metric": PRODUCT, "before": before, "after": before + difference}
    return pd.Series({**row(difference, low, high, p=0.2), **about, "n": 100})


def row(difference, low, high, p=0.01, n=100, p_student=1.0):
    """A row of an answer, without an allowance for rare failures."""
    ends = {"difference": difference, "low": low, "high": high, "p": p, "p_student": p_student}
    return pd.Series({**ends, "n": n, "student": (high - low) / 2})


def test_measures_of_sections_are_compared_and_nothing_fails_where_nothing_can(tmp_path):
    changes = {"age.reward": -1.0, "failures.uav_rate": 0.2, "failures.uav_repair": 3.0}
    results = asked(tmp_path, 6, settings=changes, policies=["greedy"]).results
    answers = paired.compare_sides(results).set_index("metric")
    sides = results.missions.pivot(index="replication", columns="point", values="age")
    change = (sides[VARIATION] - sides[BASELINE]).mean()
    assert answers.loc["age", "difference"] == pytest.approx(change)
    assert (answers.loc["failures", "before"], answers.loc["failures", "n"]) == (0, 6)
    failed = results.missions.query("point == @VARIATION")["failures"].mean()
    assert answers.loc["failures", "difference"] == pytest.approx(failed) and failed > 0
    # The baseline cannot have a failure, so the variation cannot have fewer.
    assert answers.loc[["failures", "slots_grounded"], "low"].min() >= 0


def test_what_is_called_adjusted_is_adjusted(answer):
    for _, rows in paired.compare_sides(answer.results).groupby("policy"):
        known = rows[rows["p"].notna()]
        expected = adjust_p_values(known["p"].to_numpy(), "holm")
        assert known["p_adjusted"].tolist() == expected.tolist()


def test_nobody_waits_where_there_is_a_pad_for_every_uav(tmp_path):
    """No rare mission has a wait, so the interval of the difference has no length."""
    answer = asked(tmp_path, 4, settings={"uavs": 3, "quota": 40}, policies=["greedy"])
    answers = answer.table().set_index("metric")
    assert answers.loc["waiting_per_uav", ["difference", "low", "high"]].tolist() == [0.0, 0.0, 0.0]


def test_a_mean_per_uav_is_that_over_the_uavs_of_the_mission(answer):
    mission = ["policy", "point", "replication"]
    missions = paired.missions_of(answer.results).set_index(mission)
    of_uavs = answer.results.uavs.groupby(mission)[["slots_charging", "slots_waiting"]].mean()
    for column, name in zip(of_uavs, ("charging_per_uav", "waiting_per_uav"), strict=True):
        assert missions[name].any()
        np.testing.assert_allclose(missions[name], of_uavs[column].reindex(missions.index))


def test_what_one_side_measures_has_no_difference(tmp_path):
    answer = asked(tmp_path, 4, settings={"age.measured": True}, policies=["greedy"])
    answers = answer.table().set_index("metric")
    assert np.isnan(answers.loc["age", ["before", "difference"]].astype(float)).all()
    assert (answers.loc["age", "n"], answers.loc["success", "n"]) == (0, 4)
    lines = answer.variation.measures_table("greedy").cells.set_index("greedy")
    line = lines.loc["Age of information [mission slots]"]
    mean = answer.results.missions["age"].mean()
    assert line.tolist() == ["–", f"{mean:.2f}", ""]


def test_an_answer_says_in_how_many_missions_uavs_can_fly_home(answer, tmp_path):
    missions = answer.results.missions
    found = found_of(answer.facts())
    for policy in POLICIES:
        of_policy = missions[missions["policy"] == policy].groupby("point")["home"].mean()
        before, after = (f"{100 * share:.1f} %" for share in of_policy)
        said = found[f"battery for the way home with {policy}"]
        assert said == f"{before} before, {after} after"
    landing = asked(tmp_path, 4, baseline={"uavs": 2, "landing": True})
    assert "way home" not in str(landing.facts())


def test_missions_without_a_quota_have_no_allowance_for_being_shorter(tmp_path):
    changes = {
        "baseline": {"uavs": 2, "quota": 0, "landing": True, "max_slots": 60},
        "policies": ["greedy"],
    }
    same = asked(tmp_path, 6, **changes).table().set_index("metric").loc["slots"]
    assert same[["difference", "low", "high", "p"]].tolist() == [0, 0, 0, 1]
    longer = asked(tmp_path, 6, **changes, settings={"max_slots": 75})
    other = longer.table().set_index("metric").loc["slots"]
    assert other[["difference", "low", "high"]].tolist() == [15, 15, 15]
    assert judge_difference(other) == ABOVE


@pytest.mark.parametrize(
    ("answer", "side"),
    [
        (row(-0.2, -0.3, -0.1), BELOW),
        (row(0.1, -0.1, 0.3), INCONCLUSIVE),
        (row(0.1, -0.1, 0.3, p=0.2, p_student=0.001), SEEN_ABOVE),
        (row(-0.1, -0.3, 0.1, p=0.2, p_student=0.001), SEEN_BELOW),
        # Two equal differences prove nothing.
        (row(0.5, 0.5, 0.5, p=0.5, n=2), INCONCLUSIVE),
        (row(0.5, 0.5, 0.5, p=0.002, n=10), ABOVE),
    ],
)
def test_the_whole_interval_decides(answer, side):
    assert judge_difference(answer) == side


def test_so_many_missions_show_the_difference_that_was_seen():
    """So many normal differences of that mean and spread are significant with that power."""
    n, gap, spread = 400, 0.05, 0.8
    half = stats.t.isf((1 - LEVEL) / 2, n - 1) * spread / np.sqrt(n)
    needed = paired.missions_needed(row(gap, gap - half, gap + half, n=n))
    edge = stats.t.isf((1 - LEVEL) / 2, needed - 1)
    power = stats.nct.sf(edge, needed - 1, gap / spread * np.sqrt(needed))
    assert power == pytest.approx(paired.POWER, abs=0.02)
    assert paired.missions_needed(row(-gap, -gap - half, -gap + half, n=n)) == needed
    for nothing in (row(0.0, -half, half), row(0.0, 0.0, 0.0), row(gap, gap, gap)):
        assert paired.missions_needed(nothing) == np.inf


def test_what_is_allowed_for_rare_failures_falls_with_the_number_of_missions():
    def pairs(n):
        baseline = np.full(n, 0.5)
        values = baseline + 0.014 + 0.01 * np.resize([-1, 1], n)
        return pd.Series(compare_pairs(values, baseline, metric=PRODUCT)._asdict())

    needed = int(paired.missions_needed(pairs(40)))
    assert pairs(40).low < 0 < pairs(needed).low
    assert pairs(needed // 2).low < 0


def test_a_gain_in_most_missions_is_better_in_what_was_seen(answer):
    """Better in 234 of 300 pairs, and no failure: Student's t shows it, a rare failure may undo it.

    The ratio and the collected data, of which it is a share, have the same verdict.
    """
    n = 300
    before = np.linspace(0.7, 0.9, n)
    gains = 0.004 * np.where(np.arange(n) % 50 < 39, 1.0, -1.0)
    missions = answer.results.missions
    (like,) = missions.head(1).to_dict("records")
    rows = [
        like | {"point": p, "replication": k, "collection_ratio": r, PRODUCT: r, SUCCESS: 1.0}
        | {"initial": 300.0, "arrived": 0.0, "collected": 300.0 * r, "residual": 300.0 * (1 - r)}
        for p, ratios in ((BASELINE, before), (VARIATION, before + gains))
        for k, r in enumerate(ratios)
    ]  # fmt: skip
    one = answer.results.uavs.merge(missions.head(1)[["policy", "point", "replication"]])
    uavs = [one.assign(point=row["point"], replication=row["replication"]) for row in rows]
    made = replace(answer.results, missions=pd.DataFrame(rows), uavs=pd.concat(uavs))
    assert (gains > 0).sum() == 234
    table = paired.compare_sides(made).set_index("metric")
    verdicts = {m: judge_difference(table.loc[m]) for m in (PRODUCT, "collection_ratio")}
    verdicts |= {m: judge_difference(table.loc[m]) for m in ("collected", "collected_per_uav")}
    assert {*verdicts.values()} == {SEEN_ABOVE}
    assert judge_difference(table.loc["residual"]) == SEEN_BELOW
    variation = Variation(made, like["policy"])
    policy = like["policy"]
    said = found_of(variation.facts())
    assert said[f"product with {policy}"].startswith("+0")
    assert "higher in what was seen" in said[f"product with {policy}"]
    assert said[f"300 pairs with {policy}"] == "better in 78.0 %, worse in 22.0 %"
    assert f"missions to show it with {policy}" in said
    ratio = variation.measures_table(like["policy"]).cells.set_index(like["policy"])
    assert ratio.loc["Collection ratio", "Paired difference"].startswith("△ ")


def with_missions(answer, before, after, ratios):
    """The answer with other missions of a single policy."""
    columns = {"replication": range(len(before)), "policy": "greedy"}
    sides = [
        pd.DataFrame({**columns, "point": p, PRODUCT: values, "collection_ratio": ratios})
        for p, values in ((BASELINE, before), (VARIATION, after))
    ]
    results = replace(answer.results, missions=pd.concat(sides, ignore_index=True))
    return replace(answer, results=results, shown="greedy")


def test_the_typical_mission_has_the_median_difference_and_the_worst_the_least_left(answer):
    before, after = [0.5, 0.5, 0.9, 0.1, 0.9], [0.6, 0.4, 0.0, 0.3, 0.0]
    made = with_missions(answer, before, after, [0.6, 0.4, 0.8, 0.3, 0.7])
    differences = paired.paired_differences(made.results, "greedy").tolist()
    assert differences == pytest.approx([0.1, -0.1, -0.9, 0.2, -0.9])
    assert (made.variation.typical().replication, made.variation.worst().replication) == (1, 4)
    even = with_missions(answer, [0.0] * 4, [0.4, 0.1, 0.2, 0.2], [0.5] * 4)
    # The lower middle, of those alike the first.
    assert (even.variation.typical().replication, even.variation.worst().replication) == (2, 1)


def test_what_contradicts_the_mean_is_told_by_pairs_and_failures(answer):
    """Better in most missions and worse on average, because of a failed mission."""
    made = with_missions(answer, [0.5] * 4, [0.6, 0.6, 0.6, 0.0], [0.5] * 4)
    missions = made.results.missions
    missions = missions.assign(success=(missions[PRODUCT] > 0).astype(float))
    variation = replace(made, results=replace(made.results, missions=missions)).variation
    row = row_of(0.5, -0.1, -0.3, 0.1)
    said = found_of(variation._leading_facts(row))
    assert said["100 pairs with greedy"] == "better in 75.0 %, worse in 25.0 %"
    assert said["failed missions with greedy"] == "0 before, 1 after"


def test_a_metric_that_is_equal_in_all_missions_has_no_correlation(answer, monkeypatch):
    table = answer.table().assign(variance_reduction=np.nan, correlation=np.nan)
    monkeypatch.setattr("dess.analysis.answers.variation.compare_sides", lambda _: table)
    assert set(answer.variation.pairing()["Correlation"]) == {"no variance"}
    assert "nan" not in answer.variation.pairing().to_string()


def test_the_best_policy_of_each_side_is_found(answer):
    table = paired.means_of_sides(answer.results)
    for point in (BASELINE, VARIATION):
        side = table[(table["point"] == point) & (table["metric"] == PRODUCT)]
        best = side.loc[side["mean"].idxmax(), "policy"]
        assert paired.best_policy_of_side(answer.results, point) == best
    assert answer.variation.shown == best
    assert answer.headline() in answer._repr_markdown_()  # what Jupyter shows
    assert {f"product with {policy}" for policy in POLICIES} <= {*found_of(answer.facts())}


@pytest.mark.parametrize(
    ("ends", "said"),
    [
        ((0.05, 0.04, 0.06), "+5.0 [+4.0, +6.0] points, higher; 90.0 % before, 95.0 % after"),
        ((-0.05, -0.06, -0.04), "−5.0 [−6.0, −4.0] points, lower; 90.0 % before, 85.0 % after"),
        (
            (0.01, -0.01, 0.03),
            "+1.0 [−1.0, +3.0] points, inconclusive; 90.0 % before, 91.0 % after",
        ),
    ],
)
def test_a_difference_is_told_with_its_verdict_or_how_many_missions_it_takes(answer, ends, said):
    facts = found_of(answer.variation._leading_facts(row_of(0.9, *ends)))
    assert facts["product with greedy"] == said
    needed = facts.get("missions to show it with greedy")
    assert needed == (None if ends[1] * ends[2] > 0 else "about 820 for a probability of 80 %")


def test_a_headline_has_at_most_25_words(answer, tmp_path):
    many = asked(tmp_path, 2, settings={"uavs": 3, "pads": 1, "quota": 30, "grid": 9})
    for each in (answer, many):
        assert len(each.headline().split()) <= 25
    assert many.headline().startswith("4 changed fields: product with ")


def test_captions_say_what_the_figures_show(answer):
    """Of each policy how it differs, with its numbers; and where nothing differs, so it is."""
    variation = answer.variation
    for metric in (PRODUCT, SUCCESS, "slots"):
        sentence = variation.finding(metric)
        rows = answer.table().query("metric == @metric")
        assert sentence.count(" with ") == len(rows) == len(answer.results.policies)
        for row in rows.itertuples():
            if row.low < row.high:
                assert f"with {row.policy} " in sentence
                assert f"({format_change(row)}" in sentence
    for policy in answer.results.policies:
        share = numbers.format_percent(
            (paired.paired_differences(answer.results, policy) > 0).mean()
        )
        assert f"higher in {share} and lower in" in variation.spread_in_words()
    never = answer.table().query("low == high == 0").iloc[0]
    assert f"with {never['policy']} the same in all pairs" in variation.finding(never["metric"])


def test_costs_are_compared_where_there_are_prices(tmp_path):
    """Two more UAVs cost their price more in every mission, and the command repeats the prices."""
    prices = {"uav": 500, "charge": 40, "missions": 1}
    sides, scenario = ({"uavs": 3}, {"uavs": 1}), write_scenario(tmp_path)
    answer = what_if(*sides, scenario, ["greedy"], 6, 3, tmp_path, prices=prices)
    row = answer.table().set_index("metric").loc["cost"]
    assert row["difference"] == pytest.approx(row["after"] - row["before"]) and row["low"] >= 0
    costs = answer.results.missions.groupby("point")["cost"].mean()
    assert costs[BASELINE] >= 500
    assert row["difference"] == pytest.approx(costs[VARIATION] - costs[BASELINE])
    fact = found_of(answer.facts())["cost with greedy"]
    assert fact.startswith("+1,") and " EUR, " in fact
    assert "Cost [EUR]" in answer.variation.measures_table("greedy").cells["greedy"].tolist()
    assert answer.question is not None
    assert "--price uav=500.0 --price charge=40.0" in answer.question.command
    with pytest.raises(InputError, match="^prices: 'uva' is unknown"):
        what_if({"uavs": 3}, prices={"uva": 1})


def test_where_no_progress_bar_is_wanted_a_notebook_shows_none(monkeypatch):
    """Pages are made in kernels of Jupyter with this variable of the environment."""
    monkeypatch.setattr("tqdm.auto.tqdm", tqdm.notebook.tqdm)
    monkeypatch.setenv("TQDM_DISABLE", "1")
    with _progress_bar() as (advance, _):
        assert advance.__self__.disable
