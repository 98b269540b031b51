"""The search of the cheapest setting that meets requirements."""

from typing import Any

import numpy as np
import pytest
from scipy import stats

from dess import InputError
from dess.analysis import load_study
from dess.analysis.results.manifest import Manifest
from dess.analysis.study.cheapest import Cheapest, Setting, _Search, as_share
from dess.analysis.study.prices import PARTS, Costs, spent_battery, stranded_uavs
from dess.analysis.study.study import study_from
from dess.scenario.scenario import ScenarioSpace, load_scenario
from tests.analysis.stats.test_betting import most
from tests.analysis.study.test_selection import check_that_interruptions_leave_no_trace


def test_prices_change_no_key_of_a_mission():
    free = Manifest.of(load_study("table4", missions=2, policies=["greedy"]))
    study = load_study("table4", missions=2, policies=["greedy"], costs={"uav": 20_000})
    assert Manifest.of(study).cells == free.cells


def space(**fields: Any) -> ScenarioSpace:
    return load_scenario("paper", **fields)


def test_the_cost_of_missions_by_hand():
    # Point 0: 2 UAVs, 16 pads; point 1: 1 UAV, 3 pads. The last UAV floats out at sea.
    spaces = [space(uavs=2), space(uavs=1, pads=3)]
    missions = {"point": [1, 0], "uavs": [1, 2], "slots": [90, 30]}
    uavs = {"charged": [53, 40, 0], "down": [0, 1, 1]}
    prices = Costs(uav=100, pad=10, charge=2, hour=60, lost_uav=50, missions=7, slot_seconds=120)
    parts = prices.parts(spaces, missions, uavs)
    assert [*parts] == [*PARTS]
    assert parts["purchase"].tolist() == [100 + 3 * 10, 2 * 100 + 16 * 10]
    assert parts["charging"] == pytest.approx([7 * 2 * 0.53, 7 * 2 * 0.40])
    assert parts["hours"] == pytest.approx([7 * 60 * 3, 7 * 60 * 1])
    assert parts["losses"].tolist() == [0, 7 * 50 * 2]


def test_the_cost_of_a_year_by_hand():
    # As above. The battery of each UAV is 80 % at the start, except for the type of the first one
    # of point 1, which has 70 %. They spend 70 + 53 - 33 = 90 % and (80 - 20) + 40 + 80 = 180 %.
    spaces = [space(uavs=2, flying_time=80), space(uavs=1, pads=3, fleet=[{"flying_time": 70}])]
    missions = {"point": [1, 0], "uavs": [1, 2], "slots": [90, 30], "flying_time": [80, 80]}
    uavs = {"charged": [53, 40, 0], "down": [0, 1, 1], "battery": [33, 20, 0]}
    prices = Costs(
        uav=100, pad=10, charge=2, hour=60, lost_uav=50, slot_seconds=120,
        years=2, interest=0.1, days=250, pack=30, pack_cycles=200,
    )  # fmt: skip
    parts = prices.parts(spaces, missions, uavs)
    assert [*parts] == [*prices.part_names]
    # What 1 EUR costs in each of 2 years: 0.1 * 1.21 / 0.21.
    annuity = 0.1 * 1.1**2 / (1.1**2 - 1)
    assert annuity == pytest.approx(0.576190476)
    assert parts["purchase"] == pytest.approx([130 * annuity, 360 * annuity])
    assert parts["packs"] == pytest.approx([250 * 30 * 0.9 / 200, 250 * 30 * 1.8 / 200])
    assert parts["charging"] == pytest.approx([250 * 2 * 0.9, 250 * 2 * 1.8])
    assert parts["hours"] == pytest.approx([250 * 60 * 3, 250 * 60 * 1])
    assert parts["losses"].tolist() == [0, 250 * 50 * 2]
    assert prices.loss_of_fleets(spaces[0]) == 250 * 50 * 2


