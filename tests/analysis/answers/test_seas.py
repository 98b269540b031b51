"""What policies reach on many seas, where a sea counts once."""

from dataclasses import replace

import numpy as np
import pytest

from dess import InputError
from dess.analysis import numbers
from dess.analysis.answers import seas
from dess.analysis.answers.policies.decision_times import Cost, Times
from dess.analysis.metrics import BOUND, PRODUCT, SUCCESS
from dess.analysis.results.tables import Results
from dess.analysis.stats.intervals import share_interval
from tests.analysis.small import grid

SEAS = ("scattered:2", "scattered:5", "coast:2", "dense:2")


@pytest.fixture(scope="module")
def results(studied):
    return studied(design=grid(scenario=[*SEAS]), policies=["greedy", "nearest"], missions=4)


def of_sea(results: Results, policy: str, metric: str = PRODUCT) -> np.ndarray:
    rows = results.missions[results.missions["policy"] == policy]
    return np.array([rows.loc[rows["point"] == point, metric].mean() for point in range(len(SEAS))])


def test_a_sea_counts_once(results):
    means = of_sea(results, "greedy")
    table = seas.means_over_seas(results).set_index("policy")
    assert table.loc["greedy", ["mean", "n"]].tolist() == pytest.approx([means.mean(), 4])
    families = seas.means_over_seas(results, "family", SUCCESS).set_index(["family", "policy"])
    assert families.loc[("scattered", "nearest"), "n"] == 2
    known = of_sea(results, "nearest", SUCCESS)[:2].mean()
    assert families.loc[("scattered", "nearest"), "mean"] == pytest.approx(known)
    assert {*seas.means_over_seas(results, "nodes")["nodes"]} >= {"61 and more"}
    # Seed 2 has five or six.
    assert {*seas.means_over_seas(results, "uavs")["uavs"]} <= {5, 6}


def test_a_share_of_seas_that_all_succeed_has_an_interval(results):
    certain = replace(results, missions=results.missions.assign(success=1))
    table = seas.means_over_seas(certain, metric=SUCCESS)
    assert (table["mean"] == 1).all() and (table["high"] == 1).all()
    assert table["low"].tolist() == [share_interval(4, 4).low] * 2


def test_gains_and_shares_are_paired_by_sea(results):
    greedy, nearest = of_sea(results, "greedy"), of_sea(results, "nearest")
    (gain,) = seas.differences_from_baseline(results, "greedy").to_dict("records")
    assert gain["policy"] == "nearest"
    assert gain["difference"] == pytest.approx((nearest - greedy).mean())
    share = seas.shares_of_reference(results, "greedy").set_index("policy")
    assert share.loc["greedy", ["mean", "low", "high"]].tolist() == pytest.approx([1, 1, 1])
    assert share.loc["nearest", "mean"] == pytest.approx(nearest.mean() / greedy.mean())
    assert share.loc["nearest", "low"] < share.loc["nearest", "high"]
    # A share of itself is no estimate, so no figure shows it as one.
    assert all(
        {*drawing.data["policy"]} == {"nearest"} for drawing in seas.by_group(results, "greedy")
    )


def test_the_worst_seas_come_first(results):
    behind = of_sea(results, "nearest") - of_sea(results, "greedy")
    table = seas.worst_seas_table(results, "nearest", "greedy", count=2)
    assert [*table["Sea"]] == [SEAS[place] for place in np.argsort(behind)[:2] if behind[place] < 0]
    assert seas.worst_seas_table(results, "greedy", "greedy").empty  # behind on no sea


def test_the_summary_has_shares_of_references_and_of_bounds_below_one(results, monkeypatch):
    """In a mission whose bound is 100 %, a share of it would say nothing."""
    monkeypatch.setattr(seas, "REFERENCES", ("nearest", "planner"))
    costs = [Cost(policy="greedy", calls=1, median=1, slow=1, batch=2.0)]
    bounded = np.where(results.missions["point"] == 1, 0.9, 1.0)
    with_bounds = replace(results, missions=results.missions.assign(**{BOUND: bounded}))
    table = seas.policies_table(with_bounds, Times(processor="x", costs=costs)).set_index("Policy")
    known = of_sea(results, "greedy")[1] / 0.9
    assert table.loc["greedy", "Of the bound"] == numbers.format_percent(known)
    assert table.loc["nearest", "Of nearest"] == numbers.format_percent(1.0)
    assert table["Decision"].tolist() == [numbers.format_seconds(2.0), ""]
    assert "Of planner" not in table


def test_a_study_of_one_sea_is_refused(studied):
    study = studied(missions=2)
    with pytest.raises(InputError, match="no study of seas"):
        seas.means_over_seas(study)
