"""A sea that is mirrored, turned or numbered otherwise is the same sea for rules and policies."""

import math
from collections.abc import Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from hypothesis import assume, event, given, settings
from hypothesis import strategies as st

from dess import policies
from dess.channel import world_of
from dess.guard import guard
from dess.policies.heuristics import _AGE, _GREEDY, _NEAREST
from dess.rules import launch
from dess.scenario import ScenarioSpace
from dess.sections.wind import reach_of
from dess.state import HOVER, STEP_X, STEP_Y, State, starts_of, state_of
from dess.view import View
from tests import compiled
from tests.drawn import Cell, reached, spaces

STEPS = list(zip(STEP_X.tolist(), STEP_Y.tolist(), strict=True))


class Turn(NamedTuple):
    """One of the eight symmetries of a sea of W x H cells: x and y change places, then mirrors."""

    transposed: bool
    west_east: bool
    north_south: bool
    size: tuple[int, int]

    @property
    def turned_size(self) -> tuple[int, int]:
        return self.size[::-1] if self.transposed else self.size

    def cell(self, x: int, y: int) -> Cell:
        width, height = self.turned_size
        x, y = (y, x) if self.transposed else (x, y)
        return width - 1 - x if self.west_east else x, height - 1 - y if self.north_south else y

    def rectangle(self, x: int, y: int, width: int, height: int) -> tuple[int, ...]:
        corners = self.cell(x, y), self.cell(x + width - 1, y + height - 1)
        (left, top), (right, bottom) = map(min, *corners), map(max, *corners)
        return left, top, right - left + 1, bottom - top + 1

    @property
    def actions(self) -> np.ndarray:
        """Which action an action becomes."""
        x, y = self.cell(0, 0)
        turned = [(a - x, b - y) for a, b in (self.cell(*step) for step in STEPS)]
        return np.array([STEPS.index(step) for step in turned])

    def sea(self, space: ScenarioSpace) -> ScenarioSpace:
        """The sea turned; the wind blows from where an action of its direction leads."""
        grid, rows = self.turned_size
        comes_from = self.actions[int(space.wind.direction) // 90]
        return ScenarioSpace.of(
            space,
            **{"grid": grid, "rows": rows, "zone": self.rectangle(*space.zone)},
            zones=[{"cells": self.rectangle(*z.cells), "pads": z.pads} for z in space.zones],
            nodes=[self.cell(*node) for node in space.nodes],
            no_fly=[self.cell(*cell) for cell in space.no_fly],
            **{"wind.direction": 90.0 * comes_from},
        )


class Sea(NamedTuple):
    """A sea and a mission on it, in the middle of which all UAVs are anywhere."""

    space: ScenarioSpace
    state: State

    @property
    def view(self) -> View:
        """All UAVs that act."""
        team = self.state.uavs[0]
        rows = np.nonzero(team["active"] & ~team["charging"] & (team["slots_left"] == 0))[0]
        return View(self.state, world_of(self.space), np.zeros(len(rows), int), rows)


def _sea(space: ScenarioSpace, team: Sequence[dict[str, Any]], data: np.ndarray) -> Sea:
    state, chart = state_of([space], 1), space.chart
    launch(state, 0, starts_of([space], 1), 0, 0)
    for u, values in zip(state.uavs[0], team, strict=True):
        for name, value in values.items():
            u[name] = value
        u["zone"] = chart.zones[u["y"], u["x"]]
    state.missions["slot"], state.missions["active"] = 9, state.uavs["active"].sum()
    state.residual[0], state.sensors["newest"][0] = data, data % 1.0 * 9
    return Sea(space, state)


@st.composite
def _cases(draw: st.DrawFn) -> tuple[ScenarioSpace, list[dict[str, Any]], np.ndarray, Any]:
    """A sea, its UAVs and the data of its nodes; and a generator."""
    wind = {"strength": draw(st.integers(0, 2)), "direction": 90 * draw(st.integers(0, 3))}
    fleet = draw(st.sampled_from([[], [], [{"slots_per_cell": 2}, {}]]))
    space = draw(spaces(wind=wind, fleet=fleet, flight_cost=1))
    space = ScenarioSpace.of(space, uavs=min(4, space.zone_cells), quota=500)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    water = [*reached(space.zone[:2], *space.size, {*space.no_fly})]
    cells = rng.permutation(water)[: space.uavs[1]].tolist()
    # Half of the UAVs are where they have to go home at once.
    batteries = 1 + rng.permutation(12 if rng.random() < 0.5 else 60)
    team = []
    for i in range(space.uavs[1]):
        x, y = cells[i % len(cells)]
        flags = {name: rng.random() < 0.3 for name in ("latch", "overruled")}
        active, speed = i < len(cells), fleet[i % len(fleet)] if fleet else {}
        team.append(
            {**flags, "x": x, "y": y, "battery": batteries[i], "active": active}
            | {"action": rng.integers(5), "communications": 0, **speed}
        )
    return space, team, rng.uniform(1, 20, len(space.nodes)), rng


def _turns(space: ScenarioSpace) -> list[Turn]:
    return [Turn(*flags, space.size) for flags in product((False, True), repeat=3)]


def _turned(turn: Turn, team: list[dict[str, Any]]) -> list[dict[str, Any]]:
    found = []
    for u in team:
        x, y = turn.cell(u["x"], u["y"])
        found.append(u | {"x": x, "y": y, "action": turn.actions[u["action"]]})
    return found


def _homes(sea: Sea, i: int) -> tuple[list[int], bool]:
    """How far away the cell is where UAV ``i`` may charge, and whether the choice was clear.

    Where there are several zones and a UAV would run empty, another order is tried: not clear.
    """
    ways, clear, _lacking = _plan(sea, i)
    several = sea.state.missions[0]["zones"] > 1
    active = np.nonzero(sea.state.uavs[0]["active"])[0] if clear and several else ()
    return ways, clear and not any(_plan(sea, j)[2] for j in active)


def _plan(sea: Sea, i: int) -> tuple[list[int], bool, float]:
    """As ``_homes`` in the plain order, and the battery that UAV ``i`` lacks.

    In plain Python: the UAVs choose one after the other, the lowest battery first, where they get a
    pad with the least battery. Parked teammates are islands, where the way around them is not
    longer than to wait for a charge.
    """
    team, space = [u for u in sea.state.uavs[0] if u["active"]], sea.space
    me, clear, mission = sea.state.uavs[0][i], True, sea.state.missions[0]
    start, complete, rate = (mission[f"charge_{name}"] for name in ("start", "complete", "rate"))
    zones = {
        (x + a, y + b): zone
        for zone, (x, y, w, h) in enumerate(space.rectangles)
        for b in range(h)
        for a in range(w)
    }
    free = [[0] * min(mission["zone_pads"][zone], len(team)) for zone in range(mission["zones"])]
    places = [(int(u["x"]), int(u["y"])) for u in team]
    parked = [p for p, u in zip(places, team, strict=True) if u["latch"] and u["zone"] >= 0]
    own = int(me["x"]), int(me["y"])
    cells = [width * height for _, _, width, height in space.rectangles]
    crowded = [number < 4 * len(sea.state.uavs[0]) for number in cells]
    taken = {p for p in places if p in zones and (not crowded[zones[p]] or p in (*parked, own))}
    reach = reach_of(sea.state.missions, space.chart)
    for u in sorted(team, key=lambda u: u["battery"]):
        place, cost = (int(u["x"]), int(u["y"])), mission["flight_cost"]
        options, is_parked = [], place in parked and place != own
        for cell, zone in zones.items():
            if cell != place and (cell in taken or is_parked):
                continue
            mates = {p for p in parked if p not in (place, cell)}
            islands = {*space.no_fly}
            around = reached(place, *space.size, islands | mates).get(cell, math.inf)
            through = reached(place, *space.size, islands)[cell]
            on_the_way = [
                p
                for p in mates
                if reached(place, *space.size, islands)[p] + reached(p, *space.size, islands)[cell]
                == through
            ]
            way = around
            if islands or len(on_the_way) > 1:
                way = min(around, through + math.ceil((complete - start) / rate))
            asked = _until_asked(u, way, mission)
            wait = max(min(free[zone]) - asked, 0)
            wait *= mission["uavs"] > mission["zone_pads"][zone]
            battery = way
            if reach is not None:
                speed = u["slots_per_cell"]
                battery = reach[[*zones].index(cell), speed - 1, place[1], place[0]]
                battery += (way - through) * (speed + mission["wind_most"])
            until_latched = u["battery"] - mission["charge_start"]
            lacks = max(max(battery, until_latched) + wait + 1 - u["battery"], 0)
            options.append((lacks, battery + wait, way, zone, asked, cell))
        options.sort()
        clear &= len(options) < 2 or options[0][:3] < options[1][:3]
        if place == own:
            lacking = options[0][0] if options else 0
            return [way for _, _, way, *_ in options[:1]], clear, lacking
        if options:
            *_, zone, asked, cell = options[0]
            taken.add(cell)
            needed = math.ceil((u["quota"] - u["communications"]) / mission["communication_slots"])
            if u["battery"] < cost * needed:
                pad = int(np.argmin(free[zone]))
                begin = max(free[zone][pad], asked)
                lacking = complete - max(u["battery"] - begin * cost, 0)
                free[zone][pad] = begin + math.ceil(lacking / rate)
    raise AssertionError("an active UAV chooses")


def _until_asked(u: np.void, way: float, mission: np.void) -> float:
    """The slots until a UAV may ask for a pad so many cells away."""
    spare = (u["battery"] - mission["charge_start"]) // mission["flight_cost"]
    return max(way * u["slots_per_cell"], spare)


def _are_near_one_zone(sea: Sea) -> bool:
    """Whether every UAV has a single nearest zone, in whose queue it counts."""
    for u in sea.state.uavs[0]:
        ways = reached((u["x"], u["y"]), *sea.space.size, {*sea.space.no_fly})
        zones = [
            min(ways[x + i % w, y + i // w] for i in range(w * h))
            for x, y, w, h in sea.space.rectangles
        ]
        if u["active"] and zones.count(min(zones)) > 1:
            return False
    return True


@given(_cases())
def test_a_sea_mirrored_or_turned_is_the_same(case: tuple) -> None:
    """Moves, ways, masks of the guard and the battery that it counts on."""
    space, team, data, _ = case
    plain = _sea(space, team, data)
    reach, mask = reach_of(plain.state.missions, space.chart), guard(plain.view)
    rows = plain.view.uav
    homes = [_homes(plain, i) for i in rows]
    for i, (way, clear) in zip(rows, homes, strict=True):
        found = compiled.parking_cell(
            plain.state.missions[0], plain.state.uavs[0], i, space.chart, reach
        )
        assert not clear or found[2] == (way[0] if way else 0)
    compiled.resolve(plain.state.missions[0], plain.state.uavs[0], space.chart)
    clear = all(clear for _, clear in homes)
    event(f"clear {clear}")
    for turn in _turns(space):
        turned = _sea(turn.sea(space), _turned(turn, team), data)
        chart = turned.space.chart
        if reach is not None:
            other = reach_of(turned.state.missions, chart)
            homes = [chart.nearest[turn.cell(*home)[::-1]] for home in space.chart.parking]
            for y, x in np.ndindex(space.chart.zones.shape):
                a, b = turn.cell(x, y)
                assert (other[homes, :, b, a] == reach[:, :, y, x]).all()
        if clear:
            assert (guard(turned.view)[:, turn.actions] == mask).all()
        compiled.resolve(turned.state.missions[0], turned.state.uavs[0], chart)
        for one, other in zip(plain.state.uavs[0], turned.state.uavs[0], strict=True):
            assert turn.cell(one["x"], one["y"]) == (other["x"], other["y"])
            assert turn.actions[one["executed"]] == other["executed"]
            for name in ("overruled", "overruled_by", "zone", "slots_left"):
                assert one[name] == other[name]


HEURISTICS = {"nearest": _NEAREST, "greedy": _GREEDY, "age": _AGE}


def _decisions(sea: Sea, name: str) -> list[tuple[int, int, int, int]]:
    """What each UAV that acts decides: its node, the way there, and the way after its step.

    And who may be in the way of the step; none of this depends on how ties are decided.
    """
    mission, team, chart = sea.state.missions[0], sea.state.uavs[0], sea.space.chart
    nodes, view, reach = np.array(sea.space.nodes), sea.view, reach_of(sea.state.missions, chart)
    found = []
    for i, action in zip(view.uav, policies.load(name).act(view), strict=True):
        node = compiled.goal(
            HEURISTICS[name], mission, team, i, sea.state.residual[0], sea.state.sensors[0], nodes,
            chart, reach,
        )  # fmt: skip
        if node < 0:
            found.append((-1, 0, 0, 0))
            continue
        way, _ = compiled.step_cost(mission, team, i, chart, HOVER, *nodes[node])
        found.append(
            (node, way, *compiled.step_cost(mission, team, i, chart, action, *nodes[node]))
        )
    return found


@settings(max_examples=settings().max_examples // 3)  # an example is all turns of a sea
@given(_cases(), st.sampled_from([*HEURISTICS]))
def test_heuristics_decide_the_same_on_a_sea_mirrored_turned_or_with_other_numbers_of_nodes(
    case: tuple, name: str
) -> None:
    space, team, data, rng = case
    plain = _sea(space, team, data)
    assume(all(_homes(plain, i)[1] for i in plain.view.uav))
    decided = _decisions(plain, name)
    event(f"to a node {any(decision[0] >= 0 for decision in decided)}")
    order = rng.permutation(len(data))
    renumbered = ScenarioSpace.of(space, nodes=[space.nodes[k] for k in order])
    other = _decisions(_sea(renumbered, team, data[order]), name)
    pairs = [([(order[k] if k >= 0 else k, *ways) for k, *ways in other], decided)]
    for turn in _turns(space):
        pairs.append((_decisions(_sea(turn.sea(space), _turned(turn, team), data), name), decided))
    for others, ours in pairs:
        for (node, way, *step), (our_node, our_way, *our_step) in zip(others, ours, strict=True):
            assert way == our_way
            assert node == our_node or (name == "nearest" and min(node, our_node) >= 0)
            assert node != our_node or [*step] == [*our_step]


@given(_cases())
def test_the_numbers_of_uavs_and_zones_change_nothing(case: tuple) -> None:
    """But for who is named as the one in the way, and the numbers of zones."""
    space, team, data, rng = case
    plain = _sea(space, team, data)
    clear = all(_homes(plain, i)[1] for i in plain.view.uav) and _are_near_one_zone(plain)
    zones = [{"cells": space.zone, "pads": space.pads}, *(dict(zone) for zone in space.zones)]
    first, *further = [zones[k] for k in rng.permutation(len(zones))]
    if first["cells"][2] * first["cells"][3] < len(team):
        first, further = zones[0], zones[:0:-1]
    # UAVs of one type only change places with each other.
    order = np.arange(len(team)) if space.fleet else rng.permutation(len(team))
    changed = ScenarioSpace.of(space, zone=first["cells"], pads=first["pads"], zones=further)
    other = _sea(changed, [team[i] for i in order], data)
    places = np.argsort(order)
    if clear:
        masks = {
            i: mask.tolist() for i, mask in zip(other.view.uav, guard(other.view), strict=True)
        }
        found = zip(plain.view.uav, guard(plain.view), strict=True)
        assert {places[i]: mask.tolist() for i, mask in found} == masks
    for sea in (plain, other):
        compiled.resolve(sea.state.missions[0], sea.state.uavs[0], sea.space.chart)
    for i, u in enumerate(plain.state.uavs[0]):
        v = other.state.uavs[0][places[i]]
        for name in ("x", "y", "executed", "overruled", "slots_left"):
            assert u[name] == v[name]
        assert (u["overruled_by"] < 0) == (v["overruled_by"] < 0)
        assert (u["zone"] >= 0) == (v["zone"] >= 0)
