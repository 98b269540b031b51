"""What no field of a scenario can check alone: its zones, its size, its ways, its rates."""

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from dess.base.errors import InputError, listed, shown
from dess.physics.age import MOST_AGES
from dess.physics.arrivals import MOST_AMOUNT, MOST_MESSAGES, MOST_RATE
from dess.physics.chart import FAR, MOST_CHARTED, NO_FLY, Cell, parking_of, spread, zones_of
from dess.physics.energy import MOST_COST, PERCENT
from dess.physics.failures import MOST_PADS
from dess.physics.fleet import IN_UNITS, move_phases, places_per_slot, slowest
from dess.scenario.data_sheet import DataSheet
from dess.scenario.fields import MOST_DATA, Fields
from dess.scenario.projection import Projection
from dess.scenario.weather import ALWAYS, DAYLIGHT

# Largest number of packets of a mission with continuous arrivals, at their highest rate: some 70
# bytes each, and less than a second of compiled code to draw them all.
MOST_PACKETS = 2_000_000

# Shortest distance at which the SNR is known [m]; ratios of distances to it are finite.
NEAREST = 0.001

# The error of distances from which on a sea is told, and refused.
TOLD_ERROR, MOST_ERROR = 0.01, 0.05

# Largest number of entries in the table of dess.model.channel: 8 GiB if all of it were filled.
MOST_ENTRIES = 2**30


def problems(c: Fields) -> Iterator[InputError]:
    """What is wrong with a scenario, each with what is allowed."""
    for check in (_off_the_grid, _distorted, _too_large, _unreachable, _unfit, _unfit_weather):
        yield from check(c)


def distance_error(c: Fields) -> float:
    """The largest error of distances between nodes and zones, as a share; 0 without degrees."""
    if not c.centre:
        return 0.0
    corners = [(x + i * w, y + i * h) for x, y, w, h in c.rectangles for i in (0, 1)]
    places = np.concatenate([np.array(c.nodes) + 0.5, corners])
    return Projection(c.centre, c.size, c.cell_size).distance_error(places)


def distance_sentence(c: Fields) -> str:
    """How wrong distances are by the projection."""
    error = f"{100 * distance_error(c):.2g} %"
    return f"distances between nodes and zones are up to {error} wrong, by the projection"


def _distorted(c: Fields) -> Iterator[InputError]:
    """The sea is so small that one projection does for all of it."""
    if distance_error(c) >= MOST_ERROR:
        allowed = f"less than {100 * MOST_ERROR:g} %: a sea of fewer degrees of latitude"
        yield InputError(
            "centre", distance_sentence(c), f"{allowed}, or cells of another projection"
        )


