"""Trainings are the unit: what their curves say, and how sure."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from analysis.questions import learning
from analysis.replication import paper
from analysis.stats.verdict import HOLDS, INCONCLUSIVE, REFUTED

METRIC = "evaluation_reward"
STEPS = [1000, 2000, 3000, 4000]


def training(variant, seed, values, before=0):
    """A curve with so many evaluations before the last phase."""
    phases = ["harvest"] * before + ["battery"] * (len(values) - before)
    steps = STEPS[: len(values)]
    columns = {"phase": phases, "updates": steps, METRIC: values, "final_product": values[-1]}
    return pd.DataFrame({"variant": variant, "seed": seed} | columns)


def several(variant, ends, level=0.0, before=0):
    """Trainings that rise from a level to their ends."""
    return pd.concat(
        training(variant, seed, np.linspace(level, end, len(STEPS)), before)
        for seed, end in enumerate(ends)
    )


def compared(using, without, **options):
    both = pd.concat([several("with", using, **options), several("without", without)])
    return learning.transfer(learning.smoothed(both, METRIC), "with", "without", shortest=STEPS[-1])


def test_an_average_weighs_the_newest_and_begins_anew_with_every_phase():
    table = learning.smoothed(training("one", 1, [4.0, 0.0, 8.0, 16.0], before=2), METRIC)
    a = learning.ALPHA
    assert table["value"].tolist() == [4.0, 4.0 * (1 - a), 8.0, 8.0 * (1 - a) + 16.0 * a]
    assert table["updates"].tolist() == STEPS


def test_averages_of_trainings_do_not_mix():
    one, two = training("one", 1, [1.0, 2.0]), training("one", 2, [30.0, 40.0])
    alone = [learning.smoothed(table, METRIC)["value"].tolist() for table in (one, two)]
    mixed = pd.concat([one, two]).sort_values("updates", ignore_index=True)
    table = learning.smoothed(mixed, METRIC)
    assert [own["value"].tolist() for _, own in table.groupby("seed")] == alone


@pytest.mark.parametrize("n", [2, 3, 5])
def test_a_band_is_students_over_the_trainings_and_none_for_too_few(n):
    ends = np.linspace(1.0, 2.0, n)
    rows = learning.bands(learning.smoothed(several("one", ends), METRIC), 0.99)
    values = learning.smoothed(several("one", ends), METRIC).query("updates == 4000")["value"]
    last = rows.iloc[-1]
    assert (last["n"], last["mean"]) == (n, pytest.approx(values.mean()))
    half = stats.t.ppf(0.995, n - 1) * values.std(ddof=1) / np.sqrt(n)
    expected = (
        [values.mean() - half, values.mean() + half] if n >= learning.FEWEST else [np.nan] * 2
    )
    assert [last["low"], last["high"]] == pytest.approx(expected, nan_ok=True)


def test_transfer_holds_where_the_curve_passes_and_ends_surely_higher():
    found = compared([9.0, 9.01, 9.02], [5.0, 5.01, 5.02], level=-1.0)
    assert (found.verdict, found.trainings) == (HOLDS, (3, 3))
    assert found.since in STEPS[1:] and not found.throughout
    assert 0 < found.last.low < found.last.mean < found.last.high


def test_transfer_cannot_be_told_where_the_end_is_not_sure():
    found = compared([4.0, 9.0], [3.0, 8.0], level=1.0)
    assert (found.verdict, found.since, found.throughout) == (INCONCLUSIVE, STEPS[0], True)
    assert found.last.low < 0 < found.last.mean
    found = compared([3.0, 8.0], [4.0, 9.0])  # nor where it ends below
    assert (found.verdict, found.since) == (INCONCLUSIVE, None)
    assert compared([9.0], [5.0]).verdict == INCONCLUSIVE  # two single trainings


def test_transfer_does_not_hold_where_the_curve_ends_surely_below():
    found = compared([2.0, 2.1, 2.2], [9.0, 9.1, 9.2], level=1.0)  # ahead at first
    assert (found.verdict, found.since) == (REFUTED, None)


@pytest.mark.parametrize("ends", [([9.0, 9.1, 9.2], [5.0, 5.1, 5.2]), ([2.0, 2.1], [9.0, 9.1])])
def test_trainings_shorter_than_the_paper_s_crossing_cannot_tell(ends):
    both = pd.concat([several("with", ends[0]), several("without", ends[1])])
    averages = learning.smoothed(both, METRIC)
    found = learning.transfer(averages, "with", "without")
    assert (found.verdict, found.length) == (INCONCLUSIVE, STEPS[-1])
    assert STEPS[-1] < paper.CROSSING
    assert (
        learning.transfer(averages, "with", "without", shortest=found.length).verdict
        != INCONCLUSIVE
    )


def test_transfer_is_judged_in_the_last_phase_alone():
    found = compared([9.0, 9.1, 9.2], [5.0, 5.1, 5.2], level=1.0, before=2)
    assert found.throughout and found.since == STEPS[2]


def test_the_difference_of_means_is_welchs():
    a, b = [1.0, 2.0, 4.0], [3.0, 3.5]
    ends, p = learning.difference(a, b)
    test = stats.ttest_ind(a, b, equal_var=False)
    assert ends.mean == pytest.approx(np.mean(a) - np.mean(b))
    assert (ends.low, ends.high) == pytest.approx(tuple(test.confidence_interval(0.95)))
    assert p == pytest.approx(test.pvalue)


def test_a_single_training_is_held_against_the_spread_of_the_others():
    """By hand: the prediction interval of one more, mean +- t s sqrt(1 + 1/n)."""
    others = np.array([1.0, 2.0, 3.0])
    ends, p = learning.difference([5.0], others)
    half = stats.t.ppf(0.975, 2) * 1.0 * np.sqrt(1 + 1 / 3)
    assert (ends.low, ends.high) == pytest.approx((3.0 - half, 3.0 + half))
    assert p == pytest.approx(2 * stats.t.sf(3.0 / np.sqrt(4 / 3), 2))


def test_two_single_trainings_tell_nothing_of_the_spread():
    ends, p = learning.difference([5.0], [3.0])
    assert ends.mean == 2.0 and np.isnan([ends.low, ends.high]).all() and p == 1.0


def test_the_ablation_compares_what_trainings_end_with():
    ends = {"base": [1.0, 2.0, 3.0], "much": [9.0, 9.5, 9.7], "once": [2.5]}
    last = learning.finals(pd.concat(several(name, values) for name, values in ends.items()))
    table = learning.ablation(last, "final_product", "base").set_index("variant")
    assert table["n"].to_dict() == {"base": 3, "much": 3, "once": 1}
    assert table["mean"].to_dict() == pytest.approx({n: np.mean(v) for n, v in ends.items()})
    assert table.loc["base", ["difference", "p", "p_adjusted"]].isna().all()
    assert table.loc["once", ["low", "high"]].isna().all()
    assert table.loc["once", "difference_low"] < 0 < table.loc["once", "difference_high"]
    p = table.loc["much", "p"]
    assert table.loc["much", "p_adjusted"] == pytest.approx(2 * p)  # Holm, of two
    assert p == learning.difference(ends["much"], ends["base"])[1]


def test_a_curve_has_settled_where_it_stays_near_its_end():
    curve = training("one", 1, [0.5, 0.2, 0.9, 0.9], before=1)
    assert learning.settled(curve, METRIC, 1.0)["updates"] == STEPS[1]
    assert learning.settled(curve, METRIC, 0.2)["updates"] == STEPS[2]
    assert learning.settled(curve, METRIC, 0.0)["updates"] == STEPS[3]
