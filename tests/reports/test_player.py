"""The player shows the state of a mission after every slot, in a page that requests nothing."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pytest
from playwright.sync_api import Locator, Page, expect
from plotly import graph_objects

import dess
import policies
from analysis.figures.style import node_colours
from analysis.results.event_log import (
    ages,
    battery_levels,
    duration,
    mean_age,
    residual_data,
    uav_slots,
)
from dess import InputError
from dess.state import sample_scenario
from reports.player import AGE_READING, library, player, reading
from reports.player.scene import TRAIL
from tests.reports.browser import Visit

# One UAV; three in a queue for one pad, of which one has its battery depleted long before the
# others end; quotas that are filled at once; nothing to serve, in a mission that is truncated.
CASES: dict[str, dict[str, Any]] = {
    "alone": {"uavs": 1},
    "queue": {"uavs": 3, "pads": 1, "zone": [26, 2, 4, 1], "charging": {"plan_waits": False}},
    "short": {"uavs": 2, "quota": 4},
    "empty": {"uavs": 2, "initial_data": 0, "arrival_rate": 0, "max_slots": 9},
}


class Logged(NamedTuple):
    log: pd.DataFrame
    scenario: dess.Scenario


def simulated(**fields: Any) -> Logged:
    """A mission of the ``fig4`` scenario."""
    space = dess.load_scenario("fig4", **fields)
    record = dess.simulate(space, policies.load("greedy"), 1, 0, events=True)
    return Logged(pd.DataFrame(record.events.columns()), sample_scenario(space, 1, 0))


@pytest.fixture(scope="module", params=CASES)
def mission(request: pytest.FixtureRequest) -> Logged:
    return simulated(**CASES[request.param])


@pytest.fixture(scope="module")
def queue() -> Logged:
    return simulated(**CASES["queue"])


def figure(html: str) -> dict[str, Any]:
    """The traces, the layout and the frames in the HTML of a player."""
    read = json.JSONDecoder().raw_decode
    parts = {}
    for call, names in (("newPlot", ("name", "data", "layout")), ("addFrames", ("", "frames"))):
        at = html.index(f"Plotly.{call}(") + len(f"Plotly.{call}(")
        for name in names:
            at += len(html[at:]) - len(html[at:].lstrip(" ,\n"))
            if name:
                parts[name], at = read(html, at)
            else:
                at = html.index(",", at) + 1
    return parts


class Shown:
    """What a player shows: ``shown[t][name]`` is a trace of the frame of slot t."""

    def __init__(self, mission: Logged):
        self.figure = figure(player(*mission, "shown").data)
        self.traces = self.figure["data"]

    def __len__(self) -> int:
        return len(self.figure["frames"])

    def __getitem__(self, time: int) -> dict[str, Any]:
        frame = self.figure["frames"][time]
        assert frame["name"] == str(time)
        changes = zip(frame["traces"], frame["data"], strict=True)
        return {self.traces[n]["name"]: change for n, change in changes}


@pytest.fixture(scope="module")
def shown(mission: Logged) -> Shown:
    return Shown(mission)


def test_there_is_a_frame_and_a_step_of_the_slider_per_slot(mission: Logged, shown: Shown) -> None:
    (slider,) = shown.figure["layout"]["sliders"]
    times = [str(t) for t in range(duration(mission.log) + 1)]
    assert [frame["name"] for frame in shown.figure["frames"]] == times
    assert [step["args"][0] for step in slider["steps"]] == [[t] for t in times]
    assert [step["label"] for step in slider["steps"]] == times


def holds(trace: dict[str, Any], change: dict[str, Any]) -> bool:
    """Whether a trace has all values of a frame's change."""
    return all(
        holds(trace[key], value) if isinstance(value, dict) else trace[key] == value
        for key, value in change.items()
    )


def test_the_page_opens_at_the_start(shown: Shown) -> None:
    traces = {trace["name"]: trace for trace in shown.traces}
    assert len(traces) == len(shown.traces)
    assert all(holds(traces[name], change) for name, change in shown[0].items())


