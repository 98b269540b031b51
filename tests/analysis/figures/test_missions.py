"""What figures show is what happened."""

from collections import Counter
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.quiver import Quiver

import dess
from dess import policies
from dess.analysis.figures import missions
from dess.analysis.figures.style import MUTED, node_colours
from dess.analysis.results.event_log import uav_slots
from dess.model.state import sample_scenario


@pytest.fixture(scope="module")
def mission():
    """A mission with moves, hovering, charging and a queue for the one pad."""
    unplanned = {"plan_waits": False}
    space = dess.load_scenario("fig4", uavs=3, pads=1, zone=[26, 2, 4, 1], charging=unplanned)
    record = dess.simulate(space, policies.load("greedy"), 1, 0, events=True)
    return record, pd.DataFrame(record.events.columns()), sample_scenario(space, 1, 0)


@pytest.fixture(scope="module")
def parts(mission):
    """Map, battery, residual data and occupancy of the mission's figure."""
    _, log, scenario = mission
    return missions.mission_figure(log, scenario).axes


def drawn(ax: Axes, what: str) -> list[Any]:
    """The artists of the map that are marked with a name, in the order of the UAVs."""
    marked = [a for a in ax.collections if (a.get_gid() or "").startswith(what)]
    return sorted(marked, key=lambda artist: artist.get_gid())


def colours(artist: Any) -> list[str]:
    return [to_hex(c) for c in artist.get_facecolor()]


def test_moves_and_crosses_have_the_colour_of_the_node_that_is_served(mission, parts):
    _, log, scenario = mission
    palette = [*node_colours(len(scenario.nodes)), MUTED]
    of_uavs = [slots for _, slots in uav_slots(log).groupby("uav")]
    marks = drawn(parts[0], "moves"), drawn(parts[0], "hovers")
    assert any(len(cross.get_offsets()) for cross in marks[1])
    for slots, arrow, cross in zip(of_uavs, *marks, strict=True):
        moves, hovers = slots[slots["moved"]], slots[~slots["moved"] & ~slots["charging"]]
        assert isinstance(arrow, Quiver)
        assert arrow.N == len(moves) > 0
        assert colours(arrow) == [palette[node] for node in moves["node"]]
        assert np.array_equal(arrow.U, moves["x"] - moves["from_x"])
        assert np.array_equal(arrow.V, moves["y"] - moves["from_y"])
        assert colours(cross) == [palette[node] for node in hovers["node"]]


def test_nodes_zone_and_ends_lie_where_they_are(mission, parts):
    _, log, scenario = mission
    (nodes,) = drawn(parts[0], "nodes")
    assert np.array_equal(nodes.get_offsets(), scenario.nodes)
    assert colours(nodes) == node_colours(len(scenario.nodes))
    x, y, width, height = scenario.zone
    zone = parts[0].patches[0].get_bbox()
    assert (zone.x0, zone.y0, zone.width, zone.height) == (x - 0.5, y - 0.5, width, height)
    half = missions.SPREAD / 2
    for event, name in (("mission_start", "start"), ("mission_end", "end")):
        rows = log[(log["event"] == event) & (log["uav"] >= 0)]
        spots = np.concatenate([mark.get_offsets() for mark in drawn(parts[0], name)])
        assert np.allclose(spots, rows[["x", "y"]], atol=half)
    top, bottom = parts[0].get_ylim()[::-1]
    assert top < bottom  # y grows south


def test_battery_and_residual_data_end_as_recorded(mission, parts):
    record, _, scenario = mission
    lines = {line.get_label(): line for line in parts[1].lines}
    for uav, row in enumerate(record.uav_rows()):
        line = lines[f"UAV {uav + 1}"]
        assert line.get_ydata()[0] == record.flying_time
        assert line.get_ydata()[-1] == row["battery"]
    levels = {line.get_ydata()[0] for line in parts[1].lines if len(set(line.get_ydata())) == 1}
    assert {scenario.charge_start, scenario.charge_complete} <= levels
    (total,) = parts[2].lines
    assert total.get_ydata()[0] == pytest.approx(record.initial)
    assert total.get_ydata()[-1] == pytest.approx(record.residual)
    assert [colours(band)[0] for band in parts[2].collections] == node_colours(len(scenario.nodes))


def test_occupancy_counts_charging_and_waiting_uavs(mission, parts):
    record, log, scenario = mission
    (steps,) = (line for line in parts[3].lines if line.get_gid() == "occupancy")
    waiting = record.uavs["slots_waiting"].sum()
    assert waiting > 0
    assert steps.get_ydata().sum() == record.uavs["slots_charging"].sum() + waiting
    busy = Counter(uav_slots(log).query("charging")["slot"])
    assert max(busy.values()) <= scenario.pads


def test_a_course_is_a_line_per_value_in_the_panel_of_its_rows():
    rows = {"policy": [*"aabb"], "slot": [0, 1] * 2, "panel": [1, 1, 2, 2]}
    rows |= dict.fromkeys(("mean", "low", "high"), [1.0, 0.5, 1.0, 0.0])
    drawing = missions.plot_courses(pd.DataFrame(rows), "policy", "%", {1: "One", 2: "Two"})
    drawn = {ax.get_ylabel(): ax.lines[0].get_ydata().tolist() for ax in drawing.axes}
    assert drawn == {"One": [1.0, 0.5], "Two": [1.0, 0.0]}


@pytest.mark.parametrize(
    "name", ["bay", pytest.param("jade-bight", marks=[pytest.mark.slow, pytest.mark.brief])]
)
def test_names_of_nodes_are_readable_and_keep_clear_of_each_other(name):
    sea = dess.load_scenario(name)
    (ax,) = missions.sea_figure(sea).axes
    assert {text.get_fontsize() for text in ax.texts} == {missions.NAME_SIZE}
    assert missions.NAME_SIZE >= 9
    places = missions.name_places(sea.nodes, sea.names, sea.size)
    scale = missions.MAP_WIDTH / max(sea.size)
    boxes = []
    for (x, y), (left, middle), text in zip(sea.nodes, places, sea.names, strict=True):
        start = x * scale + left
        boxes.append((start, start + missions.NAME_SIZE / 2 * len(text), middle - y * scale))
    for (left, right, middle), (other_left, other_right, other) in combinations(boxes, 2):
        side_by_side = right <= other_left or other_right <= left
        assert side_by_side or abs(middle - other) >= missions.NAME_SIZE
