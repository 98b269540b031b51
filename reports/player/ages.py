"""The panels of a player that show the age of information: the mean over time, and each node's."""

from analysis.figures.style import INK
from reports.player.playback import Playback
from reports.player.trace import Json, Moving, lines, markers, rounded

AGE, NODE_AGES = 6, 7  # panels
TITLES = {AGE: "Mean age of the nodes [slots]", NODE_AGES: "Age of each node [slots]"}


def highest(playback: Playback) -> float:
    """The end of the axis of the mean age [slots]."""
    return round(1.05 * float(playback.mean_age["age"].max()), 2)


def axes(playback: Playback) -> Json:
    """The axes of the nodes' panel: a column per node."""
    count = len(playback.scenario.nodes)
    most = round(1.05 * float(playback.ages.max(axis=None)), 2)
    x = {"range": [-0.7, count - 0.3], "anchor": f"y{NODE_AGES}", "title": {"text": "node"}}
    y = {"range": [0, most], "anchor": f"x{NODE_AGES}", "showgrid": True, "nticks": 4}
    return {f"xaxis{NODE_AGES}": x, f"yaxis{NODE_AGES}": y}


def sawtooth(playback: Playback) -> Json:
    """The mean age over time, which does not change while the mission is played."""
    times, ages = (rounded(playback.mean_age[name]) for name in ("time", "age"))
    return {**lines("mean age", INK, panel=AGE), "x": times, "y": ages}


def columns(playback: Playback) -> list[Moving]:
    """For each node a stem as high as its age, with a dot in its colour."""
    nodes = list(range(len(playback.scenario.nodes)))
    stems: Json = {
        **lines("stems", INK, 1, NODE_AGES),
        "x": [x for k in nodes for x in (k, k, None)],
    }
    dots = {
        **markers("ages", NODE_AGES, size=8, color=playback.node_colours, opacity=1),
        "x": nodes,
        "hovertemplate": "node %{x}: age %{y:.1f} slots<extra></extra>",
        "hoverinfo": "all",
    }
    rows = [rounded(row) for row in playback.ages.to_numpy()]
    return [
        Moving(stems, [{"y": [y for age in row for y in (0, age, None)]} for row in rows]),
        Moving(dots, [{"y": row} for row in rows]),
    ]
