"""What the tests draw: scenarios off the paper's, and policies that stress them."""

from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from hypothesis import strategies as st

from dess.model.state import HOVER, STEP_X, STEP_Y
from dess.model.view import View
from dess.physics import streams
from dess.physics.energy import Wind
from dess.scenario.scenario import Scenario, ScenarioSpace
from tests import compiled

NORTH, EAST, SOUTH, WEST = range(4)

seeds = st.integers(0, streams.MAX_SEED)
replications = st.integers(0, streams.MAX_REPLICATION)


def _numbers(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_subnormal=False)


def _ranges(low: int, high: int) -> st.SearchStrategy[tuple[int, int]]:
    return st.tuples(st.integers(low, high), st.integers(low, high)).map(
        lambda pair: (min(pair), max(pair))
    )


Cell = tuple[int, int]
# The geometry of the paper, which observations for learning need.
PLAIN_SEA: dict[str, Any] = {"rows": None, "zones": (), "no_fly": ()}


def cells(grid: int, rows: int | None = None) -> st.SearchStrategy[Cell]:
    """Cells of a grid."""
    return st.tuples(st.integers(0, grid - 1), st.integers(0, (rows or grid) - 1))


def _in_rectangle(x: int, y: int, width: int, height: int) -> set[Cell]:
    return {(x + i, y + j) for i in range(width) for j in range(height)}


@st.composite
def _rectangles(draw: st.DrawFn, grid: int, rows: int, width: int, height: int) -> Any:
    """A rectangle of at most that size on a grid: x, y, width, height."""
    width, height = (draw(st.integers(1, m)) for m in (min(width, grid), min(height, rows)))
    return draw(st.integers(0, grid - width)), draw(st.integers(0, rows - height)), width, height


def reached(start: Cell, grid: int, rows: int, no_fly: Iterable[Cell]) -> Mapping[Cell, int]:
    """The cells with a way from a cell, and the length of the shortest."""
    return _reached(start, grid, rows, frozenset(no_fly))


@lru_cache(maxsize=4096)
def _reached(start: Cell, grid: int, rows: int, no_fly: frozenset[Cell]) -> Mapping[Cell, int]:
    ways, edge = {start: 0}, [start]
    for x, y in edge:
        for cell in ((x, y - 1), (x + 1, y), (x, y + 1), (x - 1, y)):
            on_grid = 0 <= cell[0] < grid and 0 <= cell[1] < rows
            if on_grid and cell not in no_fly and cell not in ways:
                ways[cell] = ways[x, y] + 1
                edge.append(cell)
    return ways


@st.composite
def seas(draw: st.DrawFn, nodes: Any = None, **fixed: Any) -> dict[str, Any]:
    """The geometry of a sea: a third of the paper's kind, the others with all that it has not."""
    grid = fixed.get("grid") or draw(st.integers(4, 12))
    is_plain = {*PLAIN_SEA} <= {*fixed} or draw(st.sampled_from([True, False, False]))
    rows = None if is_plain else draw(st.integers(4, 12))
    size = grid, rows or grid
    zone = fixed.get("zone") or draw(_rectangles(*size, 4, 3))
    nodes = nodes or draw(st.lists(cells(*size), min_size=1, max_size=9, unique=True))
    sea = {"grid": grid, "rows": rows, "zone": zone, "nodes": tuple(nodes)}
    if is_plain:
        return sea
    zones, taken = [], _in_rectangle(*zone)
    for cells_of in draw(st.lists(_rectangles(*size, 3, 2), min_size=1, max_size=3)):
        if not taken & _in_rectangle(*cells_of):
            taken |= _in_rectangle(*cells_of)
            zones.append({"cells": cells_of, "pads": draw(st.sampled_from([1, None]))})
    # Coasts and islands, each of which leaves a way to all zones and nodes.
    no_fly, kept = set[Cell](), taken | {*nodes}
    for island in draw(
        st.lists(_rectangles(*size, 7, 7) | _rectangles(*size, 9, 1), min_size=2, max_size=5)
    ):
        more = no_fly | _in_rectangle(*island) - kept
        if kept <= {*reached(zone[:2], *size, more)}:
            no_fly = more
    return sea | {"zones": tuple(zones), "no_fly": tuple(sorted(no_fly))}


