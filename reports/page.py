"""Pieces of a report page: figures, tables and numbers as clean HTML."""

import io
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

import matplotlib as mpl
import pandas as pd
from IPython.display import HTML
from matplotlib.figure import Figure

_NO_METADATA: dict = {key: None for key in ("Creator", "Date", "Format", "Type")}


def percent(value: float) -> str:
    """``0.9731`` as ``97.3 %``."""
    return f"{100 * value:.1f} %"


def interval(mean: float, low: float, high: float) -> str:
    """A mean and its interval as ``97.3 % [96.1, 98.1]``."""
    return f"{percent(mean)} [{100 * low:.1f}, {100 * high:.1f}]"


def difference(value: float, reference: float) -> str:
    """By how many percentage points a value is above its reference, as ``+7.4`` or ``−2.1``."""
    return f"{100 * (value - reference):+.1f}".replace("-", "−")


def words(names: Sequence[str]) -> str:
    """``a, b and c``."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def provenance(manifests: Iterable[Mapping[str, Any]]) -> HTML:
    """Where results come from: a column per manifest."""
    columns = {}
    for manifest in manifests:
        study = manifest["study"]
        columns[study["name"]] = {
            "scenario": study["scenario"],
            "policies": " ".join(study["policies"]),
            "design points": len(manifest["points"]),
            "missions per policy and point": _range(
                [n for counts in manifest["missions"] for n in counts]
            ),
            "seed": manifest["seed"],
            "engine": study["engine"],
            "dess": manifest["version"],
            "commit": (manifest["commit"] or "unknown")[:12],
            **manifest["libraries"],
        }
    frame = pd.DataFrame(columns).rename_axis("Study").reset_index()
    return table(frame)


def _range(numbers: list[int]) -> str:
    """``300``, or ``20 to 1,200``."""
    ends = sorted({min(numbers), max(numbers)})
    return " to ".join(f"{n:,}" for n in ends)


def table(frame: pd.DataFrame, caption: str = "") -> HTML:
    """A table without its index, under its caption; where it is too wide, it scrolls."""
    html = frame.to_html(index=False, border=0, classes="table", escape=True, na_rep="")
    above = f'<p class="caption">{escape(caption)}</p>' if caption else ""
    return HTML(f'{above}<div class="scroll">{html}</div>')


def figure(drawing: Figure, alt: str, caption: str = "") -> HTML:
    """A figure with its caption, and what it shows for those who cannot see it."""
    return HTML(_figure(drawing, alt, caption))


def gallery(drawings: list[tuple[Figure, str, str]]) -> HTML:
    """Figures, each with its alternative text and caption, side by side as far as there is room."""
    return HTML(f'<div class="gallery">{"".join(_figure(*each) for each in drawings)}</div>')


def svg(drawing: Figure) -> bytes:
    """A figure as SVG that is the same, byte for byte, whenever and wherever it is drawn."""
    buffer = io.BytesIO()
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams["svg.hashsalt"] = "dess"
        drawing.savefig(buffer, format="svg", metadata=_NO_METADATA)
    return buffer.getvalue()


def _figure(drawing: Figure, alt: str, caption: str) -> str:
    source = f"data:image/svg+xml;base64,{b64encode(svg(drawing)).decode()}"
    below = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    return f'<figure><img alt="{escape(alt)}" src="{source}">{below}</figure>'
