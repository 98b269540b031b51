"""Questions on costs: hand-worked tables and sentences, and a study of a small sea."""

import pytest

from dess import InputError, ScenarioSpace
from dess.analysis.answers.fleet import verdicts
from dess.analysis.answers.fleet.costs import (
    cost_front,
    mean_cost_parts,
    price_facts,
    priced_settings,
)
from dess.analysis.metric_ranges import metric_in_missions
from dess.analysis.stats.front import on_front
from dess.analysis.stats.intervals import interval_of
from dess.analysis.study.prices import Costs, most_battery_per_slot
from tests.analysis.small import SCENARIO, SHEET

PRICES = {"uav": 1000, "pad": 100, "charge": 2, "hour": 6, "lost_uav": 1000}
PRICES |= {"missions": 5, "slot_seconds": 60}
# The UAVs are cheap, so that a fleet of three may be cheaper than one of two that gets lost.
DESIGN = {"kind": "grid", "values": {"uavs": [1, 2], "pads": [1, 2], "quota": [60, 120]}}


@pytest.fixture(scope="module")
def fixed(studied):
    """A study of as many missions at every design point."""
    return studied(missions=40, design=DESIGN, costs=PRICES)


@pytest.mark.parametrize("metric", ["success", "collection_ratio"])
def test_each_condition_has_a_front_of_its_own(fixed, metric):
    table = cost_front(fixed, metric)
    for _, rows in table.groupby("condition"):
        expected = on_front(rows["cost"].to_numpy(), rows[metric].to_numpy())
        assert rows["on_front"].tolist() == expected.tolist()
        assert rows["probability"].between(0, 1).all()
        assert rows["probability"].sum() >= 1


def test_a_cost_lies_between_the_purchase_and_the_loss_of_all_uavs(fixed):
    missions = fixed.missions
    uavs, pads = missions["uavs"], missions["pads"]
    assert missions["least_cost"].tolist() == (1000 * uavs + 100 * pads).tolist()
    # Of 5 missions, each lasts for all of its slots of a minute, in which every UAV is in the air.
    slots = missions["most_slots"]
    running = 5 * (uavs * (1000 + 2 * slots / 100) + 6 * slots / 60)
    assert (missions["most_cost"] - missions["least_cost"]).tolist() == pytest.approx([*running])
    assert missions["cost"].between(missions["least_cost"], missions["most_cost"]).all()


def test_the_most_that_a_year_may_cost_counts_the_packs_of_the_smallest_uav():
    """A UAV of half the endurance empties its pack twice as often."""
    types = [{}, {"endurance": "17.5 min"}]
    space = ScenarioSpace.of(**SCENARIO | SHEET | {"fleet": types, "uavs": 2})
    plain = ScenarioSpace.of(**SCENARIO | SHEET | {"uavs": 2})
    costs = Costs(years=1, days=10, pack=300.0, pack_cycles=100, lost_uav=50.0)
    missions = {"point": [0, 1], "uavs": [2, 2]}
    emptied = most_battery_per_slot(plain) * plain.max_slots / 100
    most = [10 * 2 * (50 + 3 * packs * emptied) for packs in (2, 1)]
    assert costs.most_running([space, plain], missions).tolist() == pytest.approx(most)


def test_the_interval_of_a_mean_cost_is_that_of_its_own_fleet(fixed):
    """No fleet costs less than its own purchase, whatever the others cost."""
    table = priced_settings(fixed)
    purchase = 1000 * table["uavs"] + 100 * table["pads"]
    assert (table["cost_low"] >= purchase).all()
    for row in table.itertuples():
        missions = fixed.missions_of(row.policy)
        missions = missions[missions["point"] == row.point]
        expected = interval_of(metric_in_missions(missions, "cost"), missions["cost"].to_numpy())
        assert (row.cost, row.cost_low, row.cost_high) == pytest.approx(tuple(expected))


def test_types_of_uavs_are_settings_with_prices_of_their_own(studied):
    """Which drone: one with a price of its own, or one at the price of the study."""
    types = [[{"price": 1100}], [{"slots_per_cell": 2}]]
    design = {"kind": "grid", "values": {"fleet": types, "uavs": [1, 2]}}
    table = priced_settings(studied(missions=4, design=design, costs={"uav": 1000}))
    costs = table.set_index("fleet")["cost"].round().to_dict()
    assert costs == {
        "1 UAV and fleet price 1100": 1100,
        "2 UAVs and fleet price 1100": 2200,
        "1 UAV and fleet slots_per_cell 2": 1000,
        "2 UAVs and fleet slots_per_cell 2": 2000,
    }


def test_bad_questions_get_one_line(fixed, studied):
    free = studied(missions=5)
    for ask in (
        priced_settings,
        mean_cost_parts,
        cost_front,
        price_facts,
        verdicts.judge_settings,
    ):
        with pytest.raises(InputError, match=r"no prices"):
            ask(free)
    with pytest.raises(InputError, match="metric: 'reward' is unknown"):
        cost_front(fixed, "reward")
    with pytest.raises(InputError, match="does not search for the cheapest setting"):
        verdicts.judge_settings(fixed)


def test_prices_of_zero_leave_what_is_paid_for(studied):
    results = studied(missions=5, costs={"uav": 10.5}, set={"uavs": 2})
    assert set(results.missions["cost"]) == {21.0}
    table = cost_front(results)
    # What has a price is named.
    assert table["fleet"].tolist() == ["2 UAVs"] * 2
    assert table["condition"].tolist() == ["", ""]
