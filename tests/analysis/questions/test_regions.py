"""Regions in which a policy is ahead are judged by missions that had no part in choosing them."""

import numpy as np
import pandas as pd
import pytest

from analysis.names import METRICS, PARAMETERS
from analysis.questions import regions
from analysis.questions.regions import AHEAD, BEHIND
from analysis.stats.correction import adjust
from analysis.stats.intervals import mean_interval, wilson
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
    codes, names = regions.bins(pd.Series([3, 1, 2, 3]))
    assert (codes.tolist(), names) == ([2, 0, 1, 2], ["1", "2", "3"])
    codes, names = regions.bins(pd.Series(range(100)), 4)
    assert np.bincount(codes).tolist() == [25, 25, 25, 25]
    assert names == ["0–24", "25–49", "50–74", "75–99"]
    values = np.random.default_rng(1).uniform(5, 20, 1000)
    codes, names = regions.bins(pd.Series(values), 5)
    assert set(np.bincount(codes)) == {200}
    assert all(values[codes == a].max() < values[codes == a + 1].min() for a in range(4))
    codes, names = regions.bins(pd.Series([0] * 90 + [*range(1, 11)]), 5)  # quantiles coincide
    assert len(names) == codes.max() + 1 < 5 and names[0] == "0"


def test_along_a_parameter_the_difference_is_that_of_its_missions():
    missions = missions_of(lambda t: 0.05 * (t["uavs"] - 2))
    table = regions.along(missions, candidates=2)
    assert table["field"].unique().tolist() == [*PARAMETERS]
    assert (table.groupby("field")["n"].sum() == len(missions)).all()
    by_uavs = table.query("field == 'uavs'").set_index("value")
    assert by_uavs["verdict"].to_dict() == {"1": BEHIND, "2": INCONCLUSIVE, "3": AHEAD}
    part = missions.query("uavs == 3")
    ends = mean_interval(part["difference"])
    assert by_uavs.loc["3", ["mean", "low", "high"]].tolist() == pytest.approx(list(ends))
    lost = wilson(int((part["difference"] < 0).sum()), len(part))
    assert tuple(by_uavs.loc["3", ["behind", "behind_low", "behind_high"]]) == lost
    expected = np.minimum(1, 2 * adjust(table["p"].to_numpy(), "holm"))
    assert table["p_adjusted"].tolist() == expected.tolist()


def test_what_all_missions_share_is_no_parameter():
    missions = missions_of(lambda t: 0.1, uavs=2, flying_time=80)
    assert regions.varied(missions) == ["charge_start", "charge_complete", "initial_data"]
    assert set(regions.along(missions)["field"]) == {*regions.varied(missions)}
    fixed = {field: 50 for field in PARAMETERS}
    alike = missions_of(lambda t: 0.1, **fixed)
    assert regions.along(alike).empty and regions.dependence(alike).empty
    (region,) = regions.rules(alike).itertuples()
    assert (region.rule, region.verdict, region.n) == ("all missions", AHEAD, 200)


def test_across_two_parameters_every_mission_is_in_one_cell():
    missions = missions_of(lambda t: 0.1 * ((t["uavs"] == 3) & (t["flying_time"] > 75)))
    table = regions.across(missions, "uavs", "flying_time")
    assert table["n"].sum() == len(missions)
    sure = table[table["verdict"] == AHEAD]
    assert set(sure["value"]) == {"3"}
    row = table.query("value == '1' and position_2 == 0").iloc[0]
    low, high = map(int, row["value_2"].split("–"))
    part = missions.query("uavs == 1 and @low <= flying_time <= @high")
    assert (row["n"], row["mean"]) == (len(part), pytest.approx(part["difference"].mean()))


