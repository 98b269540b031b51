"""The answer of a search for the cheapest fleet: its table, facts and guarantee."""

from types import SimpleNamespace

import pandas as pd
import pytest

from dess.analysis import numbers, run_study
from dess.analysis.answers import decided
from dess.analysis.answers.fleet import cheapest, verdicts
from dess.analysis.answers.fleet import tables as fleet_tables
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.fleet.costs import mean_cost_parts, price_facts, priced_settings
from dess.analysis.answers.settings.baseline import compare_with_baseline
from dess.analysis.metrics import COST, RATIO, metric_of
from dess.analysis.stats.differences import compare_pairs
from dess.analysis.stats.intervals import share_interval
from dess.analysis.stats.kinds import level_after
from dess.analysis.stats.requirement import Requirement
from dess.analysis.study.fields import CHECK
from tests.analysis.answers.fleet.test_costs import DESIGN, PRICES
from tests.analysis.small import found_of, small_study

RULE = {
    "procedure": "cheapest",
    "requirements": {"success": 0.8},
    "tolerance": 0.1,
    "indifference": 50,
    "budget": 20_000,
    "check": 6,
}


@pytest.fixture(scope="module")
def searched(studied):
    """A study that looks for the cheapest setting."""
    return studied(selection=RULE, design=DESIGN, costs=PRICES)


ASKED = (verdicts.judge_settings, verdicts.quoted_settings, verdicts.checked_settings)


def test_a_search_is_kept_told_and_checked(searched):
    manifest = searched.store.manifest
    selections = decided.selected_settings(searched)
    for number, policy in enumerate(searched.policies):
        choice = searched.cheapest(policy)
        assert manifest.selected[number] == choice.selected
        assert choice.done
        missions = searched.missions[searched.missions["policy"] == policy]
        assert missions.groupby("point").size().tolist() == list(choice.counts)
        checks = searched.checks[searched.checks["policy"] == policy]
        assert checks["point"].drop_duplicates().tolist() == choice.selected
        assert (checks.groupby("point").size() == 6).all()
        assert checks["replication"].min() == CHECK if choice.selected else checks.empty
        # Two conditions, and both.
        assert (selections["policy"] == policy).sum() == 3
    assert manifest.selected[0]  # or this test says little
    assert len(verdicts.checked_settings(searched)) == len(searched.checks) / 6
    assert searched.choice("greedy") is None
    saving = "costs at most 50.00 EUR more than any"
    assert all(saving in guarantee for guarantee in search_of(searched).guarantees())


def test_an_answer_quotes_the_check_and_a_table_allows_for_the_search(searched):
    found, quoted, checks = (ask(searched).set_index(["policy", "point"]) for ask in ASKED)
    others = found.index.difference(checks.index)
    assert quoted.loc[checks.index, checks.columns].equals(checks)
    assert quoted.loc[others].equals(found.loc[others])
    assert "intervals that allow for the search" in fleet_tables.fleet_table(searched).caption
    measured = found_of(search_of(searched).facts())["measured in"]
    assert measured == "6 missions that check it, under the worst condition for each metric"
    for (policy, point), row in found.iterrows():
        missions = searched.missions.query("policy == @policy and point == @point")
        level = float(level_after(searched.analyses(policy)[point]))
        assert level > 0.95
        _, *ends = share_interval(int(missions["success"].sum()), len(missions), level)
        assert [row["success_low"], row["success_high"]] == pytest.approx(ends)


def test_differences_from_a_baseline_allow_for_the_search(searched):
    """Two settings are compared on the missions of both, at the error of their last look."""
    analyses = searched.analyses("greedy")
    missions = searched.missions.query("policy == 'greedy'")
    wide = missions.pivot(index="replication", columns="point", values="success")
    for row in (
        compare_with_baseline(searched, 0, ["success"]).query("policy == 'greedy'").itertuples()
    ):
        both = wide[[row.point, 0]].dropna().to_numpy(float)
        level = float(level_after(min(analyses[row.point], analyses[0])))
        expected = compare_pairs(*both.T, level, "success")
        assert (row.low, row.high) == pytest.approx((expected.low, expected.high))
        assert row.p >= expected.p


def test_the_guarantee_is_of_each_policy_and_says_what_it_takes_of_costs(searched):
    guarantee = searched.cheapest("greedy").guarantee
    assert guarantee.startswith("for each policy by itself, three statements hold together")
    assert "with a probability of at least 0.95." in guarantee
    assert "takes the differences of costs as nearly normal" in guarantee