def _off_the_grid(c: Fields) -> Iterator[InputError]:
    columns, rows = c.size
    cells: Counter[Cell] = Counter()
    for number, (x, y, width, height) in enumerate(c.rectangles):
        name = "zone"
        if number:
            name = f"zones.{number - 1}.cells"
        if min(x, y) < 0 or min(width, height) < 1 or x + width > columns or y + height > rows:
            yield InputError(
                name,
                f"{[x, y, width, height]} does not lie on the {columns} x {rows} grid",
                "[x, y, width, height] with 0 <= x, y and x + width, y + height <= grid",
            )
            return
        cells.update((x + i % width, y + i // width) for i in range(width * height))
    for cell, count in cells.items():
        if count > 1:
            problem = f"two zones have the cell {[*cell]}"
            yield InputError("zones", problem, "zones without common cells")
    size = f"0 <= x, y < {columns}"
    if c.rows:
        size = f"0 <= x < {columns}, 0 <= y < {rows}"
    for name, names in (("nodes", c.names), ("no_fly", ())):
        places = getattr(c, name)
        beyond = [n for n, (x, y) in enumerate(places) if not (0 <= x < columns and 0 <= y < rows)]
        if beyond:
            yield InputError(name, f"{_titles(beyond, places, names)} off the grid", size)
        if twice := [places.index(cell) for cell, count in Counter(places).items() if count > 1]:
            problem = f"{_titles(twice, places, names)} listed twice"
            yield InputError(name, problem, "distinct cells")


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


def _too_large(c: Fields) -> Iterator[InputError]:
    """The tables of a mission fit into memory."""
    ways = max(5 * len(c.nodes) * move_phases(c.fleet), places_per_slot(c.fleet))
    columns, rows = c.size
    if columns * rows * c.communication_slots * ways > MOST_ENTRIES:
        yield InputError(
            "grid, nodes, communication_slots, fleet",
            "too large together",
            f"5 * grid^2 * nodes * communication_slots <= {MOST_ENTRIES}, and less with "
            "slots_per_cell",
        )
    charted = len(c.nodes) + sum(width * height for *_, width, height in c.rectangles)
    if c.no_fly and columns * rows > MOST_CHARTED and charted * columns * rows > MOST_CHARTED**2:
        most = MOST_CHARTED**2 // (columns * rows)
        yield InputError(
            "no_fly",
            f"the {columns} x {rows} grid is too large",
            f"at most {most:,} nodes and cells of zones on so many cells",
        )
    counts_peaks = c.age.measured and not c.needs_events
    if counts_peaks and (c.max_slots + c.idle_slots) * c.communication_slots > MOST_AGES:
        yield InputError(
            "age.measured",
            "the mission has too many communication slots",
            f"max_slots * communication_slots <= {MOST_AGES}, with the slots of idle",
        )
    if c.idle_slots and c.needs_events:
        yield InputError("data_sheet.idle", "needs slotted arrivals", "without it, or slotted")
    if c.idle_slots and np.max(c.node_data) > MOST_AMOUNT:
        problem = f"a node has {np.max(c.node_data):,.3g} data units at the start"
        yield InputError("data_sheet.idle", problem, f"{MOST_AMOUNT:g} data units at most")
    if c.packets > MOST_PACKETS:
        yield InputError(
            "arrivals",
            f"{c.packets:,.0f} packets at the highest rate",
            f"{MOST_PACKETS:,} at most (rates of all nodes * highest factor * max_slots)",
        )


def _unreachable(c: Fields) -> Iterator[InputError]:
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
            yield InputError(name, ", and ".join(problems), allowed)


def _unfit(c: Fields) -> Iterator[InputError]:
    """The rates, the pads and the initial data fit to the nodes and the zones."""
    count = len(c.nodes)
    low, high = c.initial_data
    if c.data_sheet.is_on:
        if c.data_sheet.data_rate is None:
            form = DataSheet.form_of("data_rate")
            yield InputError("data_sheet.data_rate", "is missing", form)
        full = c.data_sheet.fields()["charge_complete"]
        for name in ("flying_time", "charge_complete"):
            if np.max(c.value(name)) > full:
                problem = f"{c.value(name)} is more than the reserve leaves"
                yield InputError(name, problem, str(full))
    yield from _unfit_to_fly(c)
    if 0 < c.radio.anchor < NEAREST:
        yield InputError("radio.anchor", f"{c.radio.anchor:g} m is too near", "0, or 0.001..1e6")
    if c.quota == 0 and not c.landing:
        yield InputError("quota", "0 needs landing", "1..1000000, or landing = true")
    for name in ("names", "arrivals.rates", "arrivals.initial", "arrivals.merged"):
        if len(c.value(name)) not in (0, count):
            problem = f"there are {len(c.value(name))}"
            yield InputError(name, problem, f"{count}, one per node")
    if max(c.node_rates) > MOST_RATE:
        problem = f"a node has the rate {max(c.node_rates):g}"
        yield InputError("arrivals.merged", problem, str(MOST_RATE))
    if c.needs_events and c.arrivals.message and max(c.message_rates) > MOST_MESSAGES:
        problem = f"a node makes {max(c.message_rates):,.4g} messages in a slot, each a packet"
        yield InputError("arrivals.process", problem, f"{MOST_MESSAGES} at most, or slotted")
    for number, ((*_, width, height), pads) in enumerate(
        zip(c.rectangles, c.zone_pads, strict=True)
    ):
        name = "pads"
        if number:
            name = f"zones.{number - 1}.pads"
        cells = width * height
        if pads > cells:
            yield InputError(name, f"{pads} is more than the zone has cells", f"1..{cells}")
    if 0 < c.radio.range <= c.altitude:
        problem = f"{c.radio.range:g} m is too short"
        yield InputError("radio.range", problem, f"above {c.altitude:g} m")
    zones = len(c.rectangles)
    for name, field in (("pad_rates", "pad_mtbf"), ("pad_repairs", "pad_repair")):
        number = len(getattr(c.failures, name))
        if number not in (0, zones):
            where = f"failures.{name}"
            if c.data_sheet.is_on:
                where = f"data_sheet.{field}"
            yield InputError(where, f"there are {number}", f"{zones}, one for each zone")
    if c.failures.largest_pad_rate > 0 and c.charging_pads > MOST_PADS:
        problem = f"{c.charging_pads} are too many to fail"
        yield InputError("pads", problem, f"{MOST_PADS} at most")
    if not 0 <= low <= high <= MOST_DATA:
        yield InputError(
            "initial_data",
            f"{[low, high]} is not a range",
            f"a number 0..{MOST_DATA:,} or [low, high] with 0 <= low <= high <= {MOST_DATA:,}",
        )


def _unfit_weather(c: Fields) -> Iterator[InputError]:
    """Weather has a data sheet that tells in which of it UAVs can fly, and a sea under its sun."""
    weather = c.weather
    if not weather.is_on:
        return
    if not c.data_sheet.is_on:
        yield InputError("weather", "needs a data sheet", "a data_sheet with max_speed")
        return
    if not c.data_sheet.max_speed:
        form = DataSheet.form_of("max_speed")
        yield InputError("data_sheet.max_speed", "is missing, and weather needs it", form)
    if c.quota or not c.landing:
        yield InputError(
            "weather", "needs quota = 0 and landing = true", "as a data sheet has them"
        )
    if c.needs_events:
        yield InputError("weather", "needs slotted arrivals", 'arrivals.process = "slotted"')
    if weather.operating == DAYLIGHT and c.centre is None:
        allowed = "nodes or zones in degrees, or centre; always, or hours such as 06:00-18:00"
        yield InputError("weather.operating", "daylight needs a sea with degrees", allowed)
    has_clock = weather.operating not in (ALWAYS, DAYLIGHT)
    if has_clock and c.centre is None and weather.longitude is None:
        allowed = "weather.longitude, or nodes or zones in degrees"
        yield InputError("weather.operating", "solar time needs a longitude", allowed)


def _unfit_to_fly(c: Fields) -> Iterator[InputError]:
    """What slots take of the battery fits to the wind and to the speeds of the fleet."""
    yield from _unfit_types(c)
    if not c.consumption.is_on:
        return
    if c.wind.is_on:
        beside = "consumption"
        if c.data_sheet.is_on:
            beside = "data_sheet"
        yield InputError("wind", f"is given beside {beside}", "one of both")
    slots = slowest(c.fleet)
    if slots > len(c.consumption.slots):
        problem = f"there are costs for {len(c.consumption.slots)} speeds"
        yield InputError("consumption.slots", problem, f"{slots}, one for each slots_per_cell")
    highest = max(max(costs) for costs in c.consumption.slots[:slots])
    if highest > MOST_COST:
        problem = f"a slot takes {highest / PERCENT:.1f} %"
        yield InputError("consumption.slots", problem, f"{MOST_COST // PERCENT} % at most")


def _unfit_types(c: Fields) -> Iterator[InputError]:
    """Types of UAVs have units beside a data sheet alone, and batteries that charging fits to."""
    for number, kind in enumerate(c.fleet):
        in_units = [name for name in IN_UNITS if getattr(kind, name) is not None]
        if in_units and not c.data_sheet.is_on:
            allowed = "a data_sheet, or flying_time and slots_per_cell in place of units"
            yield InputError(f"fleet.{number}.{in_units[0]}", "needs a data sheet", allowed)
            return
        if not c.data_sheet.is_on:
            continue
        full = c.data_sheet.battery_of_type(kind)
        start = np.max(c.value("charge_start"))
        if kind.flying_time is not None and kind.flying_time > full:
            problem = f"{kind.flying_time} is more than the reserve leaves"
            yield InputError(f"fleet.{number}.flying_time", problem, str(full))
        if kind.endurance is not None and full <= start:
            problem = f"{shown(kind.endurance)} is {full} % of a battery, less the reserve"
            allowed = f"more than charge_start, {start} %"
            yield InputError(f"fleet.{number}.endurance", problem, allowed)