def test_a_lost_uav_costs_what_it_was_bought_for_where_missions_are_paid_for():
    """UAV 1, of a type with a price, is lost."""
    spaces = [space(uavs=2, fleet=[{}, {"price": 300.0}])]
    missions = {"point": [0], "uavs": [2], "slots": [90], "flying_time": [80]}
    uavs = {"charged": [0, 0], "down": [0, 1], "battery": [33, 0]}

    def losses(**prices: Any) -> float:
        return float(Costs(uav=100, **prices).parts(spaces, missions, uavs)["losses"][0])

    assert losses() == 0  # only the purchase is paid for
    assert losses(years=5, days=200) == 200 * 300
    assert losses(missions=7) == 7 * 300
    assert losses(charge=1) == losses(hour=1, slot_seconds=60) == 300
    assert losses(years=5, days=200, lost_uav=0) == 0
    assert losses(years=5, days=200, lost_uav=50) == 200 * 50
    assert Costs(years=5, days=9).amounts_on(spaces)["a lost UAV"] == "what it was bought for"
    assert Costs(uav=1).amounts_on(spaces)["a lost UAV"] == ""


def test_the_price_of_a_type_replaces_that_of_a_uav():
    """UAV 0 and 2 of type 1 cost 300 each, UAV 1 of type 2 what the study says."""
    types = [{"price": 300.0}, {}]
    spaces = [space(uavs=[1, 3], fleet=types), space(uavs=3, pads=1)]
    missions = {"point": [0, 0, 1], "uavs": [3, 1, 3], "slots": [9] * 3, "flying_time": [80] * 3}
    prices = Costs(uav=100, pad=10, years=2, days=1)
    parts = prices.parts(spaces, missions, {"down": [0] * 7})
    pads = 10 * spaces[0].charging_pads
    assert parts["purchase"].tolist() == [(700 + pads) / 2, (300 + pads) / 2, (300 + 10) / 2]
    amounts = prices.amounts_on(spaces)
    assert amounts["a UAV of type 1"] == "300 EUR" and amounts["a UAV"] == "100 EUR"
    of_types = Costs(pad=10).amounts_on([space(uavs=1, fleet=[{"price": 300.0}])])
    assert of_types["a charging pad"] == "10.00 EUR" and "a UAV" not in of_types


def test_the_battery_that_a_small_type_has_spent_counts_from_its_own():
    sheet = {
        **{"endurance": "40 min", "cruise": "15 m/s", "charging": "55 min", "horizon": "2 h"},
        **{"data_rate": "3 MB/h", "bandwidth": "125 kHz", "snr": "12 dB at 2 km"},
    }
    spaces = [ScenarioSpace.of(uavs=2, fleet=[{"endurance": "20 min"}, {}], data_sheet=sheet)]
    missions = {"point": [0], "uavs": [2], "flying_time": [100]}
    uavs = {"charged": [20, 0], "battery": [45, 30]}
    assert spent_battery(spaces, missions, uavs).tolist() == [50 + 20 - 45, 100 - 30]
    # They wear half of a pack's cycle and 0.7 of one, but are charged by the same energy.
    missions["slots"] = [300]
    uavs["down"] = [0, 0]
    prices = Costs(charge=2, pack=30, pack_cycles=200, years=1, days=10)
    parts = prices.parts(spaces, missions, uavs)
    assert parts["packs"] == pytest.approx([10 * 30 * (25 / 50 + 0.7) / 200])
    assert parts["charging"] == pytest.approx([10 * 2 * (0.25 + 0.7)])


def test_without_interest_a_price_is_paid_in_equal_parts():
    free, cheap = (Costs(uav=300, years=3, days=1, interest=r) for r in (0, 1e-12))
    assert free.purchase_of(600, 0) == 200
    assert cheap.purchase_of(600, 0) == pytest.approx(200, rel=1e-11)


def test_a_year_and_a_number_of_missions_exclude_each_other():
    for fields, line in {
        "years": "days: is missing; allowed: with years, the missions of a year: 1..365",
        "years days missions": "missions: is given beside years; allowed: days instead",
        "days": "days: is given without years; allowed: with years",
        "interest": "interest: is given without years; allowed: with years",
        "pack": "pack: is given without years; allowed: with years",
        "pack_cycles": "pack_cycles: is given without years; allowed: with years",
    }.items():
        given = {"years": 5, "days": 200, "missions": 7, "interest": 0.1, "pack": 5}
        given |= {"pack_cycles": 200}
        costs = {"uav": 1, **{field: given[field] for field in fields.split()}}
        with pytest.raises(InputError) as error:
            load_study("table4", costs=costs)
        assert str(error.value) == f"study table4: costs: {line}"


