"""Traces of a plotly figure as JSON, both fixed and changing ones."""

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

Json: TypeAlias = dict[str, Any]


@dataclass
class Moving:
    """A trace that changes: its style, and what the frame of every slot sets."""

    style: Json
    frames: list[Json]

    def at_start(self) -> Json:
        """The trace as the first frame shows it."""
        return _merged(self.style, self.frames[0])


def lines(name: str, colour: str | None = None, width: float = 1.5, panel: int = 1) -> Json:
    """The style of a trace of lines in a panel; plotly keeps all points of a changing line."""
    line = {"color": colour, "width": width, "simplify": False}
    return {**_on_axes(panel), "name": name, "mode": "lines", "line": line}


def markers(name: str, panel: int = 1, mode: str = "markers", **marker: Any) -> Json:
    """The style of a trace of markers in a panel, drawn in full at its edges."""
    return {**_on_axes(panel), "name": name, "mode": mode, "cliponaxis": False, "marker": marker}


def rounded(values: pd.Series | np.ndarray) -> list[float]:
    """Amounts of data with two digits."""
    return np.round(np.maximum(values, 0.0), 2).tolist()  # residual data may be -1e-16


def _on_axes(panel: int) -> Json:
    return {} if panel == 1 else {"xaxis": f"x{panel}", "yaxis": f"y{panel}"}


def _merged(style: Json, change: Json) -> Json:
    nested = {k: _merged(style.get(k, {}), v) for k, v in change.items() if isinstance(v, dict)}
    return {**style, **change, **nested}
