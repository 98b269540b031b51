"""What is told in units with a data sheet is what the model has in slots and data units."""

import math
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from dess import InputError, load_scenario, simulate_batch
from dess.analysis import tables
from dess.analysis.answers.fleet import tables as fleet_tables
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.fleet.costs import mean_cost_parts
from dess.analysis.answers.fleet.requirements import metric_asked_for
from dess.analysis.answers.fleet.risk import risk_facts
from dess.analysis.answers.fleet.rule_of_thumb import RuleOfThumb, charging_slots, rule_of_thumb
from dess.analysis.answers.settings.ranking import unequal_lengths
from dess.analysis.ask import (
    around,
    assumptions,
    bisection,
    failure_rates,
    limit_search,
    limits,
    tried_fleet,
)
from dess.analysis.ask.answer import FleetAnswer, VariationAnswer
from dess.analysis.ask.assumptions import assumption_facts
from dess.analysis.ask.bisection import Bisection
from dess.analysis.ask.question import sweep_question, what_if_question
from dess.analysis.metrics import AGE, column_in_sheet_unit, metric_of
from dess.analysis.names import declared_fields, field_named
from dess.analysis.study.cheapest import Cheapest, Setting
from dess.analysis.study.fields import CHECK
from dess.model.state import EAST, SOUTH
from dess.policies.registry import load
from dess.scenario.scenario import ScenarioSpace
from tests.analysis.small import SCENARIO, SHEET, found_of, write_scenario

PRICES = {"uav": 20_000, "pad": 5_000, "hour": 36}
SLOT, UNIT = 21.0, 21.0 * 125e3  # of SHEET: [s] and [bit]


@pytest.fixture(scope="module")
def searched(tmp_path_factory):
    """A search for the cheapest fleet with a data sheet."""
    folder = tmp_path_factory.mktemp("searched")
    question = sweep_question(
        {"uavs": (1, 2), "pads": (1, 2)},
        write_scenario(folder, **SHEET),
        ["greedy"],
        20,
        prices=PRICES,
        requirements={"success": 0.6, "ratio": 0.3, "age": "50 min"},
        folder=folder,
    )
    return question.ask()


def test_values_in_units_are_those_of_the_model_times_the_unit(searched):
    missions = searched.missions
    hours, megabytes = SLOT / 3600, UNIT / 8e6
    sizes = {"age": ("age_h", hours), "slots": ("slots_h", hours)}
    sizes |= {"uav_slots": ("uav_slots_h", hours), "collected": ("collected_MB", megabytes)}
    for column, (in_units, size) in sizes.items():
        assert column_in_sheet_unit(column, missions) == in_units
        np.testing.assert_allclose(missions[in_units], missions[column] * size, rtol=1e-12)
    assert searched.checks["age_h"].notna().all()


def test_the_price_of_an_hour_takes_the_slot_of_the_sheet(searched):
    hours = mean_cost_parts(searched)["hours"]
    means = searched.missions.groupby("point", sort=False)["slots"].mean()
    np.testing.assert_allclose(hours, 36 * means.to_numpy() * SLOT / 3600)


