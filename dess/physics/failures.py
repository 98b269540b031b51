"""Failures at random times: UAVs that are lost or grounded, pads out of order, silent nodes."""

from typing import Any, Literal, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from dess.base.descriptions import Description
from dess.base.errors import InputError
from dess.base.kernels import inlined, kernel
from dess.physics import streams
from dess.physics.landing import is_over, stands
from dess.physics.section import Probability, Section, Slots, for_sections

MOST_PADS = 64  # charging pads that can fail: as many as the largest fleet has UAVs

# What pads have for each zone, and what it replaces.
_OF_ZONES = {"pad_rates": "pad_rate", "pad_repairs": "pad_repair"}


class Failures(Section):
    """Rates of failures per mission slot, and mean durations of repairs."""

    uav_rate: Probability = Field(
        0.0, description="probability that a flying UAV fails in a mission slot"
    )
    uav_repair: Slots = Field(
        0.0,
        description=Description(
            "mean time until a failed UAV flies again",
            unit="slots",
            form="at least 1, or 0 if it is lost",
        ),
    )
    uav_data: Literal["kept", "lost"] = Field(
        "kept", description="whether the data that a lost UAV has collected count"
    )
    pad_rate: Probability = Field(
        0.0, description="probability that a charging pad fails in a mission slot"
    )
    pad_repair: Slots = Field(
        0.0,
        description=Description(
            "mean time until a failed pad works again",
            unit="slots",
            form="at least 1, or 0 if it never does",
        ),
    )
    pad_rates: tuple[Probability, ...] = Field(
        (), description=Description("the same for the pads of each zone, in place of pad_rate")
    )
    pad_repairs: tuple[Slots, ...] = Field(
        (), description=Description("the same for the pads of each zone, in place of pad_repair")
    )
    node_rate: Probability = Field(
        0.0, description="probability that a node falls silent in a mission slot"
    )
    node_repair: Slots = Field(
        0.0,
        description=Description(
            "mean time until a silent node answers again",
            unit="slots",
            form="at least 1, or 0 if it never does",
        ),
    )
    node_data: Literal["kept", "lost"] = Field(
        "kept", description="whether the data of a node are kept while it is silent"
    )

    @model_validator(mode="after")
    def _are_for_all_zones_or_for_each(self) -> Self:
        for for_each, for_all in _OF_ZONES.items():
            if getattr(self, for_each) and getattr(self, for_all):
                raise InputError(for_each, f"is given beside {for_all}", "one of both")
        return self

    @model_serializer(mode="wrap")
    def _without_zones(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the fields for each zone where they are not given."""
        values = handler(self)
        off = {name for name in _OF_ZONES if not getattr(self, name)}
        return {name: value for name, value in values.items() if name not in off}

    @property
    def largest_pad_rate(self) -> float:
        """The failure rate of the pads of the zone where it is largest; 0 if no pad fails."""
        return max(self.pad_rates, default=self.pad_rate)

    def zone_constants(self, zones: int) -> dict[str, list[float]]:
        """The fields of ``MISSION`` that the section sets for each of so many zones."""
        repairs = self.pad_repairs or (self.pad_repair,) * zones
        return {
            "zone_pad_rate": [*(self.pad_rates or (self.pad_rate,) * zones)],
            "zone_pad_repair": [_chance_of(mean) for mean in repairs],
        }

    def constants(self) -> dict[str, Any]:
        """The fields of ``MISSION`` that the section sets; repairs as probabilities per slot.

        Those of pads are the largest of all zones.
        """
        repairs = {name: mean for name, mean in self if name.endswith("_repair")}
        return {
            **dict(self),
            **{name: _chance_of(mean) for name, mean in repairs.items()},
            "pad_rate": self.largest_pad_rate,
            "pad_repair": max(map(_chance_of, self.pad_repairs or (self.pad_repair,))),
            "has_failures": self.is_on,
            "uav_data_lost": self.uav_data == "lost",
            "node_data_lost": self.node_data == "lost",
        }


def _chance_of(mean: float) -> float:
    """The probability per slot of what takes so many slots on average; 0 if it never happens."""
    if mean:
        return 1 / mean
    return 0.0


@for_sections
def strike_if_on(mission, uavs, residual, sensors, lost):
    """Let UAVs, pads and nodes fail and be repaired at the end of a slot, after it is settled."""
    if mission.has_failures:
        strike_uavs(mission, uavs, lost)
        strike_pads(mission, uavs)
        strike_nodes(mission, residual, sensors)


@kernel
def strike_uavs(mission, uavs, lost):
    """Let UAVs fail and be repaired.

    Args:
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        lost: How the mission of a lost UAV ended, ``state.LOST``.
    """
    for i in range(mission.uavs):
        _strike_uav(mission, uavs[i], i, lost)


@kernel
def strike_pads(mission, uavs):
    """Let pads fail and be repaired."""
    if mission.pad_rate > 0.0:
        j = 0
        for zone in range(mission.zones):
            for _ in range(mission.zone_pads[zone]):
                _strike_pad(mission, uavs, zone, j)
                j += 1


@kernel
def strike_nodes(mission, residual, sensors):
    """Let nodes fall silent and answer again.

    Args:
        mission: ``MISSION`` record.
        residual: (K,) residual data that UAVs can collect [data units]; 0 at a silent node.
        sensors: (K,) ``SENSOR`` records.
    """
    if mission.node_rate > 0.0:
        for k in range(mission.nodes):
            _strike_node(mission, residual, sensors[k], k)
            if is_over(mission):  # what is hidden is left over
                residual[k] += sensors[k].hidden
                sensors[k].hidden = 0.0


@inlined
def _happens(mission, stream, index, probability):
    """Whether what has this probability happens in the present slot."""
    words = streams.block(mission.seed, mission.replication, stream, 0, mission.slot, index)
    return streams.uniform(words[0]) < probability


@inlined
def _strike_uav(mission, u, i, lost):
    """A UAV fails in the air, not on the ground or a pad; then it is grounded or lost.

    In the middle of a move it comes down in the cell that it flies to.
    """
    if not u.active:
        return
    if u.grounded:
        u.grounded = not _happens(mission, streams.UAV_FAILURE, i, mission.uav_repair)
    elif stands(mission, u) or u.charging:
        return
    elif _happens(mission, streams.UAV_FAILURE, i, mission.uav_rate):
        mission.uav_failures += 1
        u.pad_request = -1
        u.slots_left = 0
        u.grounded = mission.uav_repair > 0.0
        if not u.grounded:
            u.active = False
            u.end = lost
            mission.active -= 1
            if mission.uav_data_lost:
                mission.collected -= u.collected
                mission.lost += u.collected
                u.collected = 0.0


@inlined
def _strike_pad(mission, uavs, zone, j):
    """A UAV whose pad fails has to ask again, but it keeps the time of its request."""
    out = mission.pads_out[j]
    probability = mission.zone_pad_repair[zone] if out else mission.zone_pad_rate[zone]
    if not _happens(mission, streams.PAD_FAILURE, j, probability):
        return
    mission.pads_out[j] = 1 - out
    for i in range(mission.uavs):
        if uavs[i].charging and uavs[i].pad == j:
            uavs[i].charging = False
            mission.pad_requests += 1


@inlined
def _strike_node(mission, residual, sensor, k):
    """The data of a silent node are hidden, or lost; so are the data that arrive meanwhile."""
    probability = mission.node_repair if sensor.silent else mission.node_rate
    if _happens(mission, streams.NODE_FAILURE, k, probability):
        sensor.silent = not sensor.silent
    if not sensor.silent:
        residual[k] += sensor.hidden
        sensor.hidden = 0.0
        return
    hide_data(mission, residual, sensor, k)


@inlined
def hide_data(mission, residual, sensor, k):
    """Hide the data that a silent node has, or lose them."""
    if mission.node_data_lost:
        mission.lost += residual[k]
    else:
        sensor.hidden += residual[k]
    residual[k] = 0.0


@inlined
def working_pads(mission, zone):
    """The number of charging pads of a zone that are not out of order."""
    return mission.zone_pads[zone] - _broken_pads(mission, zone)


@for_sections
def _broken_pads(mission, zone):
    broken = 0
    if mission.pad_rate > 0.0:
        first = first_pad(mission, zone)
        for j in range(first, first + mission.zone_pads[zone]):
            broken += mission.pads_out[j]
    return broken


@inlined
def first_pad(mission, zone):
    """The index of the first pad of a zone; pads are numbered zone by zone."""
    first = 0
    for other in range(zone):
        first += mission.zone_pads[other]
    return first


@for_sections
def take_pad(mission, uavs, u):
    """Give a UAV the first pad of its zone that works and is free; ``charging`` is set after."""
    if not mission.has_failures:
        return
    first = first_pad(mission, u.zone)
    for j in range(first, first + mission.zone_pads[u.zone]):
        free = mission.pads_out[j] == 0
        for i in range(mission.uavs):
            if uavs[i].charging and uavs[i].pad == j:
                free = False
        if free:
            u.pad = j
            return


@kernel
def write_failures(mission, out):
    """Write what has failed into an ``OPERATIONS`` record."""
    out.failures = mission.uav_failures
    out.slots_grounded = mission.slots_grounded
    out.lost = mission.lost
