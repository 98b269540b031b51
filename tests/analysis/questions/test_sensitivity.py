import warnings

import numpy as np
import pandas as pd
import pytest

from analysis.figures.settings import sensitivity as figure
from analysis.names import RATIO
from analysis.numbers import why_nan
from analysis.questions.sensitivity import index_table, sensitivity
from analysis.study.design import Saltelli
from dess import InputError

FIELDS = ("edge_snr", "arrival_rate", "path_loss_exponent")  # names only: nothing is simulated
INDICES = ["first", "first_low", "first_high", "total", "total_low", "total_high"]


def noise_of(replication):
    """A number in [0, 1) of a replication, as good as random (splitmix64)."""
    z = np.asarray(replication, np.uint64) + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return ((z ^ (z >> np.uint64(31))) >> np.uint64(11)) * 2.0**-53


def unit(number, base, seed=0):
    """A design of so many fields, each on [0, 1]."""
    return Saltelli(ranges={field: [0, 1] for field in FIELDS[:number]}, base=base, seed=seed)


def evaluated(design, **functions):
    """A mission per point: its metrics are functions of the fields and of the noise."""
    replication = [point.replication for point in design.points]
    x = np.array([list(point.values.values()) for point in design.points]).T
    metrics = {name: metric(*x, noise_of(replication)) for name, metric in functions.items()}
    return pd.DataFrame({"point": range(len(replication)), "replication": replication} | metrics)


def ishigami(x, y, z, noise):
    return np.sin(x) + 7 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)


# x, y and the noise e are uniform on [0, 1]: each has variance 1/12.
KNOWN = {
    # Variances 1 : 4. Nothing interacts, so total = first.
    "additive": (lambda x, e: x + 2 * e, [1 / 5, 4 / 5], [1 / 5, 4 / 5]),
    "two fields": (
        lambda x, y, e: x + 2 * y + 3 * e,
        [1 / 14, 4 / 14, 9 / 14],
        [1 / 14, 4 / 14, 9 / 14],
    ),
    # Variance E[x^2] / 12 = 1/36. The mean does not depend on x: its first is 0.
    # E[. | e] = (e - 1/2) / 2 has variance 1/48, 3/4 of it; all of it is gone once e is known.
    "spread": (lambda x, e: x * (e - 1 / 2), [0, 3 / 4], [1 / 4, 1]),
    # A success with probability x: variance 1/4, of which E[. | x] = x explains 1/12, as does
    # E[. | e] = 1 - e.
    "success": (lambda x, e: (e < x).astype(int), [1 / 3, 1 / 3], [2 / 3, 2 / 3]),
}


@pytest.mark.parametrize("case", KNOWN)
def test_known_shares_of_parameters_and_noise(case):
    function, first, total = KNOWN[case]
    design = unit(len(first) - 1, base=2048)
    table = sensitivity(design, evaluated(design, y=function), ["y"])
    for index, truth in (("first", first), ("total", total)):
        low, high = table[f"{index}_low"], table[f"{index}_high"]
        room = (high - low) / 2  # some of so many intervals of 95 % miss
        assert ((low - room <= truth) & (truth <= high + room)).all()
        assert (high - low < 0.25).all()


@pytest.mark.slow
@pytest.mark.parametrize("case", KNOWN)
def test_intervals_cover_what_they_claim(case):
    function, *truths = KNOWN[case]
    level, runs = 0.95, 300
    hits = np.zeros((2, len(truths[0])))
    for seed in range(runs):
        design = unit(len(truths[0]) - 1, base=256, seed=seed)
        missions = evaluated(design, y=function)
        table = sensitivity(design, missions, ["y"])
        for row, (index, truth) in enumerate(zip(("first", "total"), truths, strict=True)):
            hits[row] += (table[f"{index}_low"] <= truth) & (truth <= table[f"{index}_high"])
    # Four standard errors of the binomial. Intervals of smooth parameters are wider than need be:
    # the design is more even than the resamples know. The noise has no such help.
    error = 4 * np.sqrt(level * (1 - level) / runs)
    assert (hits / runs > level - error).all()
    assert hits[0, -1] / runs < level + error


def test_a_metric_without_variance_has_no_shares():
    design = unit(2, base=16)
    missions = evaluated(
        design,
        always=lambda x, y, e: np.ones(x.size),
        tenth=lambda x, y, e: np.full(x.size, 0.1),
        # Only outside of A and B, which measure the variance.
        elsewhere=lambda x, y, e: np.arange(x.size) % 5 == 1,
        y=lambda x, y, e: x + e,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        table = sensitivity(design, missions, ["always", "tenth", "elsewhere", "y"])
    assert table.loc[table["metric"] != "y", INDICES].isna().all(axis=None)
    assert table.loc[table["metric"] == "y", INDICES].notna().all(axis=None)


WRONG = {
    "too few": lambda missions: missions.iloc[:-1],
    "two policies": lambda missions: pd.concat([missions, missions]),
    "another order": lambda missions: missions.iloc[::-1],
    "another design": lambda missions: missions.assign(replication=missions["replication"] + 1),
    "none": lambda missions: missions.iloc[:0],
}


@pytest.mark.parametrize("wrong", WRONG)
def test_missions_must_be_those_of_the_design(wrong):
    design = unit(1, base=4)
    missions = WRONG[wrong](evaluated(design, y=lambda x, e: x + e))
    with pytest.raises(InputError, match="one for each of its 16 points") as error:
        sensitivity(design, missions, ["y"])
    assert "\n" not in str(error.value)


def test_intervals_are_symmetric_and_depend_on_nothing_else():
    design = unit(1, base=64)
    missions = evaluated(design, other=lambda x, e: x * e, y=lambda x, e: x + e)
    np.random.seed(1)
    alone = sensitivity(design, missions, ["y"])
    np.random.seed(2)
    both = sensitivity(design, missions, ["other", "y"])
    pd.testing.assert_frame_equal(alone, both.iloc[2:].reset_index(drop=True))
    for index in ("first", "total"):
        half = alone[f"{index}_high"] - alone[index]
        assert (half > 0).all()
        assert half.to_numpy() == pytest.approx((alone[index] - alone[f"{index}_low"]).to_numpy())


def test_the_indices_of_a_constant_metric_are_nan_in_its_table_and_its_figure():
    design = unit(1, 4)
    missions = evaluated(design, **{RATIO: lambda x, noise: np.full_like(x, 0.5)})
    table = sensitivity(design, missions, [RATIO]).assign(policy="tour")
    shown = index_table(table)
    assert len(shown) == 2
    assert {*shown["Alone"]} == {"nan % [nan, nan]"}
    assert why_nan(shown.to_numpy().flat).startswith("nan: ")
    assert figure(table, "tour").axes
