"""Every number of UAVs has the same weight, in means, differences and evaluations."""

import numpy as np
import pandas as pd
import pytest

from dess.analysis.execution.evaluation import Asked, estimate_means, evaluate
from dess.analysis.metrics import PRODUCT, RATIO, REWARD, SUCCESS
from dess.analysis.stats.differences import compare
from dess.analysis.stats.groups import summary
from dess.analysis.stats.intervals import (
    interval_of,
)
from dess.analysis.stats.weights import by_replication, post_stratified
from dess.scenario.scenario import ScenarioSpace

LEVELS = np.array([0.5, 0.8, 0.9])  # the product of one, two and three UAVs


def missions_of(fleets, lead=0.0, seed=3):
    """Missions of a policy: its product is that of the fleet, with a little noise."""
    generator = np.random.default_rng((seed, len(fleets)))
    product = LEVELS[fleets - 1] + generator.normal(0, 0.02, len(fleets)) + lead * (fleets == 1)
    rows = {"point": 0, "seed": 7, "replication": range(len(fleets)), "uavs": fleets, SUCCESS: 1}
    return pd.DataFrame(rows | {RATIO: product, PRODUCT: product, REWARD: 300 * product})


FLEETS = np.repeat([1, 2, 3], [10, 30, 20])  # two UAVs are drawn too often


def test_every_number_of_uavs_has_the_same_weight_by_hand():
    # Means 1 and 3, of 5 and 10 missions.
    values = np.array([1.0] * 5 + [2.0, 4.0] * 5)
    linear = post_stratified(values, np.repeat([1, 2], [5, 10]))
    assert linear.mean() == pytest.approx(2.0)
    # the variance of the mean is (1 / 4) (0 / 5 + s^2 / 10), with s^2 = 10 / 9
    assert linear.var(ddof=1) / 15 == pytest.approx(10 / 9 / 10 / 4)


def test_means_differences_and_ranks_have_the_same_weights():
    tour, greedy = missions_of(FLEETS), missions_of(FLEETS, lead=0.3, seed=4)
    table = pd.concat([tour.assign(policy="tour"), greedy.assign(policy="greedy")])
    of_fleets = table.groupby(["policy", "uavs"])[PRODUCT].mean().groupby("policy").mean()
    found = summary(table).set_index(["metric", "policy"])["mean"][PRODUCT]
    assert found.to_dict() == pytest.approx(of_fleets.to_dict())
    assert by_replication(table, PRODUCT, "policy").mean().to_dict() == pytest.approx(
        of_fleets.to_dict()
    )
    row = compare(table, "tour", [PRODUCT]).iloc[0]
    assert row["difference"] == pytest.approx(of_fleets["greedy"] - of_fleets["tour"])


@pytest.mark.parametrize("fleets", [[1, 1, 3, 3, 3], [1] * 9 + [3] * 9, [1] * 9 + [2] * 4, [2] * 9])
def test_a_number_of_uavs_that_is_seldom_or_never_drawn_leaves_a_plain_mean(fleets):
    table = missions_of(np.array(fleets))
    row = summary(table, by=[]).set_index("metric").loc[PRODUCT]
    assert tuple(row[["mean", "low", "high"]]) == interval_of(PRODUCT, table[PRODUCT].to_numpy())


def test_what_some_missions_have_not_measured_has_a_plain_mean():
    values = np.where(np.arange(60) % 4, np.arange(60.0), np.nan)
    assert np.array_equal(post_stratified(values, FLEETS), values, equal_nan=True)


@pytest.mark.parametrize(("missions", "uavs"), [(80, (1, 3)), (80, (1, 16)), (6, (1, 3))])
def test_an_evaluation_has_the_means_of_the_table_and_knows_which_sizes_may_be_drawn(
    missions, uavs
):
    space = ScenarioSpace.of(uavs=uavs, quota=20)
    records = evaluate(space, "random", missions, seed=3).records.missions
    table = pd.DataFrame(records).assign(policy="random")
    found = estimate_means(Asked(space, "random", missions, seed=3)).moments
    rows = summary(table).set_index("metric")
    for metric in (SUCCESS, RATIO, PRODUCT, REWARD):
        of_table = rows.loc[metric, ["mean", "low", "high"]].tolist()
        assert found[metric].interval(metric) == pytest.approx(of_table, nan_ok=True)
