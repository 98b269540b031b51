"""The page of an own sea names the cheapest fleet, and its notebook runs with another sea."""

import re
from pathlib import Path
from typing import Any

import tomli_w

from tests.analysis.small import SCENARIO
from tests.reports.small import said_by

NAME = "own-sea"
ASKED: dict[str, Any] = {
    "example": {"uavs": 2, "pads": 1},
    "fields": {"uavs": [1, 2], "quota": [20, 40]},
    "requirements": {"success": 0.5, "collection_ratio": 0.1},
    "missions": 5,
}


def _sea(folder: Path) -> Path:
    """A small sea, with its nodes in a file."""
    (folder / "buoys.csv").write_text("name,lon,lat\na,8.0,54.0\nb,8.02,54.02\nc,8.04,54.03\n")
    path = folder / "sea.toml"
    path.write_text(tomli_w.dumps(SCENARIO | {"nodes": "buoys.csv"}))
    return path


def test_the_page_names_the_cheapest_fleet(tmp_path: Path) -> None:
    sea = _sea(tmp_path)
    text = said_by(NAME, results=str(tmp_path), scenario=str(sea), **ASKED)
    assert "3 sensor nodes on 8 x 8 cells of 800 m" in text
    assert re.search(r"All conditions together, greedy: the cheapest setting .*is 1 UAV\b", text)
    assert "with probability at least 0.95" in text
    assert "--require success=0.5 --require collection_ratio=0.1" in text