def test_a_search_answers_in_costs_of_a_year_and_of_a_gb(searched):
    # A UAV that may be lost at its price would ask for thousands of missions.
    year = {"years": 2, "days": 200, "pack": 900, "pack_cycles": 100, "lost_uav": 100}
    again = sweep_question(
        {"uavs": (1, 2), "pads": (1, 2)},
        searched.store.folder.parents[1] / "small.toml",
        ["greedy"],
        20,
        prices=PRICES | year,
        requirements={"success": 0.6, "ratio": 0.3, "age": "50 min"},
        folder=searched.store.folder.parents[1],
    )
    results = again.ask()
    answer = FleetAnswer(results, again)
    best = search_of(results).best
    missions = results.missions[results.missions["point"] == best.points[0]]
    uavs = results.uavs[results.uavs["point"] == best.points[0]]
    spent = (80 + uavs["charged"] - uavs["battery"]).sum() / len(missions)
    space = results.scenario(best.points[0])
    parts = {
        "purchase": (space.uavs[1] * 20_000 + space.charging_pads * 5_000) / 2,
        "packs": 200 * 900 * spent / 100 / 100,
        "hours": 200 * 36 * missions["slots"].mean() * SLOT / 3600,
    }
    assert best.cost == pytest.approx(sum(parts.values()))
    gb = 200 * missions["collected"].mean() * UNIT / 8e9
    for table in answer.tables().values():
        (row,) = table[table["selected"]].to_dict("records")
        assert {name: row[name] for name in parts} == pytest.approx(parts)
        assert row["gb"] == pytest.approx(gb)
        assert row["cost_per_gb"] == pytest.approx(best.cost / gb)
    found = found_of(answer.facts())
    ends = f"[{row['cost_low']:,.0f}, {row['cost_high']:,.0f}]"
    assert found["cost"] == f"{best.cost:,.0f} {ends} EUR a year"
    assert found["of it for the purchase"] == f"{parts['purchase']:,.0f} EUR"
    of_missions = f"battery packs {parts['packs']:,.0f} EUR, hours {parts['hours']:,.0f} EUR"
    assert f": {of_missions}, lost UAVs 0.00 EUR" in found["of it for 200 missions"]
    assert found["cost of data"] == f"{best.cost / gb / 1000:,.2f} EUR per MB collected"
    assert found["price when bought"] == f"{2 * parts['purchase']:,.0f} EUR"
    assert "over 2 years at 0 % interest; 200 missions a year" in found["paid for"]
    assert "Cost [EUR a year]" in answer.shown_tables()[0].cells
    assert "--price years=2" in again.command


def test_the_rule_of_thumb_takes_its_numbers_from_the_missions_of_the_answer(searched):
    best = search_of(searched).best
    missions = searched.missions[searched.missions["point"] == best.points[0]]
    uavs = searched.uavs[searched.uavs["point"] == best.points[0]]
    flights = missions["pad_requests"].sum()
    lacking = (80 + uavs["charged"] - uavs["battery"]).sum() / flights
    charge = 40 * 60 * lacking / 100
    wait = uavs["slots_waiting"].sum() / flights * SLOT
    rule = rule_of_thumb(searched, best.policy, best.points)
    assert rule.flying == pytest.approx(uavs["slots_flying"].sum() / missions["slots"].sum())
    assert rule.flight == pytest.approx(uavs["slots_flying"].sum() / flights * SLOT)
    assert rule.recovery == pytest.approx(charge + wait)
    assert rule.in_words == found_of(search_of(searched).facts())["rule of thumb"]


def test_each_uav_is_charged_at_the_rate_of_its_type():
    types = [{"endurance": "20 min", "charging": "10 min"}, {}]
    space = load_scenario("jade-bight", uavs=2, fleet=types)
    missions = {"point": [0], "uavs": [2], "flying_time": [100]}
    uavs = {"charged": [20, 0], "battery": [37, 30]}
    # 57 of 35 min are 20 min; 2 % a slot for what is charged in half of its flying time.
    slots = charging_slots([space], missions, uavs)
    assert slots == pytest.approx([(57 + 20 - 37) / 2, (100 - 30) / (35 / 40)])


def test_the_rule_of_thumb_by_hand():
    rule = RuleOfThumb(flying=1.3, flight=1500, recovery=2200)
    assert rule.uavs == 2 * (2 + 1)
    assert rule.in_words == "6 UAVs = 2 (ceil(36.7 min / 25 min) + 1); 1.3 in the air"