def test_discs_are_the_residual_data(mission: Logged, shown: Shown) -> None:
    residual = residual_data(mission.log)
    for time, row in enumerate(residual.to_numpy()):
        assert np.allclose(shown[time]["nodes"]["marker"]["size"], row, atol=0.0051, rtol=0)
    (rings,) = (trace for trace in shown.traces if trace["name"] == "rings")
    assert np.allclose(rings["marker"]["size"], residual.max(), atol=0.0051, rtol=0)
    (nodes,) = (trace for trace in shown.traces if trace["name"] == "nodes")
    assert list(zip(nodes["x"], nodes["y"], strict=True)) == list(mission.scenario.nodes)
    assert nodes["marker"]["color"] == node_colours(len(mission.scenario.nodes))


def test_uavs_are_where_they_are_until_their_mission_ends(mission: Logged, shown: Shown) -> None:
    slots = uav_slots(mission.log)
    for row in slots.itertuples():
        before, after = shown[row.slot]["UAVs"], shown[row.slot + 1]["UAVs"]
        assert (before["x"][row.uav], before["y"][row.uav]) == (row.from_x, row.from_y)
        assert (after["x"][row.uav], after["y"][row.uav]) == (row.x, row.y)
        assert before["marker"]["opacity"][row.uav] == 1
    for uav, active in slots.groupby("uav"):
        for time in range(active["slot"].max() + 1, len(shown)):
            dots = shown[time]["UAVs"]
            assert dots["marker"]["opacity"][uav] < 1
            assert (dots["x"][uav], dots["y"][uav]) == (active["x"].iloc[-1], active["y"].iloc[-1])


def test_links_lead_from_each_uav_to_the_node_that_it_serves(mission: Logged, shown: Shown) -> None:
    nodes, colours = mission.scenario.nodes, node_colours(len(mission.scenario.nodes))
    slots = uav_slots(mission.log).set_index(["slot", "uav"])
    for time in range(len(shown)):
        for uav in range(mission.scenario.uavs):
            link, dots = shown[time][f"link {uav + 1}"], shown[time]["UAVs"]
            start, end = zip(link["x"], link["y"], strict=True)
            assert start == (dots["x"][uav], dots["y"][uav])
            node = slots["node"].get((time - 1, uav), -1)
            assert end == (nodes[node] if node >= 0 else start)
            assert node < 0 or link["line"]["color"] == colours[node]


def test_trails_are_the_last_moves(mission: Logged, shown: Shown) -> None:
    for uav in range(mission.scenario.uavs):
        way = [shown[time]["UAVs"] for time in range(len(shown))]
        for time in range(len(shown)):
            past = [way[max(time - n, 0)] for n in range(TRAIL + 1)]
            trail = shown[time][f"trail {uav + 1}"]
            assert trail["x"] == [dots["x"][uav] for dots in past]
            assert trail["y"] == [dots["y"][uav] for dots in past]


def test_batteries_stand_on_the_curves_and_at_the_uavs(mission: Logged, shown: Shown) -> None:
    for row in battery_levels(mission.log).itertuples():
        assert shown[row.time]["batteries"]["y"][row.uav] == row.battery
        assert shown[row.time]["UAVs"]["customdata"][row.uav] == row.battery
    for time in range(len(shown)):
        assert set(shown[time]["batteries"]["x"]) == {time}
        assert all(shown[time][f"cursor {panel}"]["x"] == [time, time] for panel in (2, 3, 4))


