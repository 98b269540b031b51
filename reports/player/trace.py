"""Traces of a plotly figure as JSON, at rest and moving."""

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

Json: TypeAlias = dict[str, Any]


@dataclass
class Moving:
    """A trace that changes: what stays, and what the frame of each slot sets."""

    style: Json
    frames: list[Json]


def on_axes(number: int, name: str) -> Json:
    """What a trace has that stands in the panel of that number."""
    return {"name": name, "xaxis": f"x{number}", "yaxis": f"y{number}", "hoverinfo": "skip"}


def merged(style: Json, change: Json) -> Json:
    """A trace with a change, in depth."""
    nested = {k: merged(style.get(k, {}), v) for k, v in change.items() if isinstance(v, dict)}
    return {**style, **change, **nested}


def rounded(values: pd.Series | np.ndarray) -> list[float]:
    """Amounts of data as a page writes them."""
    return np.round(np.maximum(values, 0.0), 2).tolist()  # what is left may be -1e-16