def test_ages_of_missions_of_different_lengths_are_not_compared_without_saying_so(studied):
    results = studied(set={"age.measured": True})
    means = results.missions.groupby("policy")["slots"].mean().round()
    fact = unequal_lengths(results, [metric_of("age")])
    ends = f"{means.min():.0f} mission slots to {means.max():.0f} mission slots on average"
    assert fact.label == "length of missions, compared by age of information"
    assert fact.found == ends
    assert unequal_lengths(results, [metric_of("collection_ratio")]).found == ""
    alike = replace(results, missions=results.missions.assign(slots=480))
    assert unequal_lengths(alike, [metric_of("age")]).found == ""


def test_without_a_sheet_nothing_is_told_in_units(studied):
    missions = studied(set={"age.measured": True}).missions
    assert column_in_sheet_unit(AGE, missions) == AGE
    assert not [name for name in missions if name.endswith(("_h", "_min", "_MB"))]


def test_lengths_and_data_of_a_question_are_in_units(tmp_path):
    scenario = write_scenario(tmp_path, **SHEET)
    longer = {"data_sheet.endurance": "70 min"}  # a slot is twice as long
    question = what_if_question(longer, None, scenario, ["greedy"], 3, folder=tmp_path)
    answer = VariationAnswer(question.ask(), question)
    table = answer.table().set_index("metric")
    assert table.loc["slots_h", ["before", "after"]].tolist() == pytest.approx([2, 2], rel=0.02)
    rows = answer.variation.measures_table("greedy").cells["greedy"].tolist()
    assert {"Length of the mission [h]", "Data collected [MB]"} <= {*rows}
    assert not [row for row in rows if "lots" in row]


def rule(**requirements):
    found = {"procedure": "cheapest", "indifference": 1.0, "requirements": requirements}
    return Cheapest.model_validate(found | {"budget": 4000, "first": 500})


@pytest.mark.parametrize("column", ["age", "age_h"])
@pytest.mark.parametrize(("age", "verdict"), [(5.0, "met"), (7.0, "missed")])
def test_an_age_is_required_to_be_at_most(column, age, verdict):
    asked = rule(age="6 h" if column == "age_h" else 6)
    samples = [{column: np.full(4000, age), "cost": np.ones(4000)}]
    choice = asked.choice(samples, [Setting({}, 0.0, horizon=24.0)])
    assert choice.verdicts == (verdict,)
    assert "age of at most 6" in choice.guarantee


def test_the_answer_has_every_requirement_in_its_unit(searched):
    facts = {fact.label: fact for fact in search_of(searched).facts()}
    age = facts["age of information"]
    # Half a percent of two hours more.
    assert (age.required, age.guaranteed) == ("at most 50 min", "at most 50.6 min")
    text = str(facts)
    assert not re.search(r"\d h\b", text)
    # A mission with a sheet ends on the ground.
    assert "way home" not in text


def test_the_check_has_every_requirement(searched):
    heads = [*fleet_tables.check_table(searched).cells]
    assert heads[-4:] == ["Success", "Collection ratio", "Age of information", "n"]


REFUSED = {
    "50": 'requirements.age: 50.0 does not fit; allowed: a time such as "6 h" in the',
    "3 km": "requirements.age: '3 km' has a unit of another kind",
    "2 h": "in the horizon of 1.995 h",
}


@pytest.mark.parametrize("given", REFUSED)
def test_an_age_that_cannot_be_required_is_refused(given, tmp_path):
    scenario, age = write_scenario(tmp_path, **SHEET), 50 if given == "50" else given
    with pytest.raises(InputError, match=REFUSED[given]):
        sweep_question({"uavs": (1, 2)}, scenario, prices=PRICES, requirements={"age": age})


def test_without_a_sheet_an_age_is_a_number_of_slots(tmp_path):
    with pytest.raises(InputError, match="'6 h' does not fit"):
        scenario, prices = write_scenario(tmp_path), {"uav": 1}
        sweep_question({"uavs": (1, 2)}, scenario, prices=prices, requirements={"age": "6 h"})