def test_the_table_has_the_fleets_by_cost_with_verdicts_and_the_answer_marked(searched):
    rows = fleet_tables.fleet_rows(searched)
    assert rows["cost"].is_monotonic_increasing
    cells, caption, _ = fleet_tables.fleet_table(searched)
    assert [text.split(":")[0] for text in cells["Requirements"]] == [*rows["verdict"]]
    marked = cells[cells["Requirements"] == "met: the answer"]
    best = search_of(searched).best
    assert marked[["Fleet", "Policy"]].to_numpy().tolist() == [[best.fleet, best.policy]]
    assert "success of at least 80 %" in caption
    # Missions of the paper may end in the air; the required metric, the way home and n are there.
    assert [*cells][-3:] == ["Success", "Battery for the way home", "n"]
    worst = (
        verdicts.judge_settings(searched).groupby(["policy", "fleet"])[["success", "home"]].min()
    )
    for row in rows.itertuples():
        assert (row.success, row.home) == tuple(worst.loc[row.policy, row.fleet])
        assert row.purchase + row.running == pytest.approx(row.cost)


def test_a_long_table_shows_the_rows_about_the_answer():
    rows = pd.DataFrame({"answer": [""] * 40 + ["answer"] + [""] * 20})
    assert [*fleet_tables.shown_rows(rows, 20).index] == [*range(30, 50)]
    assert [*fleet_tables.shown_rows(rows[40:], 20).index] == [*range(40, 60)]
    assert [*fleet_tables.shown_rows(rows[:42], 20).index] == [*range(22, 42)]


def test_the_price_is_told_in_its_parts(searched):
    best, table = search_of(searched).best, mean_cost_parts(searched)
    rows = table[(table["policy"] == best.policy) & table["point"].isin(best.points)]
    purchase, hours = rows["purchase"].mean(), rows["hours"].mean()
    found = found_of([*search_of(searched).facts(), *price_facts(searched)])
    assert found["of it for the purchase"] == f"{purchase:,.0f} EUR"
    assert f"hours {numbers.format_money(hours, 'EUR')}" in found["of it for 5 missions"]
    assert best.cost == pytest.approx(rows["cost"].mean())
    assert found["prices"].startswith("a UAV 1,000 EUR, a charging pad 100 EUR")
    assert found["paid for"] == "the purchase and 5 missions"
    assert search_of(searched).headline() == (
        f"Buy {best.fleet}: {numbers.format_money(best.cost, 'EUR')} with 5 missions."
    )


def test_what_is_shown_of_missions_is_of_the_answer(searched):
    search = search_of(searched)
    best, shown = search.best, search.shown_missions
    assert {*shown["policy"]} == {best.policy}
    assert {*shown["point"]} == {best.points[-1]}


def test_an_answer_says_whether_uavs_can_fly_home(searched):
    best = search_of(searched).best
    means = (
        searched.checks[searched.checks["policy"] == best.policy].groupby("point")["home"].mean()
    )
    worst = means[[*best.points]].min()
    found = found_of(search_of(searched).facts())
    assert found["battery for the way home"].startswith(f"{numbers.format_percent(worst)} [")
    parts = mean_cost_parts(searched)
    rows = parts[(parts["policy"] == best.policy) & parts["point"].isin(best.points)]
    number = numbers.format_quantity(round(rows["stranded"].mean(), 2))
    assert found["UAVs without it, which have no price"] == f"{number} of a mission"


# A sea with a second zone, whose pads are paid for.
TWO_ZONES = {"zones": [{"cells": [0, 6, 2, 2], "pads": 1}]}


def searched_sea(folder, policies, requirements, values, **rule):
    """The answer of a search on a sea with two zones."""
    rule = {**RULE, "requirements": requirements, "check": 0, **rule}
    study = small_study(
        folder, policies=policies, selection=rule, design={"kind": "grid", "values": values},
        set=TWO_ZONES, costs={"uav": 1000, "pad": 100},
    )  # fmt: skip
    return run_study(study, folder / "out")