@st.composite
def spaces(draw: st.DrawFn, **fixed: Any) -> ScenarioSpace:
    """Small, odd scenario spaces: fleets of up to 6, few pads, all constants off the paper's."""
    sea = draw(seas(**fixed))
    spots = sea["zone"][2] * sea["zone"][3]
    start = draw(_ranges(10, 50))
    values = {
        **sea,
        "uavs": draw(_ranges(1, min(6, spots))),
        "pads": draw(st.sampled_from([1, min(2, spots), None])),
        "cell_size": draw(_numbers(1.0, 1000.0)),
        "altitude": draw(_numbers(1.0, 200.0)),
        "forbid_swaps": draw(st.booleans()),
        "slot_length": draw(_numbers(0.2, 3.0)),
        "communication_slots": draw(st.integers(1, 9)),
        "max_slots": draw(st.integers(20, 120)),
        "charge_rate": draw(st.integers(1, 25)),
        "flight_cost": draw(st.sampled_from([1, 1, 1, 0])),
        "edge_snr": draw(_numbers(-30.0, 10.0)),
        "path_loss_exponent": draw(_numbers(1.5, 4.0)),
        "shadowing_variance": draw(st.just(0.0) | _numbers(0.5, 30.0)),
        "initial_data": (0.0, draw(_numbers(0.0, 40.0))),
        "arrival_rate": draw(st.just(0.0) | _numbers(0.01, 1.0)),
        "quota": draw(st.integers(5, 600)),
        "reward_data": draw(_numbers(-2.0, 2.0)),
        "reward_overruled": draw(_numbers(-5.0, 0.0)),
        "reward_depleted": draw(_numbers(-300.0, 0.0)),
        "reward_charging": draw(_numbers(0.0, 1.0)),
        "reward_quota": draw(_numbers(0.0, 100.0)),
        "reward_step": draw(_numbers(-1.0, 0.0)),
        "flying_time": draw(_ranges(8, 80)),
        "charge_start": start,
        "charge_complete": draw(_ranges(start[1] + 1, 100)),
    }
    return ScenarioSpace.of(**(values | fixed))


_uav_types = st.fixed_dictionaries(
    {},
    optional={
        "flying_time": st.integers(8, 80),
        "slots_per_cell": st.integers(1, 4),
        "quota": st.integers(5, 600),
        "rate": _numbers(0.1, 10.0),
    },
)


# What slots take of the battery in each direction and when hovering [% / 1000].
_costs = st.tuples(*[st.integers(1, 999) | st.integers(1000, 4000)] * 5)


@st.composite
def failures(draw: st.DrawFn) -> dict[str, Any]:
    """A section of failures: each kind happens often, seldom or not at all."""
    values: dict[str, Any] = {}
    for kind in ("uav", "pad", "node"):
        values[f"{kind}_rate"] = draw(st.sampled_from([0.0, 0.01, 0.2, 1.0]))
        values[f"{kind}_repair"] = draw(st.sampled_from([0.0, 1.0, 6.0]))
    for kind in ("uav", "node"):
        values[f"{kind}_data"] = draw(st.sampled_from(["kept", "lost"]))
    return values


@st.composite
def radios(draw: st.DrawFn) -> dict[str, Any]:
    """A radio whose rate grows with the SNR, or has steps."""
    values: dict[str, Any] = {
        "anchor": draw(st.just(0.0) | _numbers(10.0, 3000.0)),
        "range": draw(st.just(0.0) | _numbers(201.0, 3000.0)),
        "duty_cycle": draw(st.just(1.0) | _numbers(0.01, 1.0)),
    }
    if draw(st.booleans()):
        return values | {"max_rate": draw(st.just(0.0) | _numbers(0.1, 5.0))}
    levels = draw(st.lists(st.integers(-40, 40), min_size=1, max_size=6, unique=True).map(sorted))
    return values | {"steps": [(snr, 0.2 * (n + 1)) for n, snr in enumerate(levels)]}