def test_the_fleet_is_asked_about_with_one_more(searched):
    assert not around.is_known(searched)
    scenario = str(searched.store.folder.parents[1] / "small.toml")
    question = around.question_around(searched, scenario, 10)
    first, *rows = question.study.design.rows
    changes = [{k: v for k, v in row.items() if first.get(k) != v} for row in rows]
    assert changes == [
        {"uavs": first["uavs"] + 1},
        {"pads": first["pads"] + 1},
    ]
    found = question.ask()
    assert around.is_known(searched)
    cells, caption, data = around.table_around(searched)
    assert "Cannot be simulated" not in caption
    assert cells["What if"][0] == "the fleet"
    assert caption.startswith("The fleet of 1 UAV")
    search = search_of(searched).best.fleets.set_index("fleet")["verdict"]
    for row in data.itertuples():
        is_met = row.success_low >= 0.6 and row.collection_ratio_low >= 0.3
        verdict = search.get(row.fleet)
        if verdict is None:
            assert (row.verdict == "met") == (is_met and row.age_h_high <= 50 / 60)
        else:
            assert row.verdict == verdict
    assert data["verdict"][0] == "met"
    assert all(text.endswith(" min)") for text in cells["Age of information"][1:])
    assert data["point"][0] == 0
    for metric in ("success", "age_h"):
        means = found.missions.groupby("point")[metric].mean()[data["point"]].to_numpy()
        measure = metric_asked_for(searched, metric)
        told = [measure.change(mean - means[0], 0, 0).split()[0] for mean in means[1:]]
        column = measure.name
        assert [text.split("(")[1].split()[0] for text in cells[column][1:]] == told
    assert data["lead"][1:].is_monotonic_increasing
    # One more UAV, among the facts of the answer.
    more_uavs = data["change"].tolist().index(f"{first['uavs'] + 1} UAVs")
    more = data["cost"][more_uavs] - data["cost"][0]
    ((label, text),) = found_of(around.one_more_facts(searched)).items()
    assert label == "one more UAV" and text.startswith(f"+{more:,.0f} EUR; ")
    tightest = search_of(searched).best.tightest_first[0].metric
    change = cells[tightest.name][more_uavs].split("(")[1].rstrip(")")
    assert change in text


def bear(limit, search):
    """Bisect with a condition that breaks beyond a limit; the number of values that were tried."""
    tried = 0
    while (value := search.value) is not None:
        search.learn(value, "age" if value > limit else "")
        tried += 1
    return tried


@pytest.mark.parametrize("limit", [1.0, 1.3, 2.71, 7.9])
def test_a_bisection_ends_within_five_percent(limit):
    search = Bisection(1.0, 8.0)
    assert bear(limit, search) < 10
    assert search.low <= limit < search.high <= search.low / 0.95
    assert search.broken == "age"


def test_a_bisection_says_what_is_borne_to_the_end_and_what_is_not_borne_at_all():
    easy = Bisection(1.0, 8.0)
    assert bear(9.0, easy) == 1
    assert (easy.low, easy.broken) == (8.0, "")
    hard = Bisection(0.0, 1.0, floor=0.001)
    assert bear(0.0005, hard) == 2 + (hard.high > 0.001)
    assert (hard.low, hard.broken) == (0.0, "age")
    calm = Bisection(0.0, 8.0)  # without a floor, the interval is halved
    bear(3.0, calm)
    assert calm.low <= 3.0 < calm.high <= calm.low / 0.95


def fly_check(searched, missions, **changes):
    """The first missions of the check of the cheapest fleet with changes, and those as they are."""
    best = search_of(searched).best
    point = best.points[-1]
    values = searched.study.set | searched.store.manifest.points[point].values
    space = load_scenario(searched.store.folder.parents[1] / "small.toml", **(values | changes))
    records = simulate_batch(space, load(best.policy), 0, range(CHECK, CHECK + missions))
    return pd.DataFrame(records.missions).join(pd.DataFrame(records.operations))


