"""Learning curves: averages, and transfer learning by the last difference."""

import numpy as np
import pandas as pd
import pytest

from analysis.questions.learning import curves as learning
from analysis.stats.verdict import HOLDS, INCONCLUSIVE, REFUTED

METRIC = "evaluation_reward"
STEPS = [1000, 2000, 3000, 4000]


def training(variant, seed, values, before=0):
    """A curve with a number of evaluations before the last phase."""
    phases = ["harvest"] * before + ["battery"] * (len(values) - before)
    steps = STEPS[: len(values)]
    columns = {"phase": phases, "updates": steps, METRIC: values, "final_product": values[-1]}
    same = {"variant": variant, "seed": seed}
    return pd.DataFrame(same | columns).assign(uav_slots=500 * np.array(steps))


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


def test_transfer_is_judged_in_the_last_phase_alone():
    result = compared([9.0, 9.1, 9.2], [5.0, 5.1, 5.2], level=1.0, before=2)
    assert result.throughout and result.since == STEPS[2]


def test_a_curve_has_settled_where_it_stays_near_its_end():
    averages = pd.Series([0.2, 0.55, 0.725])
    assert [learning.settled(averages, margin) for margin in (1.0, 0.2, 0.0)] == [0, 1, 2]


def test_pairs_need_trainings_of_both_variants():
    curves = pd.concat(
        [several("quick", [1.0]), several("no transfer", [1.0]), several("no guard", [1.0])]
    )
    assert learning.pairs_in(curves) == {"all methods of this project": ("quick", "no transfer")}
    (key,) = learning.transfers(curves, [METRIC], shortest=STEPS[-1])
    assert key == ("all methods of this project", METRIC)


@pytest.mark.parametrize(
    ("using", "without", "level", "verdict", "since"),
    [
        ([9.0, 9.01, 9.02], [5.0, 5.01, 5.02], -1.0, HOLDS, STEPS[2]),  # behind at first
        ([4.0, 9.0], [3.0, 8.0], 1.0, INCONCLUSIVE, STEPS[0]),  # the interval contains 0
        ([3.0, 8.0], [4.0, 9.0], 0.0, INCONCLUSIVE, None),  # ends below
        ([9.0], [5.0], 0.0, INCONCLUSIVE, STEPS[1]),  # two single trainings, equal at first
        ([2.0, 2.1, 2.2], [9.0, 9.1, 9.2], 1.0, REFUTED, None),  # ahead at first
    ],
)
def test_transfer_is_judged_by_the_interval_of_the_end(using, without, level, verdict, since):
    result = compared(using, without, level=level)
    assert (result.verdict, result.since) == (verdict, since)
    assert result.throughout == (since == STEPS[0])
    both = pd.concat([several("with", using), several("without", without)])
    averages = learning.smoothed(both, METRIC)
    short = learning.transfer(averages, "with", "without", shortest=STEPS[-1] + 1)
    assert (short.verdict, short.length) == (INCONCLUSIVE, STEPS[-1])


def test_comparisons_are_rows_of_text():
    ends = {"all means": ([900.0, 910.0], [500.0, 510.0]), "equal": ([0.5, 0.5], [0.5, 0.5])}
    keys = [("all means", learning.REWARD), ("equal", learning.PRODUCT)]
    table = learning.transfer_table(
        {key: compared(*ends[key[0]]) for key in keys}, dict.fromkeys(keys, HOLDS)
    )
    first, second = table.to_numpy().tolist()
    # of four even steps the last average is 17 / 24 on the way: 400 x 17 / 24
    assert first.pop().startswith("+283 [")
    assert first == ["All means", "2 and 2", "Reward", HOLDS, "is above from step 2,000 on"]
    assert second[2:] == [
        "Product",
        HOLDS,
        "ends below, or level",
        "0.0, the same in all trainings",
    ]