@st.composite
def extended_spaces(draw: st.DrawFn, **fixed: Any) -> ScenarioSpace:
    """Spaces whose sections beyond the paper are on or off, those that both engines have."""
    strengths = st.just(0.0) | _numbers(0.0, 10.0)
    sections = {
        "age": {
            "measured": draw(st.booleans()),
            "reward": draw(st.just(0.0) | _numbers(-2.0, 2.0)),
        },
        "charging": {
            "order": draw(st.sampled_from(["first-come", "lowest-battery"])),
            "power": draw(st.sampled_from([0, 0, 3, 17])),
            "measured": draw(st.booleans()),
        },
        "failures": draw(st.just({}) | failures()),
        "wind": {
            "strength": draw(strengths),
            "direction": draw(_numbers(0.0, 360.0)),
            "moves": draw(st.just((0.0,) * 4) | st.tuples(*[strengths] * 4)),
            "gusts": draw(st.just(0.0) | _numbers(0.0, 10.0)),
            "seed": draw(st.integers(0, 2**32 - 1)),
        },
        "consumption": {"slots": draw(st.just([]) | st.lists(_costs, min_size=8, max_size=8))},
        # With at most eleven decimals, a rate is exact (``charge_fraction``).
        "charge_rate": draw(
            st.integers(1, 25) | _numbers(0.2, 20.0).map(lambda rate: round(rate, 11))
        ),
        "radio": draw(radios()),
        "arrivals": {"message": draw(st.sampled_from([0.0, 0.003, 0.1, 2.5]))},
        "fleet": draw(st.lists(_uav_types, max_size=3)),
        "landing": draw(st.booleans()),
    }
    if (sections | fixed)["landing"] and draw(st.booleans()):
        sections["quota"] = 0
    values = sections | fixed
    if values["consumption"]["slots"]:
        values["wind"] = Wind.off().model_dump()
    wind, slots = values["wind"], [of.get("slots_per_cell", 1) for of in values["fleet"]]
    is_calm = not any((wind["strength"], *wind["moves"], wind["gusts"]))
    is_calm = is_calm and not values["consumption"]["slots"]
    if max(slots, default=1) == 1 and is_calm:
        # For seas with islands, guard and heuristics would be compiled once more.
        values = PLAIN_SEA | values
    space = draw(spaces(**values))
    if values["failures"] and draw(st.booleans()):
        return ScenarioSpace.of(space, **draw(_failures_of_zones(len(space.rectangles))))
    return space


@st.composite
def _failures_of_zones(draw: st.DrawFn, zones: int) -> dict[str, Any]:
    """Failures of pads that differ from zone to zone."""
    rates = st.lists(st.sampled_from([0.0, 0.2, 1.0]), min_size=zones, max_size=zones)
    repairs = st.lists(st.sampled_from([0.0, 1.0, 6.0]), min_size=zones, max_size=zones)
    return {
        **{"failures.pad_rate": 0.0, "failures.pad_rates": draw(rates)},
        **{"failures.pad_repair": 0.0, "failures.pad_repairs": draw(repairs)},
    }


_winds_in_units = st.builds(
    lambda speed, direction: f"{speed} m/s from {direction} deg",
    st.integers(0, 8),
    st.integers(0, 360),
)


