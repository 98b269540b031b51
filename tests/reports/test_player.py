"""The player shows the state of a mission after every slot, in a page that requests nothing."""

import json
import re
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pytest
from playwright.sync_api import expect

import dess
from dess import InputError, policies, reports
from dess.analysis.figures.style import node_colours
from dess.analysis.results.event_log import (
    ages_of_nodes,
    battery_levels,
    mean_age,
    mission_length,
    residual_data,
    uav_slots,
)
from dess.model.state import sample_scenario
from dess.reports.pages.parts import Part
from dess.reports.player import AGE_READING, Shown, explain_player, make_player, player_script

# One UAV; three in a queue for one pad, of which one has its battery depleted long before the
# others end; quotas that are filled at once; nothing to serve, in a mission that is truncated.
CASES: dict[str, dict[str, Any]] = {
    "alone": {"uavs": 1},
    "queue": {"uavs": 3, "pads": 1, "zone": [26, 2, 4, 1], "charging": {"plan_waits": False}},
    "short": {"uavs": 2, "quota": 4},
    "empty": {"uavs": 2, "initial_data": 0, "arrival_rate": 0, "max_slots": 9},
}


STYLE = Path(reports.__file__).parent / "templates" / "style.css"
BOXES = """[...document.querySelectorAll("#first :is(button, select, input)")].map(
    (element) => element.getBoundingClientRect().toJSON()
)"""


class Logged(NamedTuple):
    log: pd.DataFrame
    scenario: dess.Scenario


def simulated(**fields: Any) -> Logged:
    """A mission of the ``fig4`` scenario."""
    space = dess.load_scenario("fig4", **fields)
    record = dess.simulate(space, policies.load("greedy"), 1, 0, events=True)
    return Logged(pd.DataFrame(record.events.columns()), sample_scenario(space, 1, 0))


@pytest.fixture(scope="module", params=CASES)
def mission(request):
    return simulated(**CASES[request.param])


@pytest.fixture(scope="module")
def queue():
    return simulated(**CASES["queue"])


@pytest.fixture(scope="module")
def shown(mission):
    """What a player gets to show."""
    return data_in(played(mission, "shown").data)


def data_in(html: str) -> dict[str, Any]:
    """The data of the first mission in the HTML of a player."""
    return json.JSONDecoder().raw_decode(html, html.index("{", html.index("playMission(")))[0]


def played(mission: Logged, name: str, title: str = "", caption: str = "") -> Part:
    """A player of one mission."""
    return make_player([Shown(*mission, title)], name, caption)


def test_discs_are_the_residual_data(mission, shown):
    assert np.allclose(shown["residual"], residual_data(mission.log), atol=0.0051, rtol=0)
    assert shown["nodes"] == [[*node] for node in mission.scenario.nodes]
    assert shown["colours"]["nodes"] == node_colours(len(mission.scenario.nodes))


def test_uavs_are_in_their_state_until_their_mission_ends(mission, shown):
    slots, fleet = uav_slots(mission.log), shown["fleet"]
    for row in slots.itertuples():
        before, after = ({n: fleet[n][t][row.uav] for n in fleet} for t in (row.slot, row.slot + 1))
        assert (before["x"], before["y"]) == (row.from_x, row.from_y)
        for name in ("x", "y", "node", "charging", "waiting"):
            assert after[name] == getattr(row, name)
        assert not before["over"]
    for row in battery_levels(mission.log).itertuples():
        assert fleet["battery"][row.time][row.uav] == row.battery
    for uav, active in slots.groupby("uav"):
        over = [row[uav] for row in fleet["over"]]
        assert over == [time > active["slot"].max() for time in range(len(over))]
    filled = mission.log.loc[mission.log["event"] == "quota_filled", "uav"]
    assert np.flatnonzero(shown["filled"]).tolist() == sorted(filled)


def test_the_status_says_what_is_left_and_who_charges_and_waits(queue):
    told = data_in(played(queue, "one").data)["status"]
    log, slots = queue.log, uav_slots(queue.log)
    assert len(told) == mission_length(log) + 1
    time = slots.loc[slots["waiting"], "slot"].iloc[0] + 1
    now, left = slots[slots["slot"] == time - 1], residual_data(log).iloc[time].sum()
    assert told[time] == (
        f"slot {time} of {mission_length(log)} · {left:.1f} data units left · "
        f"{now['charging'].sum()} of 1 pad in use, {now['waiting'].sum()} waiting"
    )