def test_results_of_before_are_priced_if_charging_and_losses_have_no_price():
    missions, uavs = {"point": [0], "uavs": [1], "slots": [90]}, {"battery": [27]}
    assert Costs(uav=100).parts([space(uavs=1)], missions, uavs)["purchase"].tolist() == [100]
    for price, field in (({"charge": 2}, "charged"), ({"lost_uav": 2}, "down")):
        line = f"^costs: .* no {field}, .*; allowed: .* another results folder$"
        for known in (uavs, uavs | {field: [np.nan]}):  # a folder with older and newer files
            with pytest.raises(InputError, match=line):
                Costs(**price).parts([space(uavs=1)], missions, known)


def test_a_uav_that_cannot_fly_home_is_stranded_unless_it_is_lost():
    uavs = {"battery": [5, 6, 0, 3], "way_home": [6, 6, 9, 9], "down": [0, 0, 1, 1]}
    assert stranded_uavs(uavs).tolist() == [True, False, False, False]


def rule(**fields):
    defaults = {
        "procedure": "cheapest",
        "requirements": {"success": 0.99},
        "tolerance": 0.005,
        "indifference": 1000.0,
        "budget": 10**9,
    }
    return Cheapest.model_validate(defaults | fields)


def constant(success, costs, conditions=1, missions=5000):
    """Samples and settings without any noise; each fleet comes under every condition."""
    rows = zip(success, costs, strict=True)
    samples = [{"success": np.full(missions, s), "cost": np.full(missions, c)} for s, c in rows]
    places = (divmod(n, conditions) for n in range(len(costs)))
    return samples, [Setting({"uavs": f, "arrival_rate": c}, 0.0) for f, c in places]


def noisy(success, costs, conditions=1, missions=15_000):
    """The same with missions that fail now and then, and noise in the costs."""
    samples, settings = constant(success, costs, conditions, missions)
    generator = np.random.default_rng(3)
    for sample in samples:
        sample["success"] = (generator.random(missions) < sample["success"]).astype(float)
        sample["cost"] = sample["cost"] + generator.normal(0, 3000.0, missions)
    return samples, settings


RARE = noisy([0.985, 0.985, 0.985, 0.99, 0.995, 1.0], [40e3, 41e3, 42e3, 43e3, 44e3, 44.5e3])
CONDITIONS = noisy([0.995, 0.985, 1.0, 0.985, 0.995, 1.0], [40e3, 41e3, 42e3, 43e3, 44e3, 45e3], 2)


def test_a_cost_is_bounded_as_the_method_says():
    """By the t quantile of the differences, and by losses that have not been seen."""
    samples, settings = noisy([1.0, 1.0, 1.0], [50e3, 49e3, 48e3], missions=40)
    settings = [setting._replace(loss=7e4) for setting in settings]
    search = _Search(rule(), samples, settings)
    search.points.counts[:], search.points.analyses[:] = [40, 30, 20], [3, 2, 1]
    excess = search._excess(np.array([[0], [1], [2]]), 1)
    assert excess[1] == 0.0
    for other, n, look in ((0, 30, 2), (2, 20, 1)):
        error = 0.025 / (6 * look * (look + 1))
        differences = samples[1]["cost"][:n] - samples[other]["cost"][:n]
        width = stats.t.ppf(1 - error, n - 1) * stats.sem(differences) - 7e4 * np.log(error) / n
        assert excess[other] == pytest.approx(differences.mean() + width)


def test_the_cheapest_that_meets_the_requirements_is_selected():
    samples, settings = constant([0.9, 1.0, 1.0, 0.9], [40e3, 50e3, 60e3, 70e3])
    choice = rule().choice(samples, settings)
    (answer,) = choice.answers
    assert (answer.points, answer.left, answer.settled) == ((1,), ((1,),), True)
    assert choice.selected == [1]
    assert choice.verdicts[:2] == ("missed", "met")
    # Point 0 is ruled out in round one, and none that costs more than point 1 needs more.
    assert choice.counts[1] > choice.counts[0] == choice.counts[2] == choice.counts[3] == 20
    assert "at least 0.985. No setting that is said to miss them" in choice.guarantee
    assert "at most 1,000 EUR more than any that has" in choice.guarantee


