"""Age of information: how old the newest data are that have been collected from a node.

The age of a node grows by 1 per slot and falls when newer data are collected, so over time it has
the shape of a saw (S. Kaul, R. Yates, M. Gruteser: Real-time status: how often should one update?,
INFOCOM 2012). Everything is computed from the cycles of this saw, without sampling. A cycle lasts
from one fall to the next, and the age at its end is its peak. All times are in mission slots.
"""

import math

import numpy as np
from pydantic import Field

from dess.base.descriptions import Description
from dess.base.kernels import inlined, kernel, shared_kernel
from dess.physics.section import Number, Section, for_sections

# The most communication slots of a mission whose ages are measured: the batch engine counts the
# peaks of each mission by their age, in an array with an entry per communication slot.
MOST_AGES = 2**18

# The share of time at a higher age than the 99th percentile.
_ABOVE = 0.01


class Age(Section):
    """The age of information of the nodes, in the records and in the reward."""

    measured: bool = Field(False, description="whether records have the age of information")
    reward: Number = Field(
        0.0,
        ge=-1_000_000,
        le=1_000_000,
        description=Description(
            "reward per slot and unit of the mean age of all nodes", unit="slots"
        ),
    )


@inlined
def empty(mission, sensor, peaks, n):
    """Note that communication slot ``n`` has emptied a node: its age is 0 from now on.

    Args:
        mission: ``MISSION`` record.
        sensor: ``SENSOR`` record of the node.
        peaks: (G,) number of peaks by age in communication slots, or (0,) if not measured.
        n: Communication slot, 1..m.
    """
    if mission.continuous != 0:  # then the packets have times
        return
    now = mission.slot + n / mission.communication_slots
    _count_peak(mission, sensor, peaks, now)
    lower_age(mission, sensor, now - sensor.newest, 0.0)
    mission.newest += now - sensor.newest
    sensor.newest = now


@for_sections
def _count_peak(mission, sensor, peaks, now):
    if mission.age_measured != 0:
        peaks[_slots_old(mission, sensor, now)] += 1


@for_sections
def lower_age(mission, sensor, high, low):
    """Note that the age of a node falls from ``high`` to ``low`` [slots].

    The age begins with 0 and grows by 1 per slot, so what lies below it up to here grows by the
    difference of the squares, halved. Data above the age ``due`` are late.
    """
    sensor.age_area += (high * high - low * low) / 2.0
    if mission.due > 0.0:
        sensor.late += max(high - mission.due, 0.0)


@inlined
def age_of_node(mission, sensor):
    """The mean age of a node over the slots of a mission, and its age at their end [slots]."""
    at_end = mission.slot - sensor.newest
    return (sensor.age_area + at_end * at_end / 2.0) / max(mission.slot, 1), at_end


@inlined
def starting_age(mission, age):
    """An age with which a mission begins [slots], rounded to communication slots."""
    return round(age * mission.communication_slots) / mission.communication_slots


@inlined
def _slots_old(mission, sensor, now):
    """The age of a node, in communication slots: in the slotted model an integer."""
    return np.int64(round((now - sensor.newest) * mission.communication_slots))


@for_sections
def mean_age(mission):
    """The mean age of all nodes at the end of a slot [slots]."""
    return mission.slot - mission.newest / mission.nodes


@shared_kernel
def write_age(mission, sensors, peaks, out):
    """Write the ages of a mission of the slotted model into an ``OPERATIONS`` record."""
    m = mission.communication_slots
    reached = np.nonzero(peaks)[0]
    count = len(reached) + mission.nodes
    lows = np.zeros(count)
    highs = np.empty(count)
    weights = np.ones(count)
    ended = 0
    total = 0.0
    for row in range(len(reached)):
        highs[row] = reached[row] / m
        weights[row] = peaks[reached[row]]
        ended += peaks[reached[row]]
        total += highs[row] * weights[row]
    for k in range(mission.nodes):  # the last cycle of a node has no peak, the first begins here
        lows[len(reached) + k] = starting_age(mission, mission.idle)
        highs[len(reached) + k] = _slots_old(mission, sensors[k], mission.slot) / m
    out.age, out.age_p99 = age_over_cycles(lows, highs, weights)
    out.peak_age = total / ended if ended > 0 else math.nan


@kernel
def age_over_cycles(lows, highs, weights):
    """The mean and the 99th percentile of the age over the time that the cycles take.

    The time spent above an age, divided by the whole time, falls linearly between the ends of
    cycles, so both are exact.

    Args:
        lows: (T,) age at the beginning of each cycle [slots].
        highs: (T,) age at its end [slots].
        weights: (T,) how many cycles are like this one.

    Returns:
        The mean and the percentile [slots]; nan if the cycles take no time.
    """
    count = len(weights)
    falling = np.empty(2 * count)  # the ends of the cycles, with a minus sign
    changes = np.empty(2 * count)
    time, area = 0.0, 0.0
    for cycle in range(count):
        falling[cycle], changes[cycle] = -highs[cycle], weights[cycle]
        falling[count + cycle], changes[count + cycle] = -lows[cycle], -weights[cycle]
        spent = weights[cycle] * (highs[cycle] - lows[cycle])
        time += spent
        area += spent * (highs[cycle] + lows[cycle])
    if time <= 0.0:
        return math.nan, math.nan
    mean = area / (2.0 * time)
    order = np.argsort(falling)
    passing, above = 0.0, 0.0  # cycles that pass the present age; time spent above it
    age = -falling[order[0]]
    for end in order:
        spent = passing * (age + falling[end])
        if above + spent >= _ABOVE * time:
            break
        above += spent
        passing += changes[end]
        age = -falling[end]
    return mean, age - (_ABOVE * time - above) / passing