@pytest.fixture(scope="module")
def limited(searched):
    """The limits of the fleet by eight missions."""
    assert limits.limit_facts(searched) == []
    folder = searched.store.folder.parents[1]
    limit_search.find_limits(searched, str(folder / "small.toml"), missions=8)
    return {limit.field.split(".")[1]: limit for limit in limits.limits_of(searched).limits}


def test_the_limits_of_the_fleet_are_where_its_missions_break_a_requirement(
    searched, limited, monkeypatch
):
    assert limited.keys() == {"data_rate", "mtbf", "wind"}
    best = search_of(searched).best
    checks = searched.checks[searched.checks["point"] == best.points[-1]]
    for name in ("data_rate", "wind"):
        means = fly_check(searched, 8, **{f"data_sheet.{name}": limited[name].last}).mean()
        for requirement in best.tightest_first:
            column = requirement.column.removesuffix("_h")
            size = SLOT / 3600 if column == "age" else 1.0
            change = means[column] * size - checks[requirement.column][:8].mean()
            assert requirement.margin(checks[requirement.column].mean() + change) >= 0
    found = found_of(limits.limit_facts(searched))
    assert len(found) == 4 and "8 missions" in found["limits found on"]
    known = limits.limits_of(searched)
    without_wind = known.model_copy(update={"has_wind": False})
    monkeypatch.setattr(limits, "limits_of", lambda _: without_wind)
    assert (
        "not asked: the sheet has no max_speed" in found_of(limits.limit_facts(searched)).values()
    )


def test_the_limit_of_failures_is_that_of_many_missions(searched, limited):
    """Eight missions of 1/8 each cannot tell a success of 60 %; the closed form can."""
    assert limited["mtbf"].broken == "success"
    missions = fly_check(searched, 1000, **{"data_sheet.mtbf": limited["mtbf"].last})
    assert 0.58 <= missions["success"].mean() <= 0.66  # the time is rounded to the safe side


def error_of_model(model, column, rate):
    """The standard error of a mean at a rate of failures, by the jackknife over its missions."""
    missions = len(model.unfailed.hours)
    means = [model.without(row).mean(column, rate) for row in range(missions)]
    return math.sqrt(missions - 1) * np.std(means)


@pytest.mark.parametrize("repair", [{}, {"repair": "20 min"}])
def test_means_at_a_rate_of_failures_follow_from_other_rates(repair):
    """Of 300 missions with a failure every hour and 300 without; 600 with one every 4 h agree.

    Within three standard errors of their difference.
    """
    policy = load("greedy")
    flights = {}
    missions = {1e-8: 300, 1.0: 300, 0.25: 600}
    for rate, number in missions.items():
        sheet = SHEET["data_sheet"] | repair | {"mtbf": f"{1 / rate:g} h".replace("e+08", "0" * 8)}
        space = ScenarioSpace.of(**(SCENARIO | SHEET | {"uavs": 2, "data_sheet": sheet}))
        records = simulate_batch(space, policy, 5, number)
        hours = records.uavs["slots_flying"].sum(axis=1) * SLOT / 3600
        metrics = pd.DataFrame(records.missions)
        flights[rate] = tried_fleet.Flights(rate, hours, records.operations["failures"], metrics)
    model = failure_rates.FailureModel(flights[1e-8], flights[1.0])
    for column in ("success", "collection_ratio"):
        values = flights[0.25].metrics[column]
        error = math.hypot(error_of_model(model, column, 0.25), values.sem())
        assert abs(model.mean(column, 0.25) - values.mean()) <= 3 * error
        assert error < 0.025  # of 600 missions, half of which fail, 0.02
    assert flights[0.25].metrics["success"].mean() > flights[1.0].metrics["success"].mean() + 0.1


