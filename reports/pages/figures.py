"""A figure as bytes, which are the same for the same figure, and as an address."""

import io
import re
from base64 import b64encode
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # an index is made without figures
    from matplotlib.figure import Figure

# The coordinates in a figure, a number with many decimals, the space around a command of a path.
_PLACES = re.compile(rb' (?:d|x|y)="[^"]*"')
_DIGITS = re.compile(rb"(\.\d)\d+")
_BREAKS = re.compile(rb"\s+([LCQz]) ?")
# What a file says of its origin, without the time.
_NO_METADATA: dict = {"svg": dict.fromkeys(("Creator", "Date", "Format", "Type"))}
_NO_METADATA |= {"pdf": {"CreationDate": None}, "png": {}}


def resize_figure(drawing: "Figure", width: float, height: float) -> None:
    """Give a figure another size [inches]; one of ours fits its legend to it."""
    resize = getattr(drawing, "resize", drawing.set_size_inches)
    resize(width, height)


def encode_figure(drawing: "Figure", kind: str) -> bytes:
    """A figure in one of ``PICTURES``; the same figure gives the same bytes."""
    import matplotlib as mpl

    buffer = io.BytesIO()
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams |= {"svg.hashsalt": "dess", "svg.fonttype": "none"}  # text, not outlines
        mpl.rcParams |= {"pdf.fonttype": 42, "savefig.dpi": 200}  # journals refuse Type 3
        drawing.savefig(buffer, format=kind, metadata=_NO_METADATA[kind])
    content = buffer.getvalue()
    if kind == "svg":
        return _PLACES.sub(_shorten_coordinates, content)
    return content


def _shorten_coordinates(coordinates: re.Match[bytes]) -> bytes:
    """The coordinates without digits that are finer than any screen, and without line breaks."""
    return _BREAKS.sub(rb"\1", _DIGITS.sub(rb"\1", coordinates[0]))


def figure_address(drawing: "Figure") -> str:
    """The address of a figure, which contains it."""
    return f"data:image/svg+xml;base64,{b64encode(encode_figure(drawing, 'svg')).decode()}"