AGED: dict[str, dict[str, Any]] = {
    "slotted": {"uavs": 2, "age.measured": True},
    "packets": {"uavs": 2, "age.measured": True, "arrivals.process": "continuous"},
    "unmeasured": {"uavs": 2},
}


@pytest.mark.parametrize("case", AGED)
def test_ages_are_shown_where_the_scenario_measures_them(case):
    log, scenario = simulated(**AGED[case])
    shown = data_in(played(Logged(log, scenario), "aged").data)
    assert (AGE_READING in explain_player(scenario)) == scenario.age.measured
    if not scenario.age.measured:
        assert shown["ages"] is shown["meanAge"] is None
        return
    assert np.allclose(shown["ages"], ages_of_nodes(log), atol=0.0051, rtol=0)
    assert np.allclose(shown["meanAge"], mean_age(log), atol=0.0051, rtol=0)


def test_words_are_shown_as_they_are_and_nothing_outside_is_asked_for(queue):
    html = played(queue, "one", "<b>I & U</b>", "1 < 2").data
    assert "&lt;b&gt;I &amp; U&lt;/b&gt;" in html and "1 &lt; 2" in html
    assert not re.search(r"https?:|//\w|\b(src|href)=|url\(|@import|\bimport\b", html)


def test_a_log_of_another_scenario_is_refused(queue):
    for fields, what in (({"uavs": 2}, "uav"), ({"nodes": ((1, 1),)}, "node")):
        other = queue.scenario.model_copy(update=fields)
        with pytest.raises(InputError, match=f"mission_start has .* rows of a {what}"):
            played(Logged(queue.log, other), "one")
    log = queue.log[queue.log["event"] != "mission_end"]
    with pytest.raises(InputError, match="events: mission_end has 0 rows of a uav"):
        played(Logged(log, queue.scenario), "one")


def test_a_player_jumps_to_what_happens(mission, shown):
    """To the slot that shows it: the first of a charge, and the last of a UAV's mission."""
    slots, jumps = uav_slots(mission.log), dict(shown["events"])
    assert [*jumps] == sorted(jumps)
    for uav, of_uav in slots.groupby("uav"):
        charging = of_uav["charging"] & ~of_uav["charging"].shift(fill_value=False)
        for slot in of_uav["slot"][charging]:
            assert f"UAV {uav + 1} starts to charge" in jumps[slot + 1]
        if shown["filled"][uav]:
            assert f"UAV {uav + 1} has filled its quota" in jumps[of_uav["slot"].max() + 1]


def test_the_map_of_a_whole_mission_has_the_path_of_every_uav(mission):
    html = played(mission, "one").data
    paths = re.findall('<polyline points="(.*?) "', html)
    slots = uav_slots(mission.log)
    assert len(paths) == mission.scenario.uavs
    for uav, path in enumerate(paths):
        corners = [tuple(map(int, corner.split(","))) for corner in path.split(" ")]
        cells = slots[slots["uav"] == uav]
        assert corners[0] == (cells["from_x"].iloc[0], cells["from_y"].iloc[0])
        assert corners[-1] == (cells["x"].iloc[-1], cells["y"].iloc[-1])
        length = sum(abs(a - c) + abs(b - d) for (a, b), (c, d) in pairwise(corners))
        assert length == cells["moved"].sum()


# In a browser


def texts_of(mission: Logged) -> list[str]:
    """The status in every slot, with what happens there."""
    data = data_in(played(mission, "one").data)
    happens = dict(data["events"])
    return [" · ".join([status, *([happens[slot]] if slot in happens else [])])
            for slot, status in enumerate(data["status"])]  # fmt: skip


@pytest.fixture(scope="module")
def document(queue, tmp_path_factory):
    """A page with two players, of which the first offers two missions."""
    alone = simulated(**CASES["alone"])
    both = [Shown(*queue, "I = 3", "queue"), Shown(*alone, "I = 1", "alone")]
    parts = [player_script(), make_player(both, "first"), played(alone, "second", "I = 1")]
    path = tmp_path_factory.mktemp("page") / "page.html"
    head = '<!DOCTYPE html><meta charset="utf-8">'
    head += '<meta name="viewport" content="width=device-width">'
    head += f"<style>{STYLE.read_text('utf-8')}</style>"
    path.write_text(head + "".join(part.data for part in parts), "utf-8")
    return path