def test_squares_and_the_status_show_who_charges_and_who_waits(
    mission: Logged, shown: Shown
) -> None:
    slots = uav_slots(mission.log)
    left = residual_data(mission.log).sum(axis=1)
    for time in range(len(shown)):
        now = slots[slots["slot"] == time - 1]
        (status,) = shown[time]["status"]["text"]
        match = re.fullmatch(
            r"(\d+\.\d) data units left · (\d+) of (\d+) pads? in use(?:, (\d+) waiting)?", status
        )
        assert match
        assert abs(float(match[1]) - left[time]) <= 0.051
        assert int(match[2]) == now["charging"].sum()
        assert int(match[3]) == (mission.scenario.pads or mission.scenario.zone_cells)
        assert int(match[4] or 0) == now["waiting"].sum()
        for state in ("charging", "waiting"):
            seen = np.flatnonzero(shown[time][state]["marker"]["opacity"])
            assert seen.tolist() == now.loc[now[state], "uav"].tolist()
            assert shown[time][state]["x"] == shown[time]["UAVs"]["x"]


def test_bars_are_the_slots_of_charging_and_waiting(mission: Logged, shown: Shown) -> None:
    slots = uav_slots(mission.log)
    for state in ("charging", "waiting"):
        for uav, of_uav in slots.groupby("uav"):
            (bars,) = (t for t in shown.traces if t["name"] == f"{state} {uav + 1}")
            edges = zip(bars["x"][0::6], bars["x"][1::6], strict=True)
            busy = of_uav.loc[of_uav[state], "slot"]
            assert [slot for a, b in edges for slot in range(a, b)] == busy.tolist()


AGED: dict[str, dict[str, Any]] = {
    "slotted": {"uavs": 2, "age.measured": True},
    "packets": {"uavs": 2, "age.measured": True, "arrivals.process": "continuous"},
}


@pytest.mark.parametrize("case", AGED)
def test_ages_are_shown_where_the_scenario_measures_them(case: str) -> None:
    log, scenario = simulated(**AGED[case])
    shown, of_nodes, curve = Shown(Logged(log, scenario)), ages(log), mean_age(log)
    for time in range(len(shown)):
        heights = shown[time]["ages"]["y"]
        assert np.allclose(heights, of_nodes.loc[time], atol=0.0051, rtol=0)
        assert shown[time]["stems"]["y"] == [y for height in heights for y in (0, height, None)]
        assert shown[time]["cursor 6"]["x"] == [time, time]
    (tooth,) = (trace for trace in shown.traces if trace["name"] == "mean age")
    assert np.allclose(tooth["x"], curve["time"], atol=0.0051, rtol=0)
    assert np.allclose(tooth["y"], curve["age"], atol=0.0051, rtol=0)
    assert AGE_READING in reading(scenario)


def test_without_measured_ages_nothing_tells_of_them(mission: Logged, shown: Shown) -> None:
    assert AGE_READING not in reading(mission.scenario)
    assert not {"ages", "stems", "mean age"} & {trace["name"] for trace in shown.traces}
    assert not {"xaxis6", "xaxis7"} & shown.figure["layout"].keys()


def test_the_cases_cover_waiting_charging_and_short_missions(queue: Logged) -> None:
    slots = uav_slots(queue.log)
    ends = slots.groupby("uav")["slot"].max()
    assert slots["waiting"].any() and slots["charging"].any() and ends.nunique() > 1
    notes = {note["text"] for note in Shown(queue).figure["layout"]["annotations"]}
    assert {"✓", "✕"} <= notes
    assert duration(simulated(**CASES["short"]).log) < TRAIL


def test_plotly_knows_every_attribute(mission: Logged, shown: Shown) -> None:
    parts = {name: shown.figure[name] for name in ("data", "frames", "layout")}
    assert len(graph_objects.Figure(parts).frames) == len(shown)


def test_the_same_log_gives_the_same_bytes(mission: Logged) -> None:
    columns = {name: mission.log[name].to_numpy() for name in mission.log}
    again = player(columns, mission.scenario, "one", "title", "caption").data
    assert player(*mission, "one", "title", "caption").data == again
    assert library().data == library().data


