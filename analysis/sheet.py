"""What follows from the data sheet of a scenario: as numbers for programs, and in lines."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from dess.analysis import numbers
from dess.base.errors import listed
from dess.model.channel import efficiency
from dess.model.link import Link, mean_snr_at
from dess.model.reach import Reach, reach_of_nodes
from dess.model.state import ACTION_NAMES, constants_of
from dess.physics.arrivals import MOST_MESSAGES
from dess.physics.energy import PERCENT
from dess.scenario.quantities import printed
from dess.scenario.scenario import Constants, ScenarioSpace

FAR_CELLS = 10  # the second distance [cells] of which the rate is told, if there is no range
_MOST_STEPS = 6  # of which all are told


def sheet_facts(space: ScenarioSpace) -> dict[str, Any]:
    """What follows from the data sheet of a scenario, in SI units and bits.

    Args:
        space: A scenario with a data sheet.

    Returns:
        Slot, cell and data unit; the battery that a slot of each move and of hovering takes [%];
        the rates by distance and the steps by SNR, each as a pair; the
        least and the largest number of messages that a node makes in a slot; how far a UAV can fly
        along a line and back; the names of the nodes that cannot be served, and the largest
        collection ratio without them; what the sheet does not say; and with types of UAVs, what
        follows for each.
    """
    units = space.units
    assert units
    reach = reach_of_nodes(space)
    facts = {
        "slot_s": units.slot,
        "cell_m": units.cell,
        "data_unit_bit": units.data,
        "battery_per_slot": _battery_per_slot(space),
        "rates": _rates_by_distance(space),
        "steps": _steps_by_snr(space),
        "messages_per_slot": [min(space.message_rates), max(space.message_rates)],
        "reach_m": reach.cells * units.cell,
        "has_limit": reach.has_limit,
        "out_of_reach": node_titles(space, reach.lost),
        "beyond_margins": node_titles(space, reach.margins),
        "largest_ratio": reach.largest_ratio,
        "assumed": space.data_sheet.assumed,
    }
    if space.fleet:
        facts["types"] = _facts_of_types(space)
    return facts


def sheet_lines(space: ScenarioSpace) -> list[str]:
    """What follows from the data sheet of a scenario, a line for each."""
    facts = sheet_facts(space)
    lines = [
        battery_sentence(space),
        *type_sentences(space),
        _rates_in_words(facts),
        _messages_in_words(facts),
        f"a UAV flies up to {printed(facts['reach_m'], 'm')} along a line, and back"
        f"{_in_still_air(space)}",
        *reach_sentences(space),
    ]
    if facts["assumed"]:
        named = ", ".join(f"{name} {value}" for name, value in facts["assumed"].items())
        lines.append(f"not in the sheet, and assumed: {named}")
    return lines


def battery_sentence(space: ScenarioSpace) -> str:
    """What a slot takes of the battery."""
    spans = _spans_in_words(_battery_per_slot(space))
    return f"a slot of flight takes {spans}{_in_still_air(space)}"


def _in_still_air(space: ScenarioSpace) -> str:
    """Says that a sentence does not hold for the wind of hourly weather; empty without weather."""
    return ", in still air" if space.weather.is_on else ""


def _spans_in_words(battery_per_slot: dict[str, float]) -> str:
    *moves, hover = battery_per_slot.values()
    span = f"{min(moves):g} % of the battery"
    if min(moves) < max(moves):
        span = f"{min(moves):g} to {max(moves):g} % of the battery by its direction"
    return f"{span}, one of hovering {hover:g} %"


def _battery_per_slot(space: ScenarioSpace, slots_per_cell: int = 1) -> dict[str, float]:
    """The battery that a slot takes [%], by the action of a UAV of a speed."""
    costs = space.consumption.slots[slots_per_cell - 1]
    return {name: cost / PERCENT for name, cost in zip(ACTION_NAMES, costs, strict=True)}


def _facts_of_types(space: ScenarioSpace) -> list[dict[str, Any]]:
    """What follows for each type of UAVs: battery, charging, speed, and what a slot takes."""
    return [
        {
            "battery": space.data_sheet.battery_of_type(kind),
            "charge_rate": float(space.data_sheet.charge_rate_of_type(kind)),
            "slots_per_cell": kind.slots_per_cell,
            "battery_per_slot": _battery_per_slot(space, kind.slots_per_cell),
        }
        for kind in space.fleet
    ]


def type_sentences(space: ScenarioSpace) -> list[str]:
    """What follows for each type of UAVs with a data sheet; none without types."""
    sentences = []
    for number, facts in enumerate(_facts_of_types(space), 1):
        slots = numbers.format_count(facts["slots_per_cell"], "slot")
        sentences.append(
            f"type {number} of the UAVs: it has {facts['battery']} % of a full battery above the "
            f"reserve, a slot of charging adds {facts['charge_rate']:.4g} %, a cell takes {slots}; "
            f"a slot of flight takes {_spans_in_words(facts['battery_per_slot'])}"
        )
    return sentences


def reach_sentences(space: ScenarioSpace) -> list[str]:
    """Which nodes UAVs cannot serve, and what ratio is possible without them; none if they can."""
    return _reach_in_words(space, reach_of_nodes(space))


def unreachable_sentences(spaces: Iterable[ScenarioSpace]) -> list[str]:
    """``reach_sentences`` of the scenario with a data sheet in which the fewest data can be served.

    A scenario without limits has none: nothing about it is known to be wrong.
    """
    reaches = [(space, reach_of_nodes(space)) for space in spaces if space.units]
    limited = [pair for pair in reaches if _is_short(pair[1])]
    if not limited:
        return []
    return _reach_in_words(*min(limited, key=lambda pair: pair[1].largest_ratio))


def scenario_notes(spaces: Iterable[ScenarioSpace]) -> list[str]:
    """Which nodes no UAV can serve, and which zones have no room for all UAVs."""
    all_spaces = [*spaces]
    return [*unreachable_sentences(all_spaces), *small_zone_sentences(all_spaces)]


def small_zone_sentences(spaces: Iterable[ScenarioSpace]) -> list[str]:
    """Which zones have too few cells for the largest fleet of scenarios, so that UAVs may be lost.

    In the air, the aim of the return guard needs room for all UAVs at pads: two for each pad, of
    which one waits. A zone does not have room for more UAVs than it has cells. On the ground, a
    wait takes no battery.
    """
    crowded = [space for space in spaces if _lacks_room(space)]
    if not crowded:
        return []
    space = max(crowded, key=lambda space: space.uavs[1])
    rooms, sizes = _rooms_at_pads(space), space.chart.sizes
    small = [
        f"zones.{zone - 1} has {numbers.format_count(int(sizes[zone]), 'cell')}"
        for zone in range(1, len(rooms))
        if rooms[zone] < 2 * space.zone_pads[zone]
    ]
    room = numbers.format_count(sum(rooms), "UAV")
    return [
        f"UAVs may be lost: the pads have room for {room}, and up to {space.uavs[1]} fly, as "
        f"{listed(small)}; give more cells or pads, or landing = true"
    ]


def _rooms_at_pads(space: ScenarioSpace) -> list[int]:
    """How many UAVs each zone has room for that take turns at its pads."""
    pairs = zip(space.zone_pads, space.chart.sizes, strict=True)
    return [min(2 * pads, int(cells)) for pads, cells in pairs]


def _lacks_room(space: ScenarioSpace) -> bool:
    """Whether zones with more cells would have room for all UAVs, and these have not."""
    fleet = space.uavs[1]
    needs_room = not space.landing and space.flight_cost > 0
    return needs_room and sum(_rooms_at_pads(space)) < fleet <= 2 * space.charging_pads


def _is_short(reach: Reach) -> bool:
    return bool(reach.lost or reach.margins)


def _reach_in_words(space: ScenarioSpace, reach: Reach) -> list[str]:
    sentences = []
    if not reach.has_limit:
        sentences.append("every node is in range: no limit: give range or rates")
    if reach.lost:
        names = listed(node_titles(space, reach.lost))
        sentences.append(f"out of reach of a UAV from a full battery: {names}")
    if reach.margins:
        names = listed(node_titles(space, reach.margins))
        fleet = numbers.format_count(space.uavs[1], "UAV")
        sentences.append(f"beyond the margins that the return guard keeps for {fleet}: {names}")
    if _is_short(reach):
        ratio = numbers.format_percent(reach.largest_ratio)
        sentences.append(f"without these nodes a collection ratio of {ratio} is the highest")
    return sentences


def node_titles(space: Constants, nodes: Iterable[int]) -> list[str]:
    """The names of nodes, or their cells."""
    return [space.names[k] if space.names else f"{[*space.nodes[k]]}" for k in nodes]


def _rates_by_distance(space: ScenarioSpace) -> list[tuple[float, float]]:
    """The rate [bit/s] of the mean SNR at two distances through the air [m]."""
    units = space.units
    assert units
    far = space.radio.range or FAR_CELLS * units.cell
    mission = constants_of(space).view(np.recarray)[0]
    rates = []
    for distance in sorted({max(units.cell, space.altitude), max(far, space.altitude)}):
        horizontal = np.sqrt(distance * distance - space.altitude * space.altitude)
        snr = float(mean_snr_at(Link.of(space), np.array([horizontal]))[0])
        rates.append((distance, efficiency(mission, snr) * _bits_per_second(space)))
    return rates


def _steps_by_snr(space: ScenarioSpace) -> list[tuple[float, float]]:
    """From which SNR [dB] on the rate is which [bit/s]."""
    size = _bits_per_second(space)
    return [(snr, step * size) for snr, step in space.radio.steps]


def _bits_per_second(space: ScenarioSpace) -> float:
    """The rate [bit/s] of a spectral efficiency of 1 bit/s/Hz."""
    units = space.units
    assert units
    return units.data / units.slot * space.radio.duty_cycle


def _rates_in_words(facts: dict[str, Any]) -> str:
    if not facts["steps"]:
        rates = [
            f"{printed(rate, 'bit/s')} at {printed(distance, 'm')}"
            for distance, rate in facts["rates"]
        ]
        return f"rate: {', '.join(rates)}"
    steps = [f"{printed(rate, 'bit/s')} from {snr:g} dB on" for snr, rate in facts["steps"]]
    if len(steps) > _MOST_STEPS:
        steps = [steps[0], "...", steps[-1]]
    return f"rates: {', '.join(steps)}"


def _messages_in_words(facts: dict[str, Any]) -> str:
    least, most = facts["messages_per_slot"]
    count = f"{most:.4g}"
    if least != most:
        count = f"{least:.4g} to {most:.4g}"
    evenly = ""
    if most > MOST_MESSAGES:
        evenly = f"; those of more than {MOST_MESSAGES} come evenly"
    return f"messages of a node: {count} a slot{evenly}"
