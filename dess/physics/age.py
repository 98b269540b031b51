"""Age of information: how old the newest data are that have been collected from a node.

The age of a node grows by 1 per slot and falls when newer data are collected, so over time it has
the shape of a saw (S. Kaul, R. Yates, M. Gruteser: Real-time status: how often should one update?,
INFOCOM 2012). Everything is computed from the teeth of this saw, without sampling. A tooth is the
range of ages from one fall to the next. All times are in mission slots.
"""

import math

import numpy as np
from pydantic import Field

from dess.base.descriptions import Description
from dess.base.kernels import inlined, kernel, shared_kernel
from dess.physics.section import Number, Section, for_sections

# The most communication slots of a mission whose ages are measured: the batch engine counts the
# teeth of each mission by their length, in an array with an entry per communication slot.
MOST_TEETH = 2**18

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
def empty(mission, sensor, teeth, n):
    """Note that communication slot ``n`` has emptied a node: its age is 0 from now on.

    Args:
        mission: ``MISSION`` record.
        sensor: ``SENSOR`` record of the node.
        teeth: (G,) number of teeth by length in communication slots, or (0,) if not measured.
        n: Communication slot, 1..m.
    """
    if mission.continuous != 0:  # then the packets have times
        return
    now = mission.slot + n / mission.communication_slots
    _end_tooth(mission, sensor, teeth, now)
    add_tooth(mission, sensor, now - sensor.newest, 0.0)
    mission.newest += now - sensor.newest
    sensor.newest = now


@for_sections
def _end_tooth(mission, sensor, teeth, now):
    if mission.age_measured != 0:
        teeth[_length(mission, sensor, now)] += 1


@for_sections
def add_tooth(mission, sensor, high, low):
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
def _length(mission, sensor, now):
    """The age of a node, in communication slots: in the slotted model an integer."""
    return np.int64(round((now - sensor.newest) * mission.communication_slots))


@for_sections
def mean_age(mission):
    """The mean age of all nodes at the end of a slot [slots]."""
    return mission.slot - mission.newest / mission.nodes


@shared_kernel
def write_age(mission, sensors, teeth, out):
    """Write the ages of a mission of the slotted model into an ``OPERATIONS`` record."""
    m = mission.communication_slots
    lengths = np.nonzero(teeth)[0]
    count = len(lengths) + mission.nodes
    lows = np.zeros(count)
    highs = np.empty(count)
    weights = np.ones(count)
    ended = 0
    peaks = 0.0
    for row in range(len(lengths)):
        highs[row] = lengths[row] / m
        weights[row] = teeth[lengths[row]]
        ended += teeth[lengths[row]]
        peaks += highs[row] * weights[row]
    for k in range(mission.nodes):  # the last tooth of a node has no peak, the first begins here
        lows[len(lengths) + k] = starting_age(mission, mission.idle)
        highs[len(lengths) + k] = _length(mission, sensors[k], mission.slot) / m
    out.age, out.age_p99 = age_of_teeth(lows, highs, weights)
    out.peak_age = peaks / ended if ended > 0 else math.nan


@kernel
def age_of_teeth(lows, highs, weights):
    """The mean and the 99th percentile of the age over the time that the teeth take.

    The time spent above an age, divided by the whole time, falls linearly between the ends of
    teeth, so both are exact.

    Args:
        lows: (T,) age at the beginning of each tooth [slots].
        highs: (T,) age at its end [slots].
        weights: (T,) how many teeth are like this one.

    Returns:
        The mean and the percentile [slots]; nan if the teeth take no time.
    """
    count = len(weights)
    falling = np.empty(2 * count)  # the ends of the teeth, with a minus sign
    changes = np.empty(2 * count)
    time, area = 0.0, 0.0
    for tooth in range(count):
        falling[tooth], changes[tooth] = -highs[tooth], weights[tooth]
        falling[count + tooth], changes[count + tooth] = -lows[tooth], -weights[tooth]
        spent = weights[tooth] * (highs[tooth] - lows[tooth])
        time += spent
        area += spent * (highs[tooth] + lows[tooth])
    if time <= 0.0:
        return math.nan, math.nan
    mean = area / (2.0 * time)
    order = np.argsort(falling)
    passing, above = 0.0, 0.0  # teeth that pass the present age; time spent above it
    age = -falling[order[0]]
    for end in order:
        spent = passing * (age + falling[end])
        if above + spent >= _ABOVE * time:
            break
        above += spent
        passing += changes[end]
        age = -falling[end]
    return mean, age - (_ABOVE * time - above) / passing