@st.composite
def sheet_spaces(draw: st.DrawFn) -> ScenarioSpace:
    """Spaces with a data sheet: rates in steps or not, few large messages or many small ones."""
    minutes = draw(st.integers(10, 60))
    speed = draw(st.integers(4, 20))
    radio: dict[str, Any] = draw(
        st.sampled_from(
            [
                {"modulation": "lora", "bandwidth": "125 kHz"},
                {"rates": [["-3 dB", "1 Mbit/s"], ["4 dB", "20 Mbit/s"]], "bandwidth": "20 MHz"},
                {"max_rate": "2 bit/s/Hz", "bandwidth": "500 kHz"},
                {"bandwidth": "125 kHz"},
            ]
        )
    )
    sheet = {
        "endurance": f"{minutes} min",
        "cruise": f"{speed} m/s",
        "max_speed": "30 m/s",  # at 20 m/s over ground, 10 m/s of wind from anywhere
        "wind": draw(st.none() | _winds_in_units),
        "hover": draw(st.sampled_from([None, f"{minutes} min"])),
        "induced_speed": "8 m/s",
        "charging": f"{draw(st.integers(5, 90))} min",
        "reserve": draw(st.sampled_from([None, "10 %"])),
        "horizon": f"{minutes * 60 * draw(st.integers(20, 120)) / 100} s",
        "data_rate": draw(st.sampled_from(["0 B/h", "20 kB/h", "3 MB/h", "90 MB/h"])),
        "message": draw(st.sampled_from(["100 B", "1 kB", "2 MB"])),
        "backlog": draw(st.sampled_from(["0 B", "5 MB"])),
        "idle": draw(st.sampled_from([None, "1 h", "16 h"])),
        "snr": f"{draw(st.integers(-20, 20))} dB at {draw(st.integers(1, 3))} km",
        "altitude": f"{draw(st.integers(1, 500))} m",
        "duty_cycle": draw(st.sampled_from(["1 %", "100 %"])),
    }
    sea = draw(seas(**PLAIN_SEA))
    spots = sea["zone"][2] * sea["zone"][3]
    values = {
        **sea,
        "uavs": draw(_ranges(1, min(4, spots))),
        "pads": 1,
        "age": {"measured": True},
        "fleet": draw(st.lists(_types_in_units(minutes, speed), max_size=3)),
        "charge_start": 10,
        "charge_complete": draw(st.sampled_from([(70, 80), 90])),
        "data_sheet": sheet | radio,
    }
    return ScenarioSpace.of(**values)


def _types_in_units(minutes: int, speed: int) -> st.SearchStrategy[dict[str, Any]]:
    """Types of UAVs beside a data sheet with this endurance [min] and this speed [m/s]."""
    shares = st.integers(30, 100).map(lambda percent: minutes * percent / 100)
    return st.fixed_dictionaries(
        {},
        optional={
            "endurance": shares.map(lambda time: f"{time} min"),
            "charging": st.integers(5, 90).map(lambda time: f"{time} min"),
            "cruise": st.integers(1, 4).map(lambda slots: f"{speed / slots:.4f} m/s"),
            "rate": _numbers(0.1, 10.0),
        },
    )


@st.composite
def continuous_spaces(draw: st.DrawFn, **fixed: Any) -> ScenarioSpace:
    """Spaces whose packets arrive in continuous time; only the SimPy engine has them."""
    nodes = draw(st.lists(cells(4), min_size=1, max_size=5, unique=True))
    slots = draw(st.lists(st.integers(0, 30), max_size=3, unique=True).map(sorted))
    arrivals = {
        "process": "continuous",
        "message": draw(st.sampled_from([0.0, 0.05, 2.5])),
        "rates": draw(st.just([]) | st.just([draw(_numbers(0.0, 2.0)) for _ in nodes])),
        "schedule": [[slot, draw(_numbers(0.0, 3.0))] for slot in slots],
        "buffer": draw(st.sampled_from([0, 1, 2, 5])),
        "service": draw(st.sampled_from(["oldest", "newest"])),
    }
    values = {"nodes": nodes, "arrivals": arrivals, "age": {"measured": True}, "max_slots": 30}
    return draw(extended_spaces(**(values | fixed)))


@st.composite
def scenarios(draw: st.DrawFn, **fixed: Any) -> Scenario:
    """Single scenarios: a corner of a drawn space."""
    space = draw(spaces(**fixed))
    low = {name: getattr(space, name)[0] for name in ("flying_time", "charge_start")}
    high = {name: getattr(space, name)[1] for name in ("uavs", "charge_complete")}
    return space.scenario_at(**low, **high)