@pytest.mark.parametrize(("error", "last"), [(0.0, "7.1 m/s from SE"), (0.1, "7 m/s from SE")])
def test_the_wind_comes_from_eight_directions_and_the_worst_is_named(error, last):
    """From SE 7.3 m/s are borne, from N 7.9 m/s, from elsewhere all that UAVs can fly in."""
    tried = []

    def try_changes(changes):
        trials = []
        for change in changes:
            speed, _, place = change["data_sheet.wind"].partition(" m/s from ")
            tried.append(place)
            margin = {"SE": 7.3, "N": 7.9}.get(place, 20) - float(speed)
            trials.append(tried_fleet.Trial({"age": margin}, {"age": error * 7.3}))
        return trials

    fleet = SimpleNamespace(space=load_scenario("jade-bight"), try_changes=try_changes)
    found = bisection.find_strongest_wind(fleet)
    assert (found.last, found.broken, found.is_rough) == (last, "age", error > 0)
    assert found.present == "8 m/s from SW" and found.harder == pytest.approx(7.3 / 8, rel=0.05)
    assert {*tried[:8]} == {*limits.PLACES} and {*tried[8:]} == {"N", "SE"}


def limit(field, present, last, harder, broken):
    field = f"data_sheet.{field}"
    return limits.Limit(field=field, present=present, last=last, harder=harder, broken=broken)


DATA = limit("data_rate", "3 MB/h", "24 MB/h", 8.0, "")
WIND = limit("wind", "8 m/s from SW", "8 m/s from N", 1.0, limits.SHEET)
ROUGH = limit("wind", "8 m/s from SW", "7 m/s from SE", 0.9, "age").model_copy(
    update={"is_rough": True}
)
FAILURES = limit("mtbf", "", "", 0.0, "success")
SMALL = limit("data_rate", "2 kB/h", "8.8 kB/h", 4.4, "success").model_copy(
    update={"small_zone": "zones.0, which has 1 cell for 2 UAVs"}
)


@pytest.mark.parametrize(("limit", "said"), [
    (WIND, "8 m/s from N, the worst of 8 directions (8 m/s from SW assumed); beyond it, UAVs "
     "cannot fly"),
    (ROUGH, "about 7 m/s from SE, the worst of 8 directions (8 m/s from SW assumed); beyond it, "
     "the age of information breaks"),
    (DATA, "24 MB/h (3 MB/h assumed); no more was tried"),
    (SMALL, "8.8 kB/h (2 kB/h assumed); beyond it, the success breaks, as UAVs are lost at "
     "zones.0, which has 1 cell for 2 UAVs"),
    (FAILURES, "not even one every 100000 h (none assumed); beyond it, the success breaks"),
])  # fmt: skip
def test_a_limit_is_told_with_what_is_assumed_and_what_ends_it(limit, said, monkeypatch):
    document = limits.Limits(missions=30, limits=(limit,), has_wind=True)
    monkeypatch.setattr(limits, "limits_of", lambda results: document)
    assert limits.limit_facts(None)[0].found == said


def test_the_limit_that_breaks_something_nearest_is_told_first():
    for found in [(WIND, FAILURES, DATA), (ROUGH, FAILURES, DATA)]:
        assert [*found] == sorted([*found][::-1], key=limit_search._order_of)


class _Onward:
    """All UAVs take one action, and none ever charges."""

    name = "onward"

    def __init__(self, action):
        self.action = action

    def act(self, view):
        return np.full(len(view), self.action)


@pytest.mark.parametrize(
    ("action", "cells", "told"),
    [
        (EAST, 1, "zones.0, which has 1 cell for 2 UAVs"),
        (EAST, 2, ""),  # there is a cell for each
        (SOUTH, 1, ""),  # they are lost beside the start zone
    ],
)
def test_a_limit_names_the_small_zone_at_which_uavs_are_lost(action, cells, told, monkeypatch):
    zones = [{"cells": [60, 0, cells, 1], "pads": 1}]
    sea = {"grid": 64, "rows": 8, "zone": [0, 0, 2, 1], "nodes": [[30, 0]], "zones": zones}
    fleet = object.__new__(tried_fleet.TriedFleet)
    known = {"missions": 3, "_team": _Onward(action), "_seed": 1, "_workers": 1, "_progress": None}
    for name, value in known.items():
        monkeypatch.setattr(fleet, name, value, raising=False)
    monkeypatch.setattr(fleet, "load", lambda change: load_scenario("paper", **sea, **change))
    assert fleet.small_zone_of_losses({"uavs": 2}) == told


