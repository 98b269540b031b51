"""Observation (b) in plain Python: one number after the other, as the shipped weights know them.

The weights were trained on these very numbers, so the order of the sums and the places where a
number is rounded to float32 are those of the first version of the encoder.
"""

import numpy as np

from dess.envs.observations import states as column
from dess.envs.observations.states import CompactStates, Layout
from dess.model.state import STEP_X, STEP_Y
from tests.dess.envs.observations.plain_sets import Line, Uav, clip, f32, team_of
from tests.drawn import Cell

SCALES, NORMS = (1.2, 4.0, 12.0), (10.0, 25.0, 80.0)


def line_of(states: CompactStates, layout: Layout, b: int, i: int) -> np.ndarray:
    """The observation of UAV ``i`` in mission ``b``."""
    start, complete = states.missions[b, [column.CHARGE_START, column.CHARGE_COMPLETE]].tolist()
    team, data, nodes = team_of(states, b), states.residual[b].tolist(), layout.nodes.tolist()
    reach = np.arange(2 * layout.grid + 2)
    scales = list(zip(np.exp(-reach / np.array(SCALES)[:, None]), NORMS, strict=True))
    me, mates = team[i], [mate for j, mate in enumerate(team) if j != i and mate.active]
    slack, short = me.battery - 1 - me.home, me.needed - complete
    line: Line = [
        *(me.battery / 100.0, me.needed / 100.0, me.latch, me.must_charge),
        *(start / 100.0, complete / 100.0, me.home / 30.0),
        *(min(slack, 50) / 50.0, clip(slack, 0, 8) / 8.0),
        *((me.battery - start) / 50.0, clip(me.battery - start, -5, 10) / 10.0),
        *(clip(short, -20, 60) / 40.0, min(me.needed, 10) / 10.0),
        *(sum(uav.active for uav in team) - 1, not mates, sum(data) / (len(data) * 10.0)),
        *(x == me.x for x in range(layout.grid)),
        *(y == me.y for y in range(layout.grid)),
    ]
    slots = [_apart(me, node) for node in nodes]
    fliers = [mate for mate in mates if not mate.charging]
    lead = [
        min((_apart(mate, node) for mate in fliers), default=10_000) - own
        for node, own in zip(nodes, slots, strict=True)
    ]
    free = [float(f32(d if ahead >= 0 else 0.3 * d)) for d, ahead in zip(data, lead, strict=True)]
    line += [d / 10.0 for d in data]
    line += [d / 10.0 * scales[1][0][own] for d, own in zip(data, slots, strict=True)]
    line += [clip(ahead / 10.0, -1.0, 1.0) for ahead in lead]
    for back, own in zip(layout.zone_slots(layout.nodes).tolist(), slots, strict=True):
        left = me.battery - 1 - back if me.must_charge else me.needed
        line.append(clip((left - own) / 20.0, -1.0, 1.0))
    for action in range(5):
        cell = (me.x + int(STEP_X[action]), me.y + int(STEP_Y[action]))
        crowd = f32(0.0)
        for mate in mates:
            crowd = f32(float(crowd) + {0: 1.0, 1: 0.3}.get(_apart(mate, cell), 0.0))
        line += [me.mask >> action & 1, crowd]
        for values in (data, free):
            for nearness, norm in scales:
                total = f32(0.0)
                for (x, y), value in zip(nodes, values, strict=True):
                    apart = abs(x - cell[0]) + abs(y - cell[1])
                    total = f32(float(total) + value * (nearness[apart] / norm))
                line.append(total)
    nearest = sorted(mates, key=lambda mate: _apart(mate, (me.x, me.y)))[:2]
    for mate in nearest:
        dx, dy = mate.x - me.x, mate.y - me.y
        line += [1, dx / 30.0, dy / 30.0, clip(dx, -3, 3) / 3.0, clip(dy, -3, 3) / 3.0]
        line += [mate.battery / 100.0, mate.needed / 100.0, mate.charging, mate.must_charge]
        line += [mate.x / 30.0, mate.y / 30.0]
    return np.array(line + [0] * 11 * (2 - len(nearest)), f32)


def _apart(uav: Uav, cell: Cell) -> int:
    """Slots from a UAV to a cell."""
    return abs(uav.x - cell[0]) + abs(uav.y - cell[1])