def test_words_are_shown_as_they_are_and_nothing_outside_is_asked_for(queue: Logged) -> None:
    html = player(*queue, "one", "<b>I & U</b>", "1 < 2").data
    assert "&lt;b&gt;I &amp; U&lt;/b&gt;" in html and "1 &lt; 2" in html
    assert not re.search(r"https?:|//\w|\b(src|href)=|url\(|@import|\bimport\b", html)


def test_a_log_of_another_scenario_is_refused(queue: Logged) -> None:
    for fields, what in (({"uavs": 2}, "uav"), ({"nodes": ((1, 1),)}, "node")):
        other = queue.scenario.model_copy(update=fields)
        with pytest.raises(InputError, match=f"mission_start has .* rows of a {what}; allowed"):
            player(queue.log, other, "one")
    log = queue.log[queue.log["event"] != "mission_end"]
    with pytest.raises(InputError, match="events: mission_end has 0 rows of a uav; allowed: one"):
        player(log, queue.scenario, "one")


# In a browser


@pytest.fixture(scope="module")
def document(queue: Logged, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page with two players."""
    alone = simulated(**CASES["alone"])
    parts = [library(), player(*queue, "first", "I = 3"), player(*alone, "second", "I = 1")]
    path = tmp_path_factory.mktemp("page") / "page.html"
    head = (
        '<!DOCTYPE html><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
    )
    path.write_text(head + "".join(part.data for part in parts), "utf-8")
    return path


def button(page: Page, name: str, label: str) -> Locator:
    """A button of a player."""
    return page.locator(f"#{name} .updatemenu-button").filter(has_text=label)


def slot(name: str) -> str:
    """The JavaScript that reads which slot a player shows."""
    return f"Number(document.querySelector('#{name} .slider-label').textContent.split(' ')[1])"


def test_a_mission_is_played_and_paused(
    visit: Callable[[Path, int], Visit], document: Path, queue: Logged
) -> None:
    opened, end = visit(document, 390), duration(queue.log)
    page, status = opened.page, opened.page.locator("#first .x5y5 .textpoint")
    button(page, "second", "Play").wait_for()
    page.wait_for_function("document.getElementById('second').style.height.endsWith('px')")
    assert page.evaluate(slot("first")) == 0

    button(page, "first", "Play").click()
    page.wait_for_function(f"{slot('first')} >= 3")
    button(page, "first", "Pause").click()
    paused = page.evaluate(slot("first"))
    page.wait_for_timeout(1000)  # three slots, were it playing
    assert 3 <= page.evaluate(slot("first")) == paused < end
    assert status.text_content() == Shown(queue)[paused]["status"]["text"][0]
    assert page.evaluate(slot("second")) == 0

    button(page, "first", "Play").click()
    page.wait_for_function(f"{slot('first')} > {paused}")
    rail = page.locator("#first .slider-rail-touch-rect")
    box = rail.bounding_box()
    assert box is not None
    rail.click(position={"x": 0.999 * box["width"], "y": box["height"] / 2}, force=True)
    page.wait_for_function(f"{slot('first')} === {end}")
    expect(status).to_have_text(Shown(queue)[end]["status"]["text"][0])
    button(page, "first", "Fast").click()
    page.wait_for_function(f"0 < {slot('first')} && {slot('first')} < {end}")

    assert opened.complaints == []
    assert opened.requests == [document.as_uri()]
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_the_curves_stand_beside_the_map_where_there_is_room(
    visit: Callable[[Path, int], Visit], document: Path
) -> None:
    def left(axes: str) -> str:
        plot = f"document.querySelector('#first .subplot.{axes} .gridlayer, #first .{axes}')"
        return f"{plot}.getBoundingClientRect().left"

    beside = f"{left('x2y2')} > 400"
    opened = visit(document, 390)
    button(opened.page, "second", "Play").wait_for()
    assert not opened.page.evaluate(beside)
    opened.resize(1200)
    opened.page.wait_for_function(beside)
    opened.resize(390)
    opened.page.wait_for_function(f"!({beside})")
