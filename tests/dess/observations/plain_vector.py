"""Observation (b) in plain Python: one number after the other, as the shipped weights know them.

The weights were trained on these very numbers, so the order of the sums and the places where a
number is rounded to float32 are those of the first version of the encoder.
"""

from typing import Any

import numpy as np

from dess.observations.states import (
    ACTIVE,
    BATTERY,
    CHARGE_COMPLETE,
    CHARGE_START,
    CHARGING,
    HOME,
    LATCH,
    MASK,
    MUST_CHARGE,
    NEEDED,
    CompactStates,
    Layout,
    X,
    Y,
)
from dess.state import STEP_X, STEP_Y

SCALES, NORMS = (1.2, 4.0, 12.0), (10.0, 25.0, 80.0)


def clip(value: float, low: float, high: float) -> float:
    """The value, or the bound that it exceeds."""
    return min(max(value, low), high)


def line_of(states: CompactStates, layout: Layout, b: int, i: int) -> np.ndarray:
    """The observation of UAV ``i`` in mission ``b``."""
    start, complete = (
        int(states.missions[b, column]) for column in (CHARGE_START, CHARGE_COMPLETE)
    )
    team = [[int(value) for value in row] for row in states.uavs[b]]
    data = [float(value) for value in states.residual[b]]
    nodes = [(int(x), int(y)) for x, y in layout.nodes]
    home = [int(slots) for slots in layout.zone_slots(layout.nodes)]
    scales = list(zip(near_tables(layout), NORMS, strict=True))
    me = team[i]
    active = sum(uav[ACTIVE] for uav in team)
    slack = me[BATTERY] - 1 - me[HOME]
    line: list[Any] = [
        me[BATTERY] / 100.0,
        me[NEEDED] / 100.0,
        me[LATCH],
        me[MUST_CHARGE],
        start / 100.0,
        complete / 100.0,
        me[HOME] / 30.0,
        min(slack, 50) / 50.0,
        clip(slack, 0, 8) / 8.0,
        (me[BATTERY] - start) / 50.0,
        clip(me[BATTERY] - start, -5, 10) / 10.0,
        clip(me[NEEDED] - complete, -20, 60) / 40.0,
        min(me[NEEDED], 10) / 10.0,
        active - 1,
        active == 1,
        sum(data) / (len(data) * 10.0),
    ]
    line += [x == me[X] for x in range(layout.grid)] + [y == me[Y] for y in range(layout.grid)]
    mates = [uav for j, uav in enumerate(team) if j != i and uav[ACTIVE]]
    fliers = [mate for mate in mates if not mate[CHARGING]]
    slots = [distance(me, node) for node in nodes]
    lead = [
        min((distance(mate, node) for mate in fliers), default=10_000) - own
        for node, own in zip(nodes, slots, strict=True)
    ]
    free = [
        float(np.float32(d if ahead >= 0 else 0.3 * d)) for d, ahead in zip(data, lead, strict=True)
    ]
    line += [d / 10.0 for d in data]
    line += [d / 10.0 * scales[1][0][own] for d, own in zip(data, slots, strict=True)]
    line += [clip(ahead / 10.0, -1.0, 1.0) for ahead in lead]
    for back, own in zip(home, slots, strict=True):
        left = me[BATTERY] - 1 - back if me[MUST_CHARGE] else me[NEEDED]
        line.append(clip((left - own) / 20.0, -1.0, 1.0))
    for action in range(5):
        cell = (me[X] + int(STEP_X[action]), me[Y] + int(STEP_Y[action]))
        crowd = np.float32(0.0)
        for mate in mates:
            near = distance(mate, cell)
            crowd = np.float32(float(crowd) + {0: 1.0, 1: 0.3}.get(near, 0.0))
        line += [me[MASK] >> action & 1, crowd]
        for values in (data, free):
            for nearness, norm in scales:
                total = np.float32(0.0)
                for node, value in zip(nodes, values, strict=True):
                    apart = abs(node[0] - cell[0]) + abs(node[1] - cell[1])
                    total = np.float32(float(total) + value * (nearness[apart] / norm))
                line.append(total)
    nearest = sorted(mates, key=lambda mate: distance(mate, (me[X], me[Y])))[:2]
    for mate in nearest:
        dx, dy = mate[X] - me[X], mate[Y] - me[Y]
        line += [1, dx / 30.0, dy / 30.0, clip(dx, -3, 3) / 3.0, clip(dy, -3, 3) / 3.0]
        line += [mate[BATTERY] / 100.0, mate[NEEDED] / 100.0, mate[CHARGING], mate[MUST_CHARGE]]
        line += [mate[X] / 30.0, mate[Y] / 30.0]
    return np.array(line + [0] * 11 * (2 - len(nearest)), np.float32)


def distance(uav: list[int], cell: tuple[int, int]) -> int:
    """Slots from a UAV to a cell."""
    return abs(uav[X] - cell[0]) + abs(uav[Y] - cell[1])


def near_tables(layout: Layout) -> list[np.ndarray]:
    """For each scale, the nearness of a node by the slots to it."""
    slots = np.arange(2 * layout.grid + 2)
    return list(np.exp(-slots / np.array(SCALES)[:, None]))
