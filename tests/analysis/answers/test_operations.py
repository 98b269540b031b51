"""Changes from a reference value, and the answers that are made of them, on planted values."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from dess import InputError
from dess.analysis.answers import operations
from dess.analysis.metrics import AGE, MOST_SLOTS, PRODUCT, RATIO, SUCCESS
from dess.analysis.stats.differences import relative_change
from tests.analysis.small import grid


def planted(results, metric, value):
    """The results with the values that a function gives to every row of missions."""
    values = results.missions.apply(value, axis="columns")
    return replace(results, missions=results.missions.assign(**{metric: values}))


@pytest.fixture(scope="module")
def pads(studied):
    return studied(
        policies=["greedy"],
        missions=40,
        logged=2,
        set={"charging.measured": True},
        design=grid(uavs=[2, 4], pads=[1, 2, 3, 4]),
    )


def test_a_change_is_the_paired_difference_from_the_same_setting(pads):
    shifted = planted(pads, PRODUCT, lambda row: 0.5 + 0.001 * row["replication"]
                      - 0.1 * (row["pads"] == 1) - 0.2 * (row["uavs"] == 4))  # fmt: skip
    table = operations.changes_from_reference(shifted, "pads", 4, PRODUCT).set_index(
        ["uavs", "pads"]
    )
    assert len(table) == 6  # the reference has no row
    for uavs in (2, 4):
        assert table.loc[(uavs, 1), "mean"] == pytest.approx(-0.1)
        assert table.loc[(uavs, 3), "mean"] == 0
        assert table.loc[(uavs, 1), "n"] == 40
    with pytest.raises(InputError, match="pads: is never 9"):
        operations.changes_from_reference(pads, "pads", 9, PRODUCT)


def test_the_fewest_pads_with_which_and_above_which_little_is_lost(pads):
    def value(row):
        # Two UAVs need two pads. Four need four: three are worse, although two seem to be enough.
        short = row["pads"] < 2 if row["uavs"] == 2 else row["pads"] in (1, 3)
        return 0.9 - 0.3 * short

    found = operations.enough_pads(planted(pads, PRODUCT, value), 0.1)
    assert found[["uavs", "pads"]].to_numpy().tolist() == [[2, 2], [4, 4]]
    assert found["too_few"].tolist() == [1, 3]
    assert operations.short_of_pads(planted(pads, PRODUCT, value), 0.1) == [0, 4, 6]
    text = operations.enough_pads_sentence(planted(pads, PRODUCT, value), 0.1)
    assert text.startswith(
        "Of charging pads, 2 are enough for 2 UAVs, 1 is too few; 4 are enough for 4 UAVs, 3 are"
    )


def test_the_lower_end_decides_and_one_pad_may_be_enough(pads):
    def value(row):  # one pad costs 0.07 on average, and at least 0.05 or so
        return 0.8 - (row["pads"] == 1) * (0.14 * (row["replication"] % 2))

    unsure = operations.enough_pads(planted(pads, PRODUCT, value), 0.08)
    assert unsure["pads"].tolist() == [2, 2]
    assert unsure["open"].tolist() == [[1], [1]]
    # Lack of proof is not need: a loss that may not matter leaves the number of pads open.
    noisy = planted(
        pads, PRODUCT, lambda row: 0.5 + (row["pads"] < 3) * (row["replication"] % 2 - 0.55) / 2
    )
    assert "3 are enough for 2 UAVs, 1 and 2 open" in operations.enough_pads_sentence(noisy, 0.1)
    found = operations.enough_pads(planted(pads, PRODUCT, lambda row: 0.9), 0.1)
    assert found["pads"].tolist() == [1, 1]
    assert found["too_few"].tolist() == [0, 0]


def test_what_the_fewest_pads_cost_is_computed(pads):
    """One pad may cost the success of a large fleet and hardly any data."""
    failing = planted(pads, SUCCESS, lambda row: float(row["uavs"] == 2 or row["pads"] > 1))
    failing = planted(failing, RATIO, lambda row: 0.97 - 0.06 * (row["pads"] == 1))
    lines = operations.few_pads_sentence(failing).splitlines()
    assert lines[0].startswith("- The success of 2 UAVs is 100.0 % with 1 pad and 100.0 % with 4: ")
    assert lines[1].startswith("- The success of 4 UAVs is 0.0 % with 1 pad and 100.0 % with 4: ")
    assert "−100.0 [" in lines[1] and lines[1].endswith(" points, n = 40.")
    assert "2 UAVs is 91.0 % with 1 pad and 97.0 % with 4: −6.0 [" in lines[2]


def test_a_relative_change_is_that_of_the_means():
    reference = np.array([100.0, 110.0, 90.0, 100.0])
    assert relative_change(0.5 * reference, reference) == pytest.approx((-0.5, -0.5, -0.5))
    values = np.array([60.0, 50.0, 45.0, 45.0])
    change = relative_change(values, reference)
    assert change.mean == pytest.approx(-0.5)
    # By hand: residuals 10, -5, 0, -5, so their deviation is sqrt(50); t has 3 degrees of freedom.
    half = 3.182446 * np.sqrt(50) / 2 / 100
    assert (change.mean - change.low, change.high - change.mean) == pytest.approx((half, half))


def test_the_age_is_compared_with_the_published_effect(studied):
    results = studied(
        policies=["greedy"],
        missions=5,
        set={"age.measured": True},
        design=grid(uavs=[1, 2, 3], arrival_rate=[0.1, 0.5]),
    )
    # With rare failures the absolute change is open, and the relative one, of the table, is not.
    rarely = planted(results, AGE, lambda row: 130 + row["replication"] + 100 * (row["uavs"] == 1))
    assert (operations.age_changes(rarely)["high"] < 0).all()
    absolute = operations.changes_from_reference(rarely, "uavs", 1, AGE)
    assert (absolute["high"] > 0).all()
    assert "the mean age of the data falls from" in operations.age_sentence(rarely)
    # Where it is not known how long missions may last, no rare failures are allowed for.
    results = replace(results, missions=results.missions.drop(columns=MOST_SLOTS))
    halved = planted(results, AGE, lambda row: (80 + row["replication"]) / row["uavs"])
    table = operations.age_changes(halved)
    assert table["mean"].tolist() == pytest.approx([-1 / 2, -2 / 3, -1 / 2, -2 / 3])
    assert table["published"].dropna().tolist() == [-0.46, -0.46]
    text = operations.age_sentence(halved)
    # By hand: 80 to 84 in five missions, so half a width of t * sqrt(2.5 / 5) with t = 2.776.
    assert "From 1 to 3 UAVs the mean age of the data falls from 82.0 [80.0, 84.0] to" in text
    assert "to 27.3 [26.7, 28.0] slots at an arrival rate of 0.5" in text
    grown = planted(results, AGE, lambda row: (80 + row["replication"]) * row["uavs"])
    assert "From 1 to 3 UAVs the mean age of the data rises from 82.0 [" in operations.age_sentence(
        grown
    )
    level = planted(results, AGE, lambda row: 80 + row["replication"] % (2 + row["uavs"]))
    assert "the mean age of the data does not surely change, from" in operations.age_sentence(level)


def test_failures_are_compared_with_none(studied):
    fields = {"uavs": [2, 3], "failures.uav_rate": [0.0, 0.01], "failures.uav_repair": [0.0, 5.0]}
    results = studied(policies=["greedy"], missions=5, design=grid(**fields))

    def value(row):
        lost = 30 * row["failures.uav_rate"] / (1 + row["failures.uav_repair"])
        return 0.5 + 0.001 * row["replication"] - lost

    fallen = planted(results, PRODUCT, value)
    text = operations.failures_sentence(fallen)
    assert "with probability 0.01, the product of 2 UAVs changes by −30.0 [" in text
    assert "points if it is lost and by −5.0 [" in text
    assert "points if it is repaired in 5 slots" in text


def test_a_uav_waits_from_its_request_until_it_charges_gives_up_or_ends():
    events = [
        (0, "mission_start", 0),
        (1, "charge_request", 0),
        (2, "charge_request", 1),
        (3, "charge_start", 0),
        (5, "charge_withdrawal", 1),
        (6, "charge_request", 0),
        (7, "battery_empty", 0),
        (8, "mission_end", 1),
        (8, "mission_end", -1),
    ]
    log = pd.DataFrame(events, columns=["time", "event", "uav"])
    waiting = operations.count_waiting_uavs(log).tolist()
    assert waiting == [0, 1, 2, 1, 1, 0, 1, 0]


def test_the_queue_of_the_logs_is_that_of_the_records(pads):
    # Four UAVs, one pad.
    table = operations.queues_over_time(pads, "greedy", [4]).set_index("slot")
    missions = pads.missions.query("point == 4 and replication < 2")
    assert len(table) == missions["slots"].max()
    waited = (missions["queue"] * missions["slots"]).sum() / 2
    assert table["mean"].sum() == pytest.approx(waited) and waited > 0
    assert (table["low"] <= table["high"]).all()


def test_how_long_missions_last_is_counted(pads):
    longest = pads.scenario().max_slots
    lasting = planted(pads, "slots", lambda row: longest - (row["replication"] == 0))
    assert (
        operations.mission_lengths_sentence(lasting)
        == f"312 of 320 missions last to the last slot, {longest:,}."
    )
    lasting = planted(pads, "slots", lambda row: longest)
    assert (
        operations.mission_lengths_sentence(lasting)
        == f"Every mission lasts to its last slot, {longest:,}."
    )
