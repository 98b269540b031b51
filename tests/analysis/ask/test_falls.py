"""Where one more UAV collects less, an answer says what the UAVs do with their time."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pandas as pd
import pytest

from dess.analysis import load_results, numbers, sweep, what_if
from dess.analysis.answers.settings.points import values_of_points
from dess.analysis.ask import around, falls
from dess.analysis.ask.question import sweep_question
from dess.analysis.flights.phases import (
    CHARGES,
    FLIES,
    KEPT,
    SERVES,
    STANDS,
    WAITS,
    share_of_activities,
)
from dess.analysis.names import field_named
from dess.analysis.results.resimulate import resimulate
from dess.model.events import EventLog
from dess.reports.pages.study import make_study_report
from dess.scenario.quantities import printed
from tests.analysis.flights.hand import scenario_of, write_sea
from tests.analysis.small import SHEET, found_of, write_scenario
from tests.reports.small import said_by

# A sea with a single pad, short flights, and more data than two UAVs can collect.
BUSY = {
    **SHEET,
    "nodes": [[1, 1], [2, 6], [5, 4], [6, 7], [0, 4], [3, 3]],
    "pads": 1,
    "data_sheet": {**SHEET["data_sheet"], "endurance": "20 min", "data_rate": "12 MB/h"},
}

DRAWN = "What a UAV does with its time in the fleet of the answer and with 3 UAVs and 2 pads"


def test_the_shares_of_a_small_mission_are_those_by_hand(tmp_path):
    """Two UAVs in six slots, of which the second one lands after three."""
    scenario = scenario_of(write_sea(tmp_path), uavs=2, communication_slots=4)
    log = EventLog()
    for uav, x in enumerate((1, 0)):
        log.add(0.0, "mission_start", uav, -1, 90, x, 0)
    # It flies for a slot and serves a node in half of it, hovers and serves, is kept from a cell
    # by the other UAV, flies back to the zone, waits for a pad there, and charges.
    cells = [(2, 0), (2, 0), (2, 0), (1, 0), (1, 0), (1, 0)]
    for slot, (x, y) in enumerate(cells):
        log.add(float(slot), "move", 0, -1, 89 - slot, x, y)
    for time in (0.75, 1.0, 1.25, 1.5, 1.75, 2.0):
        log.add(time, "communication", 0, 0, 1.0)
    log.add(2.0, "collision", 0, -1, 3, 2, 0, other=1)
    log.add(4.0, "charge_request", 0, -1, 85, 1, 0)
    log.add(5.0, "charge_start", 0, -1, 85, 1, 0)
    log.add(6.0, "charge_end", 0, -1, 90, 1, 0)
    # It stands. That the edge of the grid stops it does not count: no other UAV keeps it.
    for slot in range(3):
        log.add(float(slot), "move", 1, -1, 90, 0, 0)
    log.add(2.0, "collision", 1, -1, 0, 0, 0, other=-1)
    log.add(3.0, "landing", 1, -1, 90, 0, 0)
    for uav in range(2):
        log.add(6.0, "mission_end", uav, -1, 90, uav, 0)
    shares = share_of_activities(log.columns(), scenario) * 12
    expected = {SERVES: 1.5, FLIES: 0.5 + 1, KEPT: 1, WAITS: 1, CHARGES: 1, STANDS: 3 + 3}
    assert shares.to_dict() == pytest.approx(expected)


@pytest.fixture(scope="module")
def searched(tmp_path_factory):
    """A fleet of two UAVs, to which one more brings nothing: less is collected."""
    folder = tmp_path_factory.mktemp("falls")
    scenario = write_scenario(folder, **BUSY)
    question = sweep_question(
        {"uavs": (2,)},
        scenario,
        ["greedy"],
        10,
        prices={"uav": 20_000},
        requirements={"success": 0.6},
        folder=folder,
    )
    found = question.ask()
    around.question_around(found, str(scenario), 30).ask()
    return found


def test_an_answer_says_why_one_more_uav_collects_less(searched):
    changed_results = around.load_around(searched)
    ratios = changed_results.missions.groupby("point")["collection_ratio"].mean()
    assert ratios[1] < ratios[0]
    (fall,) = [fall for fall in falls.find_falls(searched) if fall.fleet == "3 UAVs"]
    for shares in (fall.shares, fall.shares_before):
        assert len(shares) == falls.MISSIONS
        np.testing.assert_allclose(shares.sum(axis=1), 1)
    # The third one does not collect what it costs the others.
    before = fall.shares_before[SERVES].mean()
    assert fall.shares[SERVES].mean() < before
    found = found_of(fall.facts())
    where = "3 UAVs instead of 2 UAVs"
    assert found[f"{where}, with greedy"].startswith("collection ratio −")
    share = numbers.format_percent(fall.shares[SERVES].mean())
    share_before = numbers.format_percent(before)
    assert f"{SERVES} {share}, not {share_before}" in found[f"{where}: time of a UAV"]
    missions = changed_results.missions
    before, now = (
        np.mean([*missions.loc[missions["point"] == point, "node_ratios"]], axis=0)
        for point in (0, 1)
    )
    node = np.argmin(now - before)
    x, y = BUSY["nodes"][node]
    share, share_before = (numbers.format_percent(each[node]) for each in (now, before))
    change = numbers.format_difference(now[node], before[node])
    text = f"[{x}, {y}], {share} of its data, not {share_before} ({change} ["
    assert found[f"{where}: node that loses most"].startswith(text)
    assert "not the fleet" in found[f"{where}: cause"]
    (drawing,) = falls.draw_falls(searched)
    assert DRAWN in drawing.caption
    bars = drawing.figure.axes[0].patches
    assert sum(bar.get_width() for bar in bars) == pytest.approx(3)  # of the fleet, UAV and pad


def test_a_fall_says_when_the_last_data_are_collected(searched):
    """Where that is earlier than with the fleet: the shares of time need not differ."""
    fall = falls.find_falls(searched)[0]
    last = fall.last_data_before
    log = resimulate(around.load_around(searched), "greedy", 0, 0).events
    served = pd.DataFrame(log).query("event == 'communication'")
    assert last[0] == served["time"].max()
    same = replace(fall, shares=fall.shares_before, last_data=last)
    label = f"{same.fleet} instead of {same.before}: last data"
    assert label not in found_of(same.facts())
    earlier = replace(same, last_data=last - 20 - np.arange(len(last)))
    found = found_of(earlier.facts())
    assert not [each for each in found if each.endswith("time of a UAV")]
    slot = fall.units.slot
    means = [printed(slots.mean() * slot, "s") for slots in (earlier.last_data, last)]
    assert found[label] == f"after {means[0]}, not {means[1]}"


def test_a_node_is_named_only_if_the_missions_show_that_it_loses(searched):
    fall = falls.find_falls(searched)[0]
    noise = np.random.default_rng(5).normal(0, 0.1, fall.nodes.shape)
    assert "loses most" not in str(replace(fall, nodes=fall.nodes_before + noise).facts())


@pytest.mark.slow
@pytest.mark.brief
def test_the_page_says_and_draws_why_one_more_uav_collects_less(searched):
    folder = str(searched.store.folder)
    said = said_by(make_study_report(load_results(folder)), results=folder)
    for text in (DRAWN, *found_of(falls.fall_facts(searched)).values()):
        assert text in said


def test_nothing_is_said_where_no_neighbour_collects_less(searched, monkeypatch):
    """The same missions, with those of one more UAV that collect a little more."""
    changed_results = around.load_around(searched)
    missions = changed_results.missions.copy()
    is_fleet = missions["point"] == 0
    of_fleet = missions.loc[is_fleet, "collection_ratio"].to_numpy()
    for point in missions.loc[~is_fleet, "point"].unique():
        missions.loc[missions["point"] == point, "collection_ratio"] = of_fleet + 0.001
    better = replace(changed_results, missions=missions)
    monkeypatch.setattr(around, "load_around", lambda _: better)
    again = load_results(searched.store.folder)
    assert falls.fall_facts(again) == []
    assert falls.draw_falls(again) == []


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """The busy sea with one UAV to three, which ``greedy`` flies worse the more there are."""
    folder = tmp_path_factory.mktemp("swept")
    values = {"uavs": [1, 2, 3], "data_sheet.data_rate": ["9 MB/h", "12 MB/h"]}
    scenario = write_scenario(folder, **BUSY)
    return sweep(scenario, ["greedy"], 30, folder=folder, **values)


def test_a_sweep_says_where_more_uavs_collect_less(swept):
    """Of the pairs of next fleets the largest fall, of whose cause a search says the same."""
    missions = swept.results.missions
    ratios = missions.groupby("point")["collection_ratio"].mean()
    table = values_of_points(swept.results)
    worst = min(
        (ratios[more] - ratios[fewer], fewer, more)
        for fewer, more in permutations(table.index, 2)
        if table["data_sheet.data_rate"][fewer] == table["data_sheet.data_rate"][more]
        and table["uavs"][more] == table["uavs"][fewer] + 1
    )
    assert worst[0] < -falls.LITTLE
    (fall,) = falls.find_setting_falls(swept.results)
    assert fall.difference[["difference", "fewer", "more"]].tolist() == pytest.approx([*worst])
    uavs, rate = table.loc[worst[2], ["uavs", "data_sheet.data_rate"]]
    assert fall.fleet == f"{uavs} UAVs"
    found = found_of(swept.facts())
    assert fall.before.endswith(f"({field_named('data_sheet.data_rate').words(rate)})")
    assert found[f"{fall.where}, with greedy"].startswith("collection ratio −")
    assert "not the fleet" in found[f"{fall.where}: cause"]


def test_a_sweep_says_nothing_of_a_fall_that_chance_explains(swept):
    missions = swept.results.missions
    noise = np.random.default_rng(2).normal(0.5, 0.1, len(missions))
    alike = replace(swept.results, missions=missions.assign(collection_ratio=noise))
    assert falls.setting_fall_facts(alike) == []
    little = 0.5 - 0.002 * missions["point"]
    small = replace(swept.results, missions=missions.assign(collection_ratio=little))
    assert falls.setting_fall_facts(small) == []


def test_a_variation_with_one_more_uav_that_collects_less_says_so(swept, tmp_path):
    scenario = write_scenario(tmp_path, **BUSY)
    falling = falls.find_setting_falls(swept.results)[0]
    more = int(falling.fleet.split()[0])
    asked = {"uavs": more}, {"uavs": more - 1}, scenario, ["greedy"], 30
    found = found_of(what_if(*asked, folder=tmp_path).facts())
    where = f"{falling.fleet} instead of {falling.before.split(' (')[0]}"
    assert "not the fleet" in found[f"{where}: cause"]
