"""Questions on costs: hand-worked tables and sentences, and a study of a small sea."""

import pytest

from dess import InputError
from dess.analysis import run_study
from dess.analysis.answers import costs, summary
from dess.analysis.stats.intervals import level_after, wilson
from dess.analysis.stats.verdict import on_front
from dess.analysis.study.study import CHECK
from tests.analysis.small import small_study

PRICES = {"uav": 1000, "pad": 100, "charge": 2, "hour": 6, "lost_uav": 1000}
PRICES |= {"missions": 5, "slot_seconds": 60}
# The UAVs are cheap, so that a fleet of three may be cheaper than one of two that gets lost.
DESIGN = {"kind": "grid", "values": {"uavs": [1, 2], "pads": [1, 2], "quota": [60, 120]}}
RULE = {
    "procedure": "cheapest",
    "requirements": {"success": 0.8},
    "tolerance": 0.1,
    "indifference": 50,
    "budget": 20_000,
    "check": 6,
}


@pytest.fixture(scope="module")
def fixed(studied):
    """A study of as many missions at every design point."""
    return studied(missions=40, design=DESIGN, costs=PRICES)


@pytest.fixture(scope="module")
def searched(studied):
    """A study that looks for the cheapest setting."""
    return studied(selection=RULE, design=DESIGN, costs=PRICES)


ASKED = (costs.judged, costs.quoted, costs.checks)


@pytest.mark.parametrize("metric", ["success", "collection_ratio"])
def test_each_condition_has_a_front_of_its_own(fixed, metric):
    table = costs.front(fixed, metric)
    for _, rows in table.groupby("condition"):
        expected = on_front(rows["cost"].to_numpy(), rows[metric].to_numpy())
        assert rows["on_front"].tolist() == expected.tolist()
        assert rows["probability"].between(0, 1).all()
        assert rows["probability"].sum() >= 1


def test_a_search_is_kept_told_and_checked(searched):
    manifest, table = searched.store.manifest, costs.judged(searched)
    selections = summary.selections(searched)
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
    assert len(costs.checks(searched)) == len(searched.checks) / 6
    assert searched.choice("greedy") is None
    assert "All conditions together, `greedy`" in "\n".join(costs.answers(searched, table))


def test_an_answer_quotes_the_check_and_a_table_allows_for_the_search(searched):
    found, quoted, checks = map(lambda ask: ask(searched).set_index(["policy", "point"]), ASKED)
    others = found.index.difference(checks.index)
    assert quoted.loc[checks.index, checks.columns].equals(checks)
    assert quoted.loc[others].equals(found.loc[others])
    assert "intervals that allow for the search" in costs.judged_table(searched).caption
    assert "n = 6" in " ".join(costs.sentences(searched))
    for (policy, point), row in found.iterrows():
        missions = searched.missions.query("policy == @policy and point == @point")
        level = float(level_after(searched.looks(policy)[point]))
        assert level > 0.95
        _, *ends = wilson(int(missions["success"].sum()), len(missions), level)
        assert [row["success_low"], row["success_high"]] == pytest.approx(ends)


def test_the_guarantee_is_of_each_policy_and_says_what_it_takes_of_costs(searched):
    guarantee = searched.cheapest("greedy").guarantee
    assert guarantee.startswith("for each policy by itself, with probability at least 0.95")
    assert "takes the differences of costs as nearly normal" in guarantee


def test_bad_questions_get_one_line(fixed, studied):
    free = studied(missions=5)
    for ask in (costs.priced, costs.parts, costs.front, costs.judged):
        with pytest.raises(InputError, match=r"no prices"):
            ask(free)
    with pytest.raises(InputError, match="metric: 'reward' is unknown"):
        costs.front(fixed, "reward")
    with pytest.raises(InputError, match="does not search for the cheapest setting"):
        costs.judged(fixed)


def test_prices_of_zero_leave_what_is_paid_for(studied):
    results = studied(missions=5, costs={"uav": 10.5}, set={"uavs": 2})
    assert set(results.missions["cost"]) == {21.0}
    table = costs.front(results)
    # What has a price is named.
    assert table["fleet"].tolist() == ["2 UAVs"] * 2
    assert table["condition"].tolist() == ["", ""]


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
    found = searched_sea(tmp_path, ["greedy", "random"], {"success": 0.6}, values)
    text = costs.answer(found)
    assert "**2 UAVs, 1 pad and 1 pad in zone 2** for 2,200 EUR" in text
    # Of two policies.
    assert "It has a success of at least 50 %, shown at 95 %." in text
    assert "success of at least 50 %, shown at 97.5 %." in costs.sentences(found)[1]
    assert "Of the values asked for, 2 UAVs is the least; a cheaper one may lie beyond." in text
    assert {*costs.priced(found)["cost"]} == {
        1000 * u + 100 * p for u in (2, 3) for p in (2, 3, 4, 5)
    }
    assert "1 pad and 3 pads in zone 2" in "".join(costs.priced(found)["fleet"])


@pytest.mark.parametrize("first", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_the_answer_is_the_cheapest_fleet_of_any_policy(first, tmp_path):
    """The other policy meets the requirement, but with a dearer fleet."""
    policies, values = ["greedy", "nearest"], {"uavs": [1, 3], "pads": [1], "quota": [30]}
    asked = {"collection_ratio": 0.365}
    found = searched_sea(tmp_path, policies[:: 1 - 2 * first], asked, values, tolerance=0.01)
    fleets = costs.selections(found).set_index("policy")["setting"].to_dict()
    one, three = (f"{uavs}, 1 pad and 1 pad in zone 2" for uavs in ("1 UAV", "3 UAVs"))
    # Or this test says little.
    assert fleets == {"greedy": one, "nearest": three}
    assert costs.answer(found).startswith("`greedy`: the cheapest")
    assert costs.answer(found).endswith(f"With `nearest`, it would be **{three}**.")
    assert costs.sentences(found)[0] == costs.answer(found)
    assert costs.cheapest_fleet(found) == one
    # One UAV is the least of all.
    assert "Of the values" not in costs.answer(found)


def test_an_answer_says_what_would_have_settled_it(studied, tmp_path):
    ratio = studied(missions=400, policies=["random"])
    near = round(float(ratio.missions["collection_ratio"].mean()), 3)
    values = {"uavs": [[1, 3]], "pads": [1]}
    short = {"tolerance": 0.02, "budget": 40}
    found = searched_sea(tmp_path, ["random"], {"collection_ratio": near}, values, **short)
    (text,) = costs.sentences(found)
    enough = found.cheapest("random").enough
    assert 40 < enough < 40 * 64
    assert "The budget of 40 missions ended before this was decided; about" in text
