"""Regions in which a policy is ahead are judged by missions that had no part in choosing them."""

import numpy as np
import pandas as pd
import pytest

from analysis.answers import comparison
from analysis.answers.comparison import AHEAD, BEHIND, OF_BASELINE
from analysis.names import METRICS, PARAMETERS, PRODUCT
from analysis.stats.differences import adjust, paired
from analysis.stats.intervals import wilson
from analysis.stats.verdict import INCONCLUSIVE


def missions_of(gap, n=400, seed=1, **fixed):
    """Missions with a difference that is a function of their parameters, and some noise."""
    generator = np.random.default_rng(seed)
    table = pd.DataFrame(
        {
            "replication": range(n),
            "uavs": generator.integers(1, 4, n),
            "flying_time": generator.integers(70, 81, n),
            "charge_start": generator.integers(10, 51, n),
            "charge_complete": generator.integers(60, 101, n),
            "initial_data": generator.uniform(10, 15, n),
        }
    ).assign(**fixed)
    theirs = generator.uniform(0.4, 0.5, n)
    ours = theirs + gap(table) + generator.normal(0, 0.01, n)
    for metric in METRICS:
        ones = np.ones(n, int)
        table[metric] = ones if metric == "success" else ours
        table[f"{metric}_baseline"] = ones if metric == "success" else theirs
    return table.assign(difference=ours - theirs)


def test_bins_are_the_values_or_hold_about_as_many():
    codes, names = comparison.bins(pd.Series([3, 1, 2, 3]))
    assert (codes.tolist(), names) == ([2, 0, 1, 2], ["1", "2", "3"])
    codes, names = comparison.bins(pd.Series(range(100)), 4)
    assert np.bincount(codes).tolist() == [25, 25, 25, 25]
    assert names == ["0–24", "25–49", "50–74", "75–99"]
    values = np.random.default_rng(1).uniform(5, 20, 1000)
    codes, names = comparison.bins(pd.Series(values), 5)
    assert set(np.bincount(codes)) == {200}
    assert all(values[codes == a].max() < values[codes == a + 1].min() for a in range(4))
    codes, names = comparison.bins(pd.Series([0] * 90 + [*range(1, 11)]), 5)  # quantiles coincide
    assert len(names) == codes.max() + 1 < 5 and names[0] == "0"


def test_along_a_parameter_the_difference_is_that_of_its_missions():
    missions = missions_of(lambda t: 0.05 * (t["uavs"] - 2))
    table = comparison.along(missions, candidates=2)
    assert table["field"].unique().tolist() == [*PARAMETERS]
    assert (table.groupby("field")["n"].sum() == len(missions)).all()
    by_uavs = table.query("field == 'uavs'").set_index("value")
    assert by_uavs["verdict"].to_dict() == {"1": BEHIND, "2": INCONCLUSIVE, "3": AHEAD}
    part = missions.query("uavs == 3")
    sides = (part[PRODUCT + end].to_numpy() for end in ("", OF_BASELINE))
    ends = paired(*sides, metric=PRODUCT)[:3]
    assert by_uavs.loc["3", ["mean", "low", "high"]].tolist() == pytest.approx([*ends])
    lost = wilson(int((part["difference"] < 0).sum()), len(part))
    assert tuple(by_uavs.loc["3", ["behind", "behind_low", "behind_high"]]) == lost
    expected = np.minimum(1, 2 * adjust(table["p"].to_numpy(), "holm"))
    assert table["p_adjusted"].tolist() == expected.tolist()


def test_what_all_missions_share_is_no_parameter():
    missions = missions_of(lambda t: 0.1, uavs=2, flying_time=80)
    assert comparison.varied(missions) == ["charge_start", "charge_complete", "initial_data"]
    assert set(comparison.along(missions)["field"]) == {*comparison.varied(missions)}
    fixed = {field: 50 for field in PARAMETERS}
    alike = missions_of(lambda t: 0.1, **fixed)
    assert comparison.along(alike).empty and comparison.dependence(alike).empty


def test_dependence_finds_what_the_difference_depends_on():
    table = comparison.dependence(missions_of(lambda t: 0.02 * t["uavs"])).set_index("field")
    assert table.index[0] == "uavs"
    assert table["explained"].is_monotonic_decreasing and 0.5 < table["explained"].iloc[0] < 1
    assert table.loc["uavs", "p_adjusted"] < 1e-6
    assert (table.drop("uavs")["p_adjusted"] > 0.05).all()
    none = comparison.dependence(missions_of(lambda t: 0).assign(difference=0.1))
    assert (none["p"] == 1).all() and (none["explained"] == 0).all()


def test_a_table_of_text_names_the_bins():
    columns = ["field", "value", "value_2", "mean", "low", "high", "n", "verdict"]
    rows = [
        ("uavs", "1", "70–72", 0.02, 0.01, 0.03, 90, AHEAD),
        ("uavs", "2", "70–72", -0.01, -0.02, 0.0, 1155, INCONCLUSIVE),
        ("uavs", "3", "70–72", 0.0, 0.0, 0.0, 8, AHEAD),
    ]
    lead = pd.DataFrame(rows, columns=columns)
    dependences = pd.DataFrame({"field": ["uavs"], "explained": [0.25], "p_adjusted": [0.0312]})
    ends = ["−1.0 [−2.0, 0.0] at 2", "+2.0 [+1.0, +3.0] at 1"]
    shown = comparison.spread(lead, dependences).iloc[0].tolist()
    assert shown == ["Number of UAVs", *ends, "25.0 %", "0.031"]