@pytest.mark.parametrize("share", [0.985, 0.995])
def test_a_wrong_choice_is_rare(share):
    """Fleet 1 is just infeasible, or just feasible; the missions of both decide what is asked."""
    wrong = 0
    for seed in range(40):
        generator = np.random.default_rng([2, seed])
        samples, settings = constant([0.9, share, 1.0], [40e3, 45e3, 50e3], missions=15_000)
        for sample, rate in zip(samples, (0.9, share, 1.0), strict=True):
            sample["success"] = (generator.random(15_000) < rate).astype(float)
        answer = rule().choice(samples, settings).answers[0]
        wrong += answer.points != ((1,) if share > 0.99 else (2,))
    assert wrong <= 40 * most(40)


def test_what_saves_less_than_the_indifference_need_not_be_decided():
    samples, settings = noisy([0.99, 1.0], [49.5e3, 50e3])
    for sample, cost in zip(samples, (49.5e3, 50e3), strict=True):
        sample["cost"][:] = cost
    choice = rule().choice(samples, settings)
    assert choice.answers[0].points == (1,)
    assert choice.answers[0].left == ((0,), (1,))
    assert choice.verdicts == ("open", "met")


def test_conditions_have_their_answers_and_one_for_all_of_them():
    # Fleets 0, 1, 2, each under conditions 0 and 1.
    samples, settings = constant(
        [1.0, 0.9, 1.0, 1.0, 1.0, 1.0], [40e3, 41e3, 50e3, 51e3, 60e3, 61e3], conditions=2
    )
    choice = rule().choice(samples, settings)
    assert [a.condition for a in choice.answers] == [{"arrival_rate": 0}, {"arrival_rate": 1}, None]
    assert [a.points for a in choice.answers] == [(0,), (3,), (2, 3)]
    assert choice.selected == [0, 2, 3]


def test_the_budget_is_kept():
    choice = rule(budget=2345).choice(*RARE)
    assert choice.done
    assert 2345 - len(choice.counts) < choice.missions <= 2345
    assert not choice.answers[0].settled
    assert "the budget of 2345 missions ended before all was decided" in choice.guarantee


@pytest.mark.parametrize("budget", [10**9, 3000])
@pytest.mark.parametrize("problem", [RARE, CONDITIONS], ids=["rare", "conditions"])
def test_interruptions_leave_no_trace(problem, budget):
    check_that_interruptions_leave_no_trace(rule(budget=budget), *problem)


@pytest.mark.parametrize(
    ("scenario", "metric", "amount", "line"),
    [
        ("new-jersey", "collection_ratio", 0.8, "tends to 1 in a year; allowed: age, oldest, late"),
        ("jade-bight", "late", 0.1, "is not measured; allowed: a scenario with weather"),
    ],
)
def test_what_years_do_not_decide_and_missions_do_not_measure_is_refused(
    scenario, metric, amount, line
):
    rule = {"procedure": "cheapest", "requirements": {metric: amount}, "indifference": 1}
    about = {"scenario": scenario, "costs": {"uav": 1}, "policies": ["greedy"], "selection": rule}
    with pytest.raises(InputError, match=f"requirements.{metric}: {line}"):
        study_from({"name": "refused", **about}, "study")


def test_late_data_are_required_at_most():
    assert as_share("late", 0.1, 24.0) == 0.9 and as_share("success", 0.1, 24.0) == 0.1


def test_spares_are_bought_like_uavs_and_days_follow_from_the_weather():
    costs = Costs.model_validate({"uav": 100, "pad": 10, "years": 5})
    for spares, fleet in ((0, 2), (1, 3)):
        space = load_scenario("new-jersey", uavs=2, **{"data_sheet.spares": spares})
        costs.check([space])
        assert costs.price_of_fleet(space) == 100 * fleet + 10 * space.charging_pads
    with pytest.raises(InputError, match="costs: days: follows from the weather"):
        costs.model_copy(update={"days": 200}).check([space])
    with pytest.raises(InputError, match="costs: days: is missing"):
        costs.check([load_scenario("jade-bight")])