def test_the_risk_is_told_of_the_missions_of_the_check(searched):
    best = search_of(searched).best
    checks = searched.checks[searched.checks["point"] == best.points[0]]
    found = found_of(risk_facts(searched, best.policy, best.points))
    assert found["missions with a lost UAV"] == "0 of 20"
    oldest = f"{60 * checks['age_h'].quantile(0.9):.4g} min"
    assert found["worst 10 % of the missions"] == f"age of information {oldest} or more"


def test_a_repair_of_0_reads_as_what_it_is():
    repairs = [field_named(f"failures.{name}_repair") for name in ("uav", "pad", "node")]
    assert [repair.cell(0.0) for repair in repairs] == ["lost for good", *["never repaired"] * 2]
    assert [repair.cell(20.0) for repair in repairs] == ["20"] * 3
    assert field_named("uavs").cell(0) == "0"
    row = {"failures.uav_repair": 0.0, "n": 8, "rate": 0.01, "mean": 0.9, "low": 0.8, "high": 1.0}
    cells = tables.estimate_cells(pd.DataFrame([row]), ["failures.uav_repair", "n"], "rate")
    assert cells.iloc[0, 0] == "lost for good"


def test_fields_that_follow_from_the_sheet_are_marked(searched):
    space = searched.scenario(0)
    marked = {
        row.name for row in declared_fields(space) if row.meaning.endswith(", from the data sheet")
    }
    assert marked == set(space.data_sheet.fields()) and "cell_size" in marked


def test_what_is_assumed_has_the_numbers_of_the_sheet(searched):
    found = found_of(assumption_facts(searched))
    assert found["slot"].startswith("21 s, a hundredth of the endurance of 35 min")
    assert found["cell"] == "315 m wide, the way of a slot at 15 m/s"
    assert found["charging"] == "from empty to full in 40 min"


def test_what_is_assumed_says_what_nodes_have_when_a_mission_begins():
    """A mission of 8 h a day leaves 16 h of data, which only an idle time brings into it."""
    sheet = {"data_sheet.idle": None, "data_sheet.backlog": None, "data_sheet.horizon": "8 h"}
    space = load_scenario("jade-bight", **sheet)
    said = assumptions.data_at_the_start(space, set())
    assert said.startswith("none, of age 0") and "the data of 16 h more" in said
    whole = load_scenario("jade-bight", **sheet | {"data_sheet.horizon": "24 h"})
    assert "once a day" not in assumptions.data_at_the_start(whole, set())
    idle = load_scenario("jade-bight", **sheet | {"data_sheet.idle": "16 h"})
    said = assumptions.data_at_the_start(idle, set())
    assert said == "those of 16 h without a mission, which is their age"
    more = load_scenario("jade-bight", **sheet | {"data_sheet.backlog": "2 MB"})
    assert assumptions.data_at_the_start(more, set()).startswith("2 MB, of age 0")


def test_what_is_assumed_says_what_slots_and_cells_follow_from():
    space = load_scenario("jade-bight", **{"data_sheet.cruise": "12 m/s"})
    assert assumptions.slot_in_words(space, set()) == (
        "26.25 s, in which a UAV crosses a cell at 12 m/s"
    )
    assert assumptions.cell_in_words(space, set()) == "315 m wide at any cruising speed"
    assert "26.25 s" not in assumptions.slot_in_words(space, {"cruise"})


def test_a_limit_is_told_in_the_unit_of_the_sheet():
    speed, unit = bisection.in_unit_of("10 kt from SW", 8.0, "m/s from deg")
    assert unit == "kt" and speed == pytest.approx(8 * 3600 / 1852)
    assert bisection.in_unit_of("30 d", 86_400.0, "s") == (1, "d")
