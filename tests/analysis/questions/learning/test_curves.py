"""Learning curves: averages, bands over trainings, and transfer learning by the last difference."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from analysis.questions.learning import curves as learning
from analysis.stats.verdict import HOLDS, INCONCLUSIVE, REFUTED

METRIC = "evaluation_reward"
STEPS = [1000, 2000, 3000, 4000]


def training(variant, seed, values, before=0):
    """A curve with a number of evaluations before the last phase."""
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
    return learning.transfer(learning.smoothed(both, METRIC), "with", "without", STEPS[-1])


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
    assert [part["value"].tolist() for _, part in table.groupby("seed")] == alone


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


def test_transfer_holds_where_the_whole_interval_of_the_end_is_above_0():
    result = compared([9.0, 9.01, 9.02], [5.0, 5.01, 5.02], level=-1.0)
    assert (result.verdict, result.trainings) == (HOLDS, (3, 3))
    assert result.since in STEPS[1:] and not result.throughout
    assert 0 < result.last.low < result.last.mean < result.last.high


def test_transfer_is_inconclusive_where_the_interval_of_the_end_holds_0():
    result = compared([4.0, 9.0], [3.0, 8.0], level=1.0)
    assert (result.verdict, result.since, result.throughout) == (INCONCLUSIVE, STEPS[0], True)
    assert result.last.low < 0 < result.last.mean
    result = compared([3.0, 8.0], [4.0, 9.0])  # nor where it ends below
    assert (result.verdict, result.since) == (INCONCLUSIVE, None)
    assert compared([9.0], [5.0]).verdict == INCONCLUSIVE  # two single trainings


def test_transfer_does_not_hold_where_the_whole_interval_of_the_end_is_below_0():
    result = compared([2.0, 2.1, 2.2], [9.0, 9.1, 9.2], level=1.0)  # ahead at first
    assert (result.verdict, result.since) == (REFUTED, None)


@pytest.mark.parametrize("ends", [([9.0, 9.1, 9.2], [5.0, 5.1, 5.2]), ([2.0, 2.1], [9.0, 9.1])])
def test_trainings_that_are_too_short_are_inconclusive(ends):
    both = pd.concat([several("with", ends[0]), several("without", ends[1])])
    averages = learning.smoothed(both, METRIC)
    short = learning.transfer(averages, "with", "without", shortest=STEPS[-1] + 1)
    assert (short.verdict, short.length) == (INCONCLUSIVE, STEPS[-1])
    long_enough = learning.transfer(averages, "with", "without", shortest=STEPS[-1])
    assert long_enough.verdict != INCONCLUSIVE


def test_transfer_is_judged_in_the_last_phase_alone():
    result = compared([9.0, 9.1, 9.2], [5.0, 5.1, 5.2], level=1.0, before=2)
    assert result.throughout and result.since == STEPS[2]


def test_a_curve_has_settled_where_it_stays_near_its_end():
    averages = pd.Series([0.2, 0.55, 0.725])
    assert [learning.settled(averages, margin) for margin in (1.0, 0.2, 0.0)] == [0, 1, 2]


def described(using, without, metric=learning.REWARD):
    compared_by_name = {("all means", metric): compared(using, without)}
    table = learning.transfer_table(compared_by_name, {("all means", metric): HOLDS})
    return table.iloc[0].to_dict()


def test_a_comparison_is_a_row_of_text():
    row = described([900.0, 910.0, 920.0], [500.0, 510.0, 520.0])
    assert row["Trainings with"] == "All means"
    assert (row["n"], row["Metric"], row["Verdict"]) == ("3 and 3", "Reward", HOLDS)
    assert row["With transfer, the mean curve"] == "is above from step 2,000 on"
    # of four even steps the last average is 17 / 24 on the way: 400 x 17 / 24
    assert row["Difference at the end"].startswith("+283 [")
    assert described([0.1] * 3, [0.5] * 3)["With transfer, the mean curve"].startswith("ends below")


def test_the_product_is_in_points_and_equal_ends_are_named():
    row = described([0.5, 0.5], [0.5, 0.5], learning.PRODUCT)
    assert row["Difference at the end"] == "0.0, the same in all trainings"
    assert row["With transfer, the mean curve"] == "ends below, or level"


def test_pairs_need_trainings_of_both_variants():
    curves = pd.concat(
        [several("quick", [1.0]), several("no transfer", [1.0]), several("no guard", [1.0])]
    )
    assert learning.pairs_in(curves) == {"all methods of this project": ("quick", "no transfer")}
    (key,) = learning.transfers(curves, [METRIC], shortest=STEPS[-1])
    assert key == ("all methods of this project", METRIC)