def test_a_mission_is_played_and_paused(visit, document, queue):
    opened, told = visit(document, 390), texts_of(queue)
    page = opened.page
    parts = ("output", "[data-go=play]", "canvas")
    status, button, canvas = (page.locator(f"#first {part}") for part in parts)
    expect(status).to_have_text(told[0])
    button.click()
    expect(button).to_have_text("Pause")
    page.wait_for_function("Number(document.querySelector('#first input').value) >= 3")
    button.click()
    paused = int(page.locator("#first input").input_value())
    page.wait_for_timeout(500)  # three slots, were it playing
    expect(status).to_have_text(told[paused])
    assert page.locator("#second input").input_value() == "0"

    canvas.focus()
    for key, slot in (("End", len(told) - 1), ("ArrowLeft", len(told) - 2), ("Home", 0)):
        page.keyboard.press(key)
        expect(status).to_have_text(told[slot])
    page.locator("#first input").fill("7")
    expect(status).to_have_text(told[7])
    page.evaluate("location.hash = 'slot=9'")
    expect(status).to_have_text(told[9])
    page.keyboard.press("Space")
    expect(button).to_have_text("Pause")
    page.keyboard.press("Space")

    jumps = [slot for slot, text in enumerate(told) if text.count(" · ") == 3]
    page.keyboard.press("Home")
    for slot in jumps[:2]:
        page.locator("#first [data-go=event-on]").click()
        expect(status).to_have_text(told[slot])
    page.locator("#first [data-go=event-back]").click()
    expect(status).to_have_text(told[jumps[0]])
    page.locator("#first [data-go=slot-on]").click()
    expect(status).to_have_text(told[jumps[0] + 1])
    page.locator("#first [data-go=slot-back]").click()
    page.locator("#first [name=about]").select_option("UAV 2")
    expect(status).to_contain_text("UAV 2: battery ")
    page.locator("#first [name=mission]").select_option("alone")
    expect(page.locator("#first .subject")).to_have_text("I = 1")
    expect(status).to_contain_text(f"slot {jumps[0]} of ")

    assert opened.complaints == []
    assert opened.requests == [document.as_uri()]
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_a_click_on_a_curve_goes_to_its_slot_and_the_pointer_reads_the_map(visit, document, queue):
    opened = visit(document, 1200)
    canvas = opened.page.locator("#first canvas")
    box = canvas.bounding_box()
    assert box is not None
    # The end of the batteries.
    canvas.click(position={"x": box["width"] - 45, "y": 60})
    expect(opened.page.locator("#first output")).to_contain_text(
        f"slot {mission_length(queue.log)} of"
    )
    titles = []
    for x in range(60, 400, 12):
        opened.page.mouse.move(box["x"] + x, box["y"] + x)
        titles.append(canvas.get_attribute("title") or "")
    assert any(re.fullmatch(r"node \d+: [\d.]+ data units", title) for title in titles)


@pytest.mark.parametrize(("width", "least"), [(1200, 32), (390, 44)])
def test_what_is_pressed_is_large_enough(chromium, document, width, least):
    """For a finger on a phone, and for a mouse."""
    page = chromium.new_page(
        viewport={"width": width, "height": 900}, is_mobile=width < 600, has_touch=width < 600
    )
    page.goto(document.as_uri())
    for box in page.evaluate(BOXES):
        assert box["height"] >= least and box["width"] >= least
    page.close()


def test_without_scripts_and_on_paper_a_map_shows_the_mission(chromium, document, visit):
    page = chromium.new_page(java_script_enabled=False)
    page.goto(document.as_uri())
    expect(page.locator("#first .still")).to_be_visible()
    expect(page.locator("#first .played")).to_be_hidden()
    page.close()
    live = visit(document, 1200).page
    expect(live.locator("#first .still")).to_be_hidden()
    live.emulate_media(media="print")
    expect(live.locator("#first .still")).to_be_visible()
    expect(live.locator("#first .played")).to_be_hidden()
