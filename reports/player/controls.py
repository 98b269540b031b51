"""The controls of a player."""

from analysis.figures.style import INK, MUTED
from reports.player.mission import Mission
from reports.player.trace import Json

GRID = "#dde4e9"
SECONDS_PER_SLOT = {"Play": 0.3, "Fast": 0.1}


def _animate(seconds: float) -> Json:
    """Options of ``Plotly.animate``: how long a slot lasts."""
    duration = round(1000 * seconds)
    return {
        "mode": "immediate",
        "fromcurrent": True,
        "frame": {"duration": duration, "redraw": False},
        "transition": {"duration": duration, "easing": "linear"},
    }


def buttons() -> Json:
    """Play, slow and fast, and pause."""
    plays = [
        {"label": label, "method": "animate", "args": [None, _animate(seconds)]}
        for label, seconds in SECONDS_PER_SLOT.items()
    ]
    pause = {"label": "Pause", "method": "animate", "args": [[None], _animate(0)]}
    return {
        "type": "buttons",
        "direction": "right",
        "showactive": False,
        "xanchor": "left",
        "yanchor": "top",
        "pad": {"t": 0, "l": 0, "r": 0, "b": 0},
        "bgcolor": "white",
        "bordercolor": MUTED,
        "font": {"size": 14},
        "buttons": [*plays, pause],
    }


def slider(mission: Mission) -> Json:
    """A step per mission slot."""
    steps = [
        {"label": str(t), "method": "animate", "args": [[str(t)], _animate(0)]}
        for t in range(mission.end + 1)
    ]
    font = {"size": 15, "color": INK}
    shown = {"xanchor": "right", "prefix": "slot ", "offset": 16, "font": font}
    return {
        "steps": steps,
        "currentvalue": shown,
        "xanchor": "left",
        "yanchor": "top",
        "pad": {"t": 4, "l": 0, "r": 0, "b": 0},
        "font": {"size": 11},
        "bgcolor": "white",
        "activebgcolor": GRID,
        "bordercolor": MUTED,
        "ticklen": 0,
        "minorticklen": 0,
        "transition": {"duration": 0},
    }