def random_actions(view: View, legal: Any = None) -> np.ndarray:
    """(R,) random actions of the legal ones, or of others, from the policies' own stream."""
    constants, legal = view.constants, view.legal if legal is None else legal
    words = [
        streams.block(c["seed"], c["replication"], streams.POLICY, 0, c["slot"], i)[0]
        for c, i in zip(constants, view.uav, strict=True)
    ]
    choices = legal.sum(1)
    pick = np.array([streams.integer(w, 0, n - 1) for w, n in zip(words, choices, strict=True)])
    return np.argmax(legal.cumsum(1) > pick[:, None], 1)


class Wanderer:
    """Random legal moves: the neighbours are always in the way."""

    name = "wanderer"

    def act(self, view: View) -> np.ndarray:
        return random_actions(view)


class Commuter:
    """Wanders while the battery lasts, then makes for the zone and hovers there until charged.

    With fewer pads than UAVs it queues; all make for their own cell, of each zone in turn, around
    islands, but take no notice of others.
    """

    name = "commuter"

    def act(self, view: View) -> np.ndarray:
        own, chart = view.own, view.world.chart
        zones = chart.zones[chart.parking[:, 1], chart.parking[:, 0]]
        places = np.arange(len(zones)) - np.searchsorted(zones, zones)  # in their zones
        spots = chart.parking[np.lexsort((zones, places))][view.uav % len(zones)]
        x, y = own["x"][:, None] + STEP_X, own["y"][:, None] + STEP_Y
        steps = compiled.distances(chart, x.ravel(), y.ravel(), np.repeat(spots, 5, axis=0))
        steps = steps.reshape(x.shape)
        must = own["latch"] | (own["battery"] <= steps[:, HOVER] + 3)
        return np.where(must, steps.argmin(1), random_actions(view))


class Fidget(Commuter):
    """Commutes, but now and then does anything else: it leaves queues, even with a pad granted.

    It also asks for moves off the grid and into no-fly cells.
    """

    name = "fidget"

    def act(self, view: View) -> np.ndarray:
        restless = (view.constants["slot"] + 3 * view.uav) % 4 == 0
        return np.where(restless, random_actions(view, np.ones((len(view), 5))), super().act(view))


class Script:
    """Flies a fixed list of actions per UAV, e.g. ``Script("NESW.", "....")``; then hovers.

    The letters are N, E, S, W and ``.`` for Hover.
    """

    name = "script"

    def __init__(self, *routes: str):
        self.routes = routes

    def act(self, view: View) -> np.ndarray:
        slots = view.constants["slot"]
        routes = [self.routes[i] for i in view.uav]
        return np.array(
            [
                "NESW.".index(r[t]) if t < len(r) else HOVER
                for r, t in zip(routes, slots, strict=True)
            ]
        )


class Recorder:
    """Another policy, and what it asked for: ``asked[slot, uav]`` is the action."""

    def __init__(self, policy: Any):
        self.policy, self.name = policy, policy.name
        self.asked: dict[tuple[int, int], int] = {}

    def act(self, view: View) -> np.ndarray:
        actions = self.policy.act(view)
        slots = view.constants["slot"]
        for slot, uav, action in zip(slots, view.uav, actions, strict=True):
            self.asked[int(slot), int(uav)] = int(action)
        return actions


class Checked:
    """Another policy whose decisions are checked: they are allowed, and independent of other rows.

    ``allowed(view)`` is the mask of the allowed actions.
    """

    def __init__(self, policy: Any, allowed: Callable[[View], np.ndarray]):
        self.policy, self.name, self.allowed = policy, policy.name, allowed

    def act(self, view: View) -> np.ndarray:
        before = [array.tobytes() for array in view.state]
        actions = self.policy.act(view)
        assert [array.tobytes() for array in view.state] == before
        assert self.allowed(view)[np.arange(len(view)), actions].all()
        backwards = View(view.state, view.world, view.mission[::-1].copy(), view.uav[::-1].copy())
        assert self.policy.act(backwards).tolist() == actions[::-1].tolist()
        last = View(view.state, view.world, view.mission[-1:], view.uav[-1:])
        assert self.policy.act(last).tolist() == [actions[-1]]
        return actions


policies = st.sampled_from([Wanderer(), Commuter(), Fidget()])
teams = policies.map(lambda policy: [policy]) | st.lists(policies, min_size=2, max_size=3)