def test_an_answer_says_what_is_guaranteed_names_all_that_is_paid_and_its_ends(tmp_path):
    values = {"uavs": [2, 3], "pads": [1, 2], "zones.pads": [1, 3]}
    asked = {"success": 0.6, "collection_ratio": 0.11}
    found = searched_sea(tmp_path, ["random", "greedy"], asked, values)
    search = search_of(found)
    fleet = "2 UAVs, 1 pad in zone 1 and 1 pad in zone 2"
    assert search.headline() == f"Buy {fleet}: 2,200 EUR."
    facts = {fact.label: fact for fact in search.facts()}
    # Of two policies with the same fleet, the answer is the one that collects more.
    assert facts["policy"].found == "greedy"
    assert facts["with random"].found.startswith(f"{fleet}, 2,200 EUR; ")
    (random,) = (answer for answer in search.fleet_answers if answer is not search.best)
    assert random.measured(random.tightest_first[0].column) in facts["with random"].found
    success = facts["success"]
    assert (success.required, success.guaranteed) == ("at least 60 %", "at least 50 %")
    # Of two policies.
    assert facts["probability of what is guaranteed"].found == "at least 95 %"
    (other,) = (answer for answer in search.fleet_answers if answer is not search.best)
    assert found_of(other.facts())["probability of what is guaranteed"] == "at least 97.5 %"
    ends = "2 UAVs (least), pads of each further zone 1 (least)"
    assert facts["a cheaper one may lie beyond"].found == ends
    assert {*priced_settings(found)["cost"]} == {
        1000 * u + 100 * p for u in (2, 3) for p in (2, 3, 4, 5)
    }
    assert "1 pad in zone 1 and 3 pads in zone 2" in "".join(priced_settings(found)["fleet"])


def test_an_answer_says_that_a_second_platform_is_not_needed(tmp_path):
    values = {"uavs": [2], "zones.pads": [0, 1]}
    found = searched_sea(tmp_path, ["greedy"], {"success": 0.5}, values)
    priced = priced_settings(found).set_index("fleet")[COST]
    assert priced.to_dict() == {
        "2 UAVs, 6 pads in zone 1 and no zone 2": 2600,
        "2 UAVs, 6 pads in zone 1 and 1 pad in zone 2": 2700,
    }
    best = search_of(found).best
    assert best.fleet == "2 UAVs, 6 pads in zone 1 and no zone 2" and best.cost == 2600
    assert not found.scenario(best.points[0]).zones


@pytest.mark.parametrize("first", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_the_answer_is_the_cheapest_fleet_of_any_policy(first, tmp_path):
    """The other policy meets the requirement, but with a dearer fleet."""
    policies, values = ["greedy", "nearest"], {"uavs": [1, 3], "pads": [1], "quota": [30]}
    asked = {"collection_ratio": 0.365}
    found = searched_sea(tmp_path, policies[:: 1 - 2 * first], asked, values, tolerance=0.03)
    search = search_of(found)
    fleets = search.selected_fleets().set_index("policy")["setting"].to_dict()
    one, three = (f"{uavs}, 1 pad in zone 1 and 1 pad in zone 2" for uavs in ("1 UAV", "3 UAVs"))
    # Or this test says little.
    assert fleets == {"greedy": one, "nearest": three}
    told = {fact.label: fact for fact in search.facts()}
    assert told["policy"].found == "greedy"
    assert told["with nearest"].found.startswith(f"{three}, 3,200 EUR; ")
    # Success was not required, and is told.
    assert told["success"].found and not told["success"].required
    assert search.best.fleet == one
    # One UAV is the least of all.
    assert "a cheaper one may lie beyond" not in told


def test_the_lead_figure_is_of_the_condition_that_decides(monkeypatch):
    """The same fleet is needed under both; chance has made it more expensive where it has room."""
    rows = pd.DataFrame(
        {
            "policy": "greedy",
            "condition": ["calm", "calm", "storm", "storm"],
            "fleet": ["1 UAV", "2 UAVs"] * 2,
            "point": range(4),
            RATIO: [0.70, 0.95, 0.60, 0.82],
            COST: [1000.4, 2000.5, 1000.2, 2000.1],
        }
    )
    monkeypatch.setattr(cheapest, "judge_settings", lambda _: rows)
    ratio = Requirement(metric_of(RATIO), 0.8)
    monkeypatch.setattr(cheapest, "requirements_of", lambda _: [ratio])
    search = cheapest.FleetSearch(SimpleNamespace())
    search.__dict__["best"] = SimpleNamespace(policy="greedy", points=(1, 3))
    assert search.deciding_requirement() == (ratio, "storm")


def test_an_answer_says_what_would_have_settled_it(studied, tmp_path):
    ratio = studied(missions=400, policies=["random"])
    near = round(float(ratio.missions["collection_ratio"].mean()), 3)
    values = {"uavs": [[1, 3]], "pads": [1]}
    short = {"tolerance": 0.02, "budget": 40}
    found = searched_sea(tmp_path, ["random"], {"collection_ratio": near}, values, **short)
    search = search_of(found)
    assert search.headline() == "No fleet is known to meet the requirements."
    enough = found.cheapest("random").enough
    assert 40 < enough < 40 * 64
    undecided = found_of(search.facts())["undecided"]
    fleet = "1–3 UAVs, 1 pad in zone 1 and 1 pad in zone 2"
    assert undecided == f"{fleet}; about {float(f'{enough:.2g}'):,.0f} missions would settle it"