def test_dependence_finds_what_the_difference_depends_on():
    table = regions.dependence(missions_of(lambda t: 0.02 * t["uavs"])).set_index("field")
    assert table.index[0] == "uavs"
    assert table["explained"].is_monotonic_decreasing and 0.5 < table["explained"].iloc[0] < 1
    assert table.loc["uavs", "p_adjusted"] < 1e-6
    assert (table.drop("uavs")["p_adjusted"] > 0.05).all()
    none = regions.dependence(missions_of(lambda t: 0).assign(difference=0.1))
    assert (none["p"] == 1).all() and (none["explained"] == 0).all()


def test_rules_find_the_region_of_the_loss():
    def gap(t):
        return 0.1 - 0.3 * ((t["uavs"] == 3) & (t["flying_time"] <= 72))

    missions = missions_of(gap, n=2000)
    table = regions.rules(missions)
    assert table["rule"].iloc[0] == "UAVs 3, Flying time 70–72"
    assert table["verdict"].tolist() == [BEHIND] + [AHEAD] * (len(table) - 1)
    assert table["mean"].is_monotonic_increasing
    assert len(table) <= 2**regions.DEPTH
    odd = missions.query("replication % 2 == 1 and uavs == 3 and flying_time <= 72")
    ends = mean_interval(odd["difference"])
    assert table.loc[0, ["mean", "low", "high"]].tolist() == pytest.approx(list(ends))
    assert table["n"].sum() == len(missions) / 2


def test_regions_that_chance_finds_are_inconclusive():
    """On the missions that a tree was grown on, noise looks like regions; not on the others."""
    seeds = range(20)
    tables = [regions.rules(missions_of(lambda t: 0, n=400, seed=seed)) for seed in seeds]
    assert all(len(table) > 2 for table in tables)
    false = sum((table["verdict"] != INCONCLUSIVE).any() for table in tables)
    assert false <= 3  # of 20, each with a chance of at most 1 in 20


def test_the_strongest_two_are_chosen_on_the_half_that_is_not_shown():
    missions = missions_of(lambda t: 0.05 * t["uavs"] + 0.01 * (t["flying_time"] > 75))
    odd = missions["replication"] % 2 == 1
    chosen, cells = regions.strongest(missions)
    assert chosen["field"].tolist() == ["uavs", "flying_time"]
    pd.testing.assert_frame_equal(cells, regions.across(missions[odd], "uavs", "flying_time"))
    other = missions.assign(difference=missions["difference"].where(~odd, 0.0))
    pd.testing.assert_frame_equal(regions.strongest(other)[0], chosen)
    assert all(part.empty for part in regions.strongest(missions.head(1)))


def test_tables_of_text_name_the_bins_and_count_the_verdicts():
    columns = ["field", "value", "value_2", "mean", "low", "high", "n", "verdict"]
    rows = [
        ("uavs", "1", "70–72", 0.02, 0.01, 0.03, 90, AHEAD),
        ("uavs", "2", "70–72", -0.01, -0.02, 0.0, 1155, INCONCLUSIVE),
        ("uavs", "3", "70–72", 0.0, 0.0, 0.0, 8, AHEAD),
    ]
    lead = pd.DataFrame(rows, columns=columns)
    dependences = pd.DataFrame({"field": ["uavs"], "explained": [0.25], "p_adjusted": [0.0312]})
    ends = ["−1.0 [−2.0, 0.0] at 2", "+2.0 [+1.0, +3.0] at 1"]
    shown = regions.spread(lead, dependences).iloc[0].tolist()
    assert shown == ["Number of UAVs", *ends, "25.0 %", "0.031"]
    assert regions.lowest(lead) == "−1.0 [−2.0, 0.0] at 2 and 70–72 (n = 1,155)"
    assert regions.tally(lead) == "ahead in 2, behind in 0 and inconclusive in 1 of 3"


def test_few_missions_make_few_rules():
    assert regions.rules(missions_of(lambda t: 0.1, n=1)).empty
    (row,) = regions.rules(missions_of(lambda t: 0.1, n=8)).itertuples()
    assert (row.rule, row.n) == ("all missions", 4)
