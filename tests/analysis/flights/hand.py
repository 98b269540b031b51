"""A small sea at the equator, and event logs of UAVs whose cells are given slot by slot."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dess.model.events import EventLog
from dess.physics.chart import Cell
from dess.scenario.scenario import Scenario, load_scenario

DEGREE = 0.001  # of a cell, at the equator also of longitude
CELL = 111.19508  # m
SLOT = 10.0  # s
SPEED = CELL / SLOT

# Nodes in the cells (2, 1), twice, and (5, 5); the centre of the grid is at 0, 0.
NODES = "lon,lat\n-0.0012,0.0021\n-0.0014,0.0024\n0.0018,-0.0012\n"
SHEET = f"""
[data_sheet]
endurance = "1000 s"
cruise = "{SPEED:.6f} m/s"
charging = "1000 s"
data_rate = "1 kB/h"
backlog = "20 MB"
bandwidth = "1 MHz"
snr = "20 dB at 100 m"
horizon = "300 s"
"""
FIELDS = 'uavs = 1\ngrid = 8\ncentre = [0, 0]\nnodes = {file = "nodes.csv", place = "merge"}\n'
CELLS = "zone = [0, 0, 2, 1]\n"
TYPED = "zone = {lon = -0.0031, lat = 0.0036, width = 2, height = 1}\n"  # cells (0, 0) and (1, 0)


def write_sea(folder: Path, zone: str = CELLS, fields: str = "", sheet: str = SHEET) -> Path:
    """Write a sea into a folder."""
    (folder / "nodes.csv").write_text(NODES)
    path = folder / "sea.toml"
    path.write_text(FIELDS + zone + fields + sheet)
    return path


def place(x: float, y: float) -> tuple[float, float]:
    """Longitude and latitude of a place on the grid [cells]."""
    return (x - 4) * DEGREE, (4 - y) * DEGREE


def middle(x: int, y: int) -> tuple[float, float]:
    """Longitude and latitude of the middle of a cell."""
    return place(x + 0.5, y + 0.5)


def log_of(*ways: Sequence[Cell], landed: bool = True) -> dict[str, np.ndarray]:
    """The log of UAVs that are in these cells at the start of the slots, and at the end.

    Each slot in the air costs 1 %.
    """
    log = EventLog()
    for uav, way in enumerate(ways):
        log.add(0.0, "mission_start", uav, -1, 100, *way[0], 100)
    for uav, way in enumerate(ways):
        for slot, cell in enumerate(way[1:]):
            log.add(float(slot), "move", uav, -1, 99 - slot, *cell, 99 - slot)
        if landed:
            log.add(float(len(way) - 1), "landing", uav, -1, 0)
    return log.columns()


def scenario_of(path: Path, **fields: Any) -> Scenario:
    """The scenario of a sea."""
    return Scenario.of(load_scenario(path), **fields)
