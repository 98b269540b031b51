"""What figures show is what happened."""

from collections import Counter
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.quiver import Quiver

import dess
import policies
from analysis import numbers
from analysis.figures import missions
from analysis.figures.style import MUTED, node_colours
from analysis.results.event_log import uav_slots
from dess.state import sample_scenario
from policies.planner import Course


@pytest.fixture(scope="module")
def mission() -> tuple[Any, pd.DataFrame, dess.Scenario]:
    """A mission with moves, hovering, charging and a queue for the one pad."""
    unplanned = {"plan_waits": False}
    space = dess.load_scenario("fig4", uavs=3, pads=1, zone=[26, 2, 4, 1], charging=unplanned)
    record = dess.simulate(space, policies.load("greedy"), 1, 0, events=True)
    return record, pd.DataFrame(record.events.columns()), sample_scenario(space, 1, 0)


@pytest.fixture(scope="module")
def parts(mission: Any) -> list[Axes]:
    """Map, battery, residual data and occupancy of the mission's figure."""
    _, log, scenario = mission
    return missions.mission_figure(log, scenario).axes


def drawn(ax: Axes, what: str) -> list[Any]:
    """The artists of the map that are marked with a name, in the order of the UAVs."""
    marked = [a for a in ax.collections if (a.get_gid() or "").startswith(what)]
    return sorted(marked, key=lambda artist: artist.get_gid())


def colours(artist: Any) -> list[str]:
    return [to_hex(c) for c in artist.get_facecolor()]


def test_every_move_is_an_arrow_in_the_colour_of_its_node(mission: Any, parts: Any) -> None:
    _, log, scenario = mission
    slots = uav_slots(log)
    palette = [*node_colours(len(scenario.nodes)), MUTED]
    arrows = drawn(parts[0], "moves")
    assert len(arrows) == scenario.uavs
    for uav, arrow in enumerate(arrows):
        moves = slots[(slots["uav"] == uav) & slots["moved"]]
        assert isinstance(arrow, Quiver)
        assert arrow.N == len(moves) > 0
        assert colours(arrow) == [palette[node] for node in moves["node"]]
        assert np.array_equal(arrow.U, moves["x"] - moves["from_x"])
        assert np.array_equal(arrow.V, moves["y"] - moves["from_y"])


def test_crosses_hover_in_the_colour_of_their_node(mission: Any, parts: Any) -> None:
    _, log, scenario = mission
    slots = uav_slots(log)
    palette = [*node_colours(len(scenario.nodes)), MUTED]
    hovers = slots[~slots["moved"] & ~slots["charging"]]
    seen = [c for cross in drawn(parts[0], "hovers") for c in colours(cross)]
    assert seen == [palette[node] for node in hovers["node"]]
    assert len(seen) > 0


def test_stars_are_the_charging_slots(mission: Any, parts: Any) -> None:
    record, _, _ = mission
    stars = [len(star.get_offsets()) for star in drawn(parts[0], "charges")]
    assert stars == record.uavs["slots_charging"].tolist()
    assert sum(stars) > 0


def test_nodes_zone_and_ends_lie_where_they_are(mission: Any, parts: Any) -> None:
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


def test_battery_ends_as_recorded(mission: Any, parts: Any) -> None:
    record, _, scenario = mission
    lines = {line.get_label(): line for line in parts[1].lines}
    for uav, row in enumerate(record.uav_rows()):
        line = lines[f"UAV {uav + 1}"]
        assert line.get_ydata()[0] == record.flying_time
        assert line.get_ydata()[-1] == row["battery"]
    levels = {line.get_ydata()[0] for line in parts[1].lines if len(set(line.get_ydata())) == 1}
    assert {scenario.charge_start, scenario.charge_complete} <= levels


def test_residual_data_ends_as_recorded(mission: Any, parts: Any) -> None:
    record, _, scenario = mission
    (total,) = parts[2].lines
    assert total.get_ydata()[0] == pytest.approx(record.initial)
    assert total.get_ydata()[-1] == pytest.approx(record.residual)
    assert [colours(band)[0] for band in parts[2].collections] == node_colours(len(scenario.nodes))


def test_occupancy_counts_charging_and_waiting_uavs(mission: Any, parts: Any) -> None:
    record, log, scenario = mission
    (steps,) = (line for line in parts[3].lines if line.get_gid() == "occupancy")
    waiting = record.uavs["slots_waiting"].sum()
    assert waiting > 0
    assert steps.get_ydata().sum() == record.uavs["slots_charging"].sum() + waiting
    busy = Counter(uav_slots(log).query("charging")["slot"])
    assert max(busy.values()) <= scenario.pads


def test_the_plan_is_drawn_over_the_mission() -> None:
    space = dess.load_scenario("paper", uavs=1)
    record = dess.simulate(space, policies.load("greedy"), 3, 1, events=True)
    log = pd.DataFrame(record.events.columns())
    scenario = sample_scenario(space, 3, 1)
    course = Course(np.array([[8, 10]]), np.array([2]), np.array([[26, 5], [25, 5], [24, 5]]))
    figure = missions.plan(log, scenario, [course])
    (line,) = (line for line in figure.axes[0].lines if line.get_gid() == "plan-0")
    assert np.array_equal(line.get_xydata(), course.path)
    assert "1" in [text.get_text() for text in figure.axes[0].texts if tuple(text.xy) == (8, 10)]


@pytest.mark.parametrize("signed", [False, True])
def test_values_are_written_at_the_nodes_in_the_colour_of_their_sign(signed: bool) -> None:
    space, values = dess.load_scenario("paper"), np.linspace(-1.0 * signed, 0.96, 25)
    (ax,) = missions.node_map(space, "Values", values, signed, "{:.2f}".format).axes
    shown = [numbers.difference(v, 0) if signed else f"{v:.2f}" for v in values]
    assert [text.get_text() for text in ax.texts] == shown
    assert [text.xy for text in ax.texts] == [*space.nodes]
    (nodes,) = ax.collections
    red, _, blue, _ = np.transpose(nodes.to_rgba(nodes.get_array()))
    assert np.array_equal(blue > red, values > 0) or not signed
