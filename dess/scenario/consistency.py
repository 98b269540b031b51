"""What no field of a scenario can check alone: its zones, its size, its ways, its rates."""

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from dess.base.errors import listed
from dess.physics.age import MOST_TEETH
from dess.physics.arrivals import MOST as MOST_RATE
from dess.physics.chart import FAR, MOST_CHARTED, NO_FLY, Cell, parking_of, spread, zones_of
from dess.physics.failures import MOST_PADS
from dess.physics.fleet import legs, places_per_slot
from dess.scenario.data_sheet import DataSheet
from dess.scenario.fields import MOST_DATA, Fields

# Largest number of packets of a mission with continuous arrivals, at their highest rate: some 70
# bytes each, and less than a second of compiled code to draw them all.
MOST_PACKETS = 2_000_000

# Largest number of entries in the table of dess.model.channel: 8 GiB if all of it were filled.
MOST_ENTRIES = 2**30


def problems(c: Fields) -> Iterator[str]:
    """What is wrong with a scenario, each in a line with what is allowed."""
    for check in (_off_the_grid, _too_large, _unreachable, _unfit):
        yield from check(c)


def _off_the_grid(c: Fields) -> Iterator[str]:
    columns, rows = c.size
    cells: Counter[Cell] = Counter()
    for number, (x, y, width, height) in enumerate(c.rectangles):
        name = "zone"
        if number:
            name = f"zones.{number - 1}.cells"
        if min(x, y) < 0 or min(width, height) < 1 or x + width > columns or y + height > rows:
            yield (
                f"{name}: {[x, y, width, height]} does not lie on the {columns} x {rows} grid; "
                "allowed: [x, y, width, height] with 0 <= x, y and x + width, y + height <= grid"
            )
            return
        cells.update((x + i % width, y + i // width) for i in range(width * height))
    for cell, count in cells.items():
        if count > 1:
            yield f"zones: two zones have the cell {[*cell]}; allowed: zones without common cells"
    size = f"0 <= x, y < {columns}"
    if c.rows:
        size = f"0 <= x < {columns}, 0 <= y < {rows}"
    for name, names in (("nodes", c.names), ("no_fly", ())):
        places = getattr(c, name)
        beyond = [n for n, (x, y) in enumerate(places) if not (0 <= x < columns and 0 <= y < rows)]
        if beyond:
            yield f"{name}: {_titles(beyond, places, names)} off the grid; allowed: {size}"
        if twice := [places.index(cell) for cell, count in Counter(places).items() if count > 1]:
            yield f"{name}: {_titles(twice, places, names)} listed twice; allowed: distinct cells"


def _titles(
    numbers: Sequence[int],
    cells: Sequence[Cell],
    names: Sequence[str],
    verbs: tuple[str, str] = ("is", "are"),
) -> str:
    """Some of these cells, with their names if they have some, and the verb."""
    titles = [
        f"{names[n]} at {[*cells[n]]}" if len(names) > n else f"{[*cells[n]]}" for n in numbers
    ]
    return f"{listed(titles)} {verbs[len(titles) > 1]}"


def _too_large(c: Fields) -> Iterator[str]:
    """The tables of a mission fit into memory."""
    ways = max(5 * len(c.nodes) * legs(c.fleet), places_per_slot(c.fleet))
    columns, rows = c.size
    if columns * rows * c.communication_slots * ways > MOST_ENTRIES:
        yield (
            "grid, nodes, communication_slots, fleet: too large together; allowed: 5 * grid^2 * "
            f"nodes * communication_slots <= {MOST_ENTRIES}, and less with slots_per_cell"
        )
    charted = len(c.nodes) + sum(width * height for *_, width, height in c.rectangles)
    if c.no_fly and columns * rows > MOST_CHARTED and charted * columns * rows > MOST_CHARTED**2:
        yield (
            f"no_fly: the {columns} x {rows} grid is too large; allowed: at most "
            f"{MOST_CHARTED**2 // (columns * rows):,} nodes and cells of zones on so many cells"
        )
    has_teeth = c.age.measured and not c.needs_events
    if has_teeth and c.max_slots * c.communication_slots > MOST_TEETH:
        yield (
            "age.measured: the mission has too many communication slots; allowed: "
            f"max_slots * communication_slots <= {MOST_TEETH}"
        )
    if c.packets > MOST_PACKETS:
        yield (
            f"arrivals: {c.packets:,.0f} packets at the highest rate; allowed: "
            f"{MOST_PACKETS:,} at most (rates of all nodes * highest factor * max_slots)"
        )


def _unreachable(c: Fields) -> Iterator[str]:
    """The cells of zones and nodes that no UAV can reach from the start zone."""
    if not c.no_fly:
        return
    zones = zones_of(*c.size, (), c.no_fly)
    x, y, *_ = c.zone
    ways = spread(zones, np.array([[x, y]]))[0].reshape(zones.shape)
    for name, cells, names in (("zone", parking_of(c.rectangles), ()), ("nodes", c.nodes, c.names)):
        cut = [n for n, cell in enumerate(cells) if ways[cell[::-1]] == FAR]
        closed = [n for n in cut if zones[cells[n][::-1]] == NO_FLY]
        lost = [n for n in cut if n not in closed and zones[y, x] != NO_FLY]
        kind = "no-fly cells"
        if len(closed) == 1:
            kind = "a no-fly cell"
        problems = []
        if closed:
            problems = [f"{_titles(closed, cells, names)} {kind}"]
        if lost:
            problems.append(f"{_titles(lost, cells, names, ('cannot', 'cannot'))} be reached")
        if problems:
            allowed = "cells with a way from the start zone"
            yield f"{name}: {', and '.join(problems)}; allowed: {allowed}"


def _unfit(c: Fields) -> Iterator[str]:
    """The rates, the pads and the initial data fit to the nodes and the zones."""
    count = len(c.nodes)
    low, high = c.initial_data
    if c.data_sheet.is_on:
        if c.data_sheet.data_rate is None:
            yield f"data_sheet.data_rate: is missing; allowed: {DataSheet.form_of('data_rate')}"
        full = c.data_sheet.fields()["charge_complete"]
        for name in ("flying_time", "charge_complete"):
            if np.max(c.value(name)) > full:
                yield f"{name}: {c.value(name)} is more than the reserve leaves; allowed: {full}"
    if c.quota == 0 and not c.landing:
        yield "quota: 0 needs landing; allowed: 1..1000000, or landing = true"
    for name in ("names", "arrivals.rates", "arrivals.initial", "arrivals.merged"):
        if len(c.value(name)) not in (0, count):
            yield f"{name}: there are {len(c.value(name))}; allowed: {count}, one per node"
    if max(c.node_rates) > MOST_RATE:
        yield f"arrivals.merged: a node has the rate {max(c.node_rates):g}; allowed: {MOST_RATE}"
    for number, ((*_, width, height), pads) in enumerate(
        zip(c.rectangles, c.zone_pads, strict=True)
    ):
        name = "pads"
        if number:
            name = f"zones.{number - 1}.pads"
        cells = width * height
        if pads > cells:
            yield f"{name}: {pads} is more than the zone has cells; allowed: 1..{cells}"
    if 0 < c.radio.range <= c.altitude:
        yield f"radio.range: {c.radio.range:g} m is too short; allowed: above {c.altitude:g} m"
    if c.failures.pad_rate > 0 and c.charging_pads > MOST_PADS:
        yield f"pads: {c.charging_pads} are too many to fail; allowed: {MOST_PADS} at most"
    if not 0 <= low <= high <= MOST_DATA:
        yield (
            f"initial_data: {[low, high]} is not a range; allowed: a number 0..{MOST_DATA:,} "
            f"or [low, high] with 0 <= low <= high <= {MOST_DATA:,}"
        )
