"""The plan of a team, which is a list of waypoints per UAV.

plan = empty_plan(2)
insert_waypoint(plan, 0, 0, 26, 5, CHARGE, 0)    # UAV 0 charges in cell 26, 5
"""

from typing import NamedTuple

import numpy as np

from dess.base.kernels import inlined, kernel

WAYPOINT = np.dtype(
    [
        ("x", np.int64),
        ("y", np.int64),
        ("stay", np.int64),  # slots to hover there; ``CHARGE`` means: until it is charged
        ("turned", np.int64),  # 1 if the leg to it begins along y
        ("begun", np.int64),  # slot in which that leg begins, ``NEVER`` if it does not
    ]
)
CHARGE = -1
NEVER = 1 << 40
# The most waypoints of a UAV. One record more tells when the last one is done with.
MOST_WAYPOINTS = 48


class Plan(NamedTuple):
    """Waypoints of I UAVs.

    Attributes:
        waypoints: (I, ``MOST_WAYPOINTS`` + 1) ``WAYPOINT`` records.
        lengths: (I,) how many of them there are.
    """

    waypoints: np.ndarray
    lengths: np.ndarray


def empty_plan(uavs: int) -> Plan:
    """A plan of that many UAVs without waypoints."""
    return Plan(np.zeros((uavs, MOST_WAYPOINTS + 1), WAYPOINT), np.zeros(uavs, np.int64))


@kernel
def copy_plan(mission, source, target):
    """Make one plan equal to another."""
    for i in range(mission.uavs):
        target.lengths[i] = source.lengths[i]
        for number in range(source.lengths[i] + 1):
            target.waypoints[i, number] = source.waypoints[i, number]


@inlined
def last_charge(plan, i):
    """The last waypoint at which UAV ``i`` charges, or -1."""
    number = plan.lengths[i] - 1
    while number >= 0 and plan.waypoints[i, number].stay != CHARGE:
        number -= 1
    return number


@kernel
def insert_waypoint(plan, i, place, x, y, stay, turned):
    """Insert a waypoint of UAV ``i`` before one of its."""
    for number in range(plan.lengths[i], place, -1):
        w = plan.waypoints[i, number - 1]
        set_waypoint(plan.waypoints[i, number], w.x, w.y, w.stay, w.turned)
    set_waypoint(plan.waypoints[i, place], x, y, stay, turned)
    plan.lengths[i] += 1


@kernel
def remove_waypoint(plan, i, place):
    """Take out a waypoint of UAV ``i``."""
    plan.lengths[i] -= 1
    for number in range(place, plan.lengths[i]):
        w = plan.waypoints[i, number + 1]
        set_waypoint(plan.waypoints[i, number], w.x, w.y, w.stay, w.turned)


@inlined
def set_waypoint(w, x, y, stay, turned):
    """Set all of a waypoint but when its leg begins, which belongs to its place in the plan."""
    w.x = x
    w.y = y
    w.stay = stay
    w.turned = turned
