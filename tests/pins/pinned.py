"""Files of what must not change by accident."""

import os
from pathlib import Path

KEPT = Path(__file__).with_name("kept")


def pinned(name: str, text: str) -> None:
    """Assert that a text is the kept one.

    A change that is meant renews the files: run the tests with ``DESS_WRITE_PINS=1``, and read the
    difference before it is committed.
    """
    check_kept(KEPT / name, text)


def check_kept(file: Path, text: str) -> None:
    """As ``pinned``, of a file that is kept elsewhere."""
    if os.environ.get("DESS_WRITE_PINS"):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, "utf-8")
    assert text == file.read_text("utf-8")
