"""Limits between the fields of a scenario, which no field can check alone."""

from dess.scenario.constants import MOST_UAVS, Constants
from dess.sections.age import MOST_TEETH
from dess.sections.failures import MOST_PADS
from dess.sections.fleet import legs, places_per_slot

# The parameters that vary from mission to mission (Table II), in the order in which they are drawn.
SAMPLED = ("uavs", "flying_time", "charge_start", "charge_complete")

# Largest amount of initial data of a node [data units].
MOST_DATA = 10**9

# Largest number of packets of a mission with continuous arrivals, at their highest rate: some 70
# bytes each, and less than a second of compiled code to draw them all.
MOST_PACKETS = 2_000_000

# Largest number of entries in the channel's table (dess.channel): 8 GiB if all of it were filled.
_CHANNEL_LIMIT = 2**30


def check_constants(constants: Constants) -> None:
    """Check the constants against each other.

    Raises:
        ValueError: For the first of them that does not fit to others.
    """
    _check_cells(constants)
    _check_size(constants)
    _check_counts(constants)


def _check_cells(constants: Constants) -> None:
    """The zone and the nodes lie on the grid."""
    (x, y, width, height), grid = constants.zone, constants.grid
    if min(x, y) < 0 or min(width, height) < 1 or max(x + width, y + height) > grid:
        raise ValueError(
            f"zone: {list(constants.zone)} does not lie on the {grid} x {grid} grid; "
            "allowed: [x, y, width, height] with 0 <= x, y and x + width, y + height <= grid"
        )
    for node in constants.nodes:
        if not all(0 <= coordinate < grid for coordinate in node):
            raise ValueError(f"nodes: {list(node)} is off the grid; allowed: 0 <= x, y < {grid}")
    if len(set(constants.nodes)) < len(constants.nodes):
        twice = next(node for node in constants.nodes if constants.nodes.count(node) > 1)
        raise ValueError(f"nodes: {list(twice)} is listed twice; allowed: distinct cells")


def _check_size(constants: Constants) -> None:
    """The tables of a mission fit into memory."""
    steps = 5 * constants.grid**2 * len(constants.nodes) * constants.communication_slots
    places = constants.grid**2 * constants.communication_slots * places_per_slot(constants.fleet)
    if max(steps * legs(constants.fleet), places) > _CHANNEL_LIMIT:
        if constants.fleet and steps <= _CHANNEL_LIMIT:
            raise ValueError(
                "fleet: slots_per_cell of the types need too large a table of the channel; "
                "allowed: smaller or fewer different ones"
            )
        raise ValueError(
            "grid, nodes, communication_slots: too many together; allowed: "
            f"5 * grid^2 * nodes * communication_slots <= {_CHANNEL_LIMIT}"
        )
    if (
        constants.age.measured
        and not constants.needs_events
        and constants.max_slots * constants.communication_slots > MOST_TEETH
    ):
        raise ValueError(
            "age.measured: the mission has too many communication slots; allowed: "
            f"max_slots * communication_slots <= {MOST_TEETH}"
        )


def _check_counts(constants: Constants) -> None:
    """The rates, the pads and the initial data fit to the nodes and the zone."""
    if constants.arrivals.rates and len(constants.arrivals.rates) != len(constants.nodes):
        raise ValueError(
            f"arrivals.rates: there are {len(constants.arrivals.rates)} rates for "
            f"{len(constants.nodes)} nodes; allowed: a rate per node"
        )
    if constants.packets > MOST_PACKETS:
        raise ValueError(
            f"arrivals: {constants.packets:,.0f} packets at the highest rate; allowed: "
            f"{MOST_PACKETS:,} at most (rates of all nodes * highest factor * max_slots)"
        )
    pads, cells = constants.pads, constants.zone_cells
    if pads is not None and pads > cells:
        raise ValueError(f"pads: {pads} is more than the zone has cells; allowed: 1..{cells}")
    if constants.failures.pad_rate > 0 and constants.charging_pads > MOST_PADS:
        raise ValueError(
            f"pads: {constants.charging_pads} are too many to fail; allowed: {MOST_PADS} at most "
            "where failures.pad_rate is above 0"
        )
    low, high = constants.initial_data
    if not 0 <= low <= high <= MOST_DATA:
        raise ValueError(
            f"initial_data: {[low, high]} is not a range; allowed: a number 0..{MOST_DATA:,} "
            f"or [low, high] with 0 <= low <= high <= {MOST_DATA:,}"
        )


def sampled_limits(zone_cells: int) -> dict[str, tuple[int, int, str]]:
    """For each sampled parameter the least and the largest value, and the reason for them."""
    return {
        "uavs": (1, min(zone_cells, MOST_UAVS), f"cells of the zone, at most {MOST_UAVS}"),
        "flying_time": (1, 100, "battery capacity"),
        "charge_start": (10, 100, "eq. 1"),
        "charge_complete": (10, 100, "eq. 1"),
    }


def check_sampled(ranges: dict[str, tuple[int, int]], zone_cells: int) -> None:
    """Check the limits of the sampled parameters and the constraints between them (eq. 1).

    Raises:
        ValueError: For the first of them that is broken.
    """
    limits = sampled_limits(zone_cells)
    for name, (low, high) in ranges.items():
        least, most, reason = limits[name]
        if not least <= low <= high <= most:
            shown = low if low == high else [low, high]
            raise ValueError(
                f"{name}: {shown} is out of range; allowed: {least}..{most} ({reason})"
            )
    start, complete = ranges["charge_start"][1], ranges["charge_complete"][0]
    if start >= complete:
        raise ValueError(
            f"charge_start: {start} is not below charge_complete {complete}; "
            "allowed: 10 <= charge_start < charge_complete <= 100 (eq. 1)"
        )
