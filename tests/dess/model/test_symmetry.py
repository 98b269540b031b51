"""A sea that is mirrored, turned or numbered otherwise is the same sea for rules and policies."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from hypothesis import event, given, settings
from hypothesis import strategies as st

from dess import policies
from dess.model.channel import world_of
from dess.model.guard import guard
from dess.model.rules import launch
from dess.model.state import HOVER, State, starts_of, state_of
from dess.model.view import View
from dess.model.ways import is_calm
from dess.policies.choices import AGE, GREEDY, NEAREST
from dess.scenario.scenario import ScenarioSpace
from tests import compiled
from tests.dess.model.turns import Turn
from tests.drawn import reached, spaces


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


# Each with a slow UAV, since guard and heuristics are compiled once more for those without.
FLEETS = [[{}, {}, {}, {"slots_per_cell": 2}], [{"slots_per_cell": 2}, {}]]


@st.composite
def _cases(draw: st.DrawFn) -> tuple[ScenarioSpace, list[dict[str, Any]], np.ndarray, Any]:
    """A sea, its UAVs and the data of its nodes; and a generator."""
    wind = {"strength": draw(st.integers(0, 2)), "direction": 90 * draw(st.integers(0, 3))}
    fleet = draw(st.sampled_from(FLEETS))
    lands, quota = draw(st.sampled_from([(False, 500), (True, 500), (True, 0)]))
    space = draw(spaces(wind=wind, fleet=fleet, flight_cost=1, landing=lands))
    space = ScenarioSpace.of(space, uavs=min(4, space.zone_cells), quota=quota)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    water = [*reached(space.zone[:2], *space.size, {*space.no_fly})]
    cells = rng.permutation(water)[: space.uavs[1]].tolist()
    # Half of the UAVs are where they have to go home at once.
    batteries = 1 + rng.permutation(12 if rng.random() < 0.5 else 60)
    team = []
    for i in range(space.uavs[1]):
        x, y = cells[i % len(cells)]
        flags = {name: rng.random() < 0.3 for name in ("latch", "overruled")}
        active, speed = i < len(cells), fleet[i % len(fleet)]
        team.append(
            {**flags, "x": x, "y": y, "battery": batteries[i], "active": active}
            | {"action": rng.integers(5), "communications": 0, **speed}
        )
    return space, team, rng.uniform(1, 20, len(space.nodes)), rng


def _turned(turn: Turn, team: list[dict[str, Any]]) -> list[dict[str, Any]]:
    found = []
    for u in team:
        x, y = turn.cell(u["x"], u["y"])
        found.append(u | {"x": x, "y": y, "action": turn.actions[u["action"]]})
    return found


def _homes(sea: Sea) -> list[tuple[int, ...]]:
    """The cell where each UAV will charge, the way there, and what else the guard counts on."""
    mission, team, chart = sea.state.missions[0], sea.state.uavs[0], sea.space.chart
    data = sea.state.residual[0].sum()
    return [tuple(compiled.parking_cell(mission, team, i, chart, data)) for i in sea.view.uav]


def _cells_of_teammates(sea: Sea) -> list[tuple[int, int] | None]:
    """The cells that the plan of each UAV has for its teammates, which it does not take."""
    mission, team, chart = sea.state.missions[0], sea.state.uavs[0], sea.space.chart
    data = sea.state.residual[0].sum()
    plans = [compiled.planned_cells(mission, team, i, chart, data) for i in sea.view.uav]
    return [cell for plan in plans for cell in plan]


def _decides_alike(plain: Sea, turned: Sea, turn: Turn) -> bool:
    """Whether all UAVs charge at the same cells of a turned sea: no tie was decided otherwise.

    Nor may a tie have been decided otherwise in the plan that a UAV has of its teammates, whose
    cells it does not take. For example, a UAV stands at (6, 4) in a zone from (4, 3) to (6, 4), and
    a teammate comes from (7, 6): of the cells that are left to it, (6, 3) and (5, 4) are both 4
    cells away, and the plan has the first one, row by row. In a mirrored sea it is the other one.

    Where no UAV has to wait for a pad, the one with the lowest battery chooses first, so its way is
    the same whatever it chooses. Otherwise the one that can ask soonest does.
    """
    homes, others = _homes(plain), _homes(turned)
    if not plain.space.zones and plain.space.charging_pads >= plain.space.uavs[1]:
        first = int(np.argmin([plain.state.uavs[0][i]["battery"] for i in plain.view.uav]))
        assert homes[first][2] == others[first][2]
    cells = [cell and turn.cell(*cell) for cell in _cells_of_teammates(plain)]
    if cells != _cells_of_teammates(turned):
        return False
    return [(*turn.cell(x, y), *rest) for x, y, *rest in homes] == others


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
def test_a_sea_mirrored_or_turned_is_the_same(case):
    """Moves, ways, masks of the guard and the battery that it counts on."""
    space, team, data, _ = case
    plain = _sea(space, team, data)
    reach, mask = plain.view.ways.reach, guard(plain.view)
    after = _sea(space, team, data).state
    compiled.resolve(after.missions[0], after.uavs[0], space.chart)
    for turn in Turn.all_of(space):
        turned = _sea(turn.sea(space), _turned(turn, team), data)
        chart = turned.space.chart
        if not is_calm(reach):
            other = turned.view.ways.reach
            homes = [chart.nearest[turn.cell(*home)[::-1]] for home in space.chart.parking]
            for y, x in np.ndindex(space.chart.zones.shape):
                a, b = turn.cell(x, y)
                assert (other[0][homes, :, b, a] == reach[0, :, :, y, x]).all()
        alike = _decides_alike(plain, turned, turn)
        event(f"alike {alike}")
        if alike:
            assert (guard(turned.view)[:, turn.actions] == mask).all()
        compiled.resolve(turned.state.missions[0], turned.state.uavs[0], chart)
        for one, other in zip(after.uavs[0], turned.state.uavs[0], strict=True):
            assert turn.cell(one["x"], one["y"]) == (other["x"], other["y"])
            assert turn.actions[one["executed"]] == other["executed"]
            for name in ("overruled", "overruled_by", "zone", "slots_left"):
                assert one[name] == other[name]


HEURISTICS = {"nearest": NEAREST, "greedy": GREEDY, "age": AGE}


def _decisions(sea: Sea, name: str) -> list[tuple[int, int, int, int]]:
    """What each UAV that acts decides: its node, the way there, and the way after its step.

    And who may be in the way of the step; none of this depends on how ties are decided.
    """
    mission, team, chart = sea.state.missions[0], sea.state.uavs[0], sea.space.chart
    nodes, view, reach = np.array(sea.space.nodes), sea.view, sea.view.ways.reach
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
    case, name
):
    space, team, data, rng = case
    plain = _sea(space, team, data)
    decided = _decisions(plain, name)
    event(f"to a node {any(decision[0] >= 0 for decision in decided)}")
    order = rng.permutation(len(data))
    renumbered = ScenarioSpace.of(space, nodes=[space.nodes[k] for k in order])
    other = _decisions(_sea(renumbered, team, data[order]), name)
    pairs = [([(order[k] if k >= 0 else k, *ways) for k, *ways in other], decided)]
    for turn in Turn.all_of(space):
        turned = _sea(turn.sea(space), _turned(turn, team), data)
        if _decides_alike(plain, turned, turn):
            pairs.append((_decisions(turned, name), decided))
    for others, ours in pairs:
        for (node, way, *step), (our_node, our_way, *our_step) in zip(others, ours, strict=True):
            assert way == our_way
            assert node == our_node or (name == "nearest" and min(node, our_node) >= 0)
            assert node != our_node or [*step] == [*our_step]


@given(_cases())
def test_the_numbers_of_uavs_and_zones_change_nothing(case):
    """But for who is named as the one in the way, and the numbers of zones."""
    space, team, data, rng = case
    plain = _sea(space, team, data)
    zones = [{"cells": space.zone, "pads": space.pads}, *(dict(zone) for zone in space.zones)]
    first, *further = [zones[k] for k in rng.permutation(len(zones))]
    if first["cells"][2] * first["cells"][3] < len(team):
        first, further = zones[0], zones[:0:-1]
    # UAVs of one type only change places with each other.
    order = np.arange(len(team))
    if len(space.fleet) == 4:
        order[:3] = rng.permutation(order[:3])
    changed = ScenarioSpace.of(space, zone=first["cells"], pads=first["pads"], zones=further)
    other = _sea(changed, [team[i] for i in order], data)
    places = np.argsort(order)
    rows, others = ([*sea.view.uav] for sea in (plain, other))
    alike = [others.index(places[i]) for i in rows]
    homes = _homes(other)
    if _homes(plain) == [homes[row] for row in alike] and _are_near_one_zone(plain):
        assert (guard(plain.view) == guard(other.view)[alike]).all()
    for sea in (plain, other):
        compiled.resolve(sea.state.missions[0], sea.state.uavs[0], sea.space.chart)
    for i, u in enumerate(plain.state.uavs[0]):
        v = other.state.uavs[0][places[i]]
        for name in ("x", "y", "executed", "overruled", "slots_left"):
            assert u[name] == v[name]
        assert (u["overruled_by"] < 0) == (v["overruled_by"] < 0)
        assert (u["zone"] >= 0) == (v["zone"] >= 0)
