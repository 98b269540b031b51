"""The edits of a plan in the search: what each keeps, and from which slot on it changes the flight.

Every kind of edit is tried on a drawn plan for a drawn sea, each time with other random words.
"""

from collections import Counter
from collections.abc import Iterator

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dess.policies.planner.fluid import (
    CHARGE,
    CRAFT,
    MOST_SLOTS,
    MOST_WAYPOINTS,
    NEVER,
    Flight,
    Plan,
    begin,
    empty_flight,
    empty_plan,
    fly,
    insert,
)
from dess.policies.planner.rates import rates_of
from dess.policies.planner.search import (
    _CHARGE,
    _CROSS,
    _INSERT,
    _KINDS,
    _MOVE,
    _NO_EDIT,
    _NUDGE,
    _REMOVE,
    _REPLACE,
    _STAY,
    _SWAP,
    _TURN,
    BEST,
    _edit,
    _first_unplanned,
    empty_workspace,
    improve,
)
from dess.scenario import Scenario
from tests.drawn import reached, scenarios, seeds
from tests.policies.flown import first_view

Waypoint = tuple[int, int, int, int]
X, Y, STAY, TURNED = range(4)
# By how many waypoints an edit makes the plan of the team longer, if not by 0.
GROWTH = {_INSERT: {1}, _REMOVE: {-1}, _CHARGE: {0, 1}}
# What an edit may change in one waypoint, and the kinds that change it by 1.
CHANGED = {_TURN: {TURNED}, _STAY: {STAY}, _NUDGE: {X, Y}, _REPLACE: {X, Y}, _CHARGE: {X, Y}}
BY_ONE = _TURN, _STAY, _NUDGE
# What the model knows of a UAV, but for what it takes from the plan.
STATE = [name for name in CRAFT.names or () if name not in ("waypoints", "last_charge")]


class Sea:
    """A mission on a sea on which UAVs soon charge, a plan for it, and the flight of this plan."""

    def __init__(self, scenario: Scenario, lengths: list[int], seed: int):
        self.rng, self.slots = np.random.default_rng(seed), scenario.max_slots
        view = first_view(scenario, seed)
        state, self.nodes = view.state, view.world.nodes
        self.rates, self.mission = rates_of(view), state.missions[0]
        self.uavs, self.residual = state.uavs[0], state.residual[0]
        self.uavs["active"] = self.rng.random(scenario.uavs) < 0.9
        self.open = [*reached(scenario.zone[:2], *scenario.size, scenario.no_fly)]
        self.parking = [*map(tuple, self.rates.chart.parking.tolist())]
        # The rows before and after those of the plan show what is written outside.
        self.plan = Plan(*(array[1:-1] for array in empty_plan(scenario.uavs + 2)))
        for i, length in enumerate(lengths[: scenario.uavs]):
            # Near the first zone, so that many are reached; long rests without charges can cross.
            for place in range(length):
                stay = int(self.rng.choice([CHARGE, 0, 0, 0, 1, 1, 2, 3][place > 7 :]))
                x, y = self.rng.choice(self.parking if stay == CHARGE else self.open[:25])
                insert(self.plan, i, place, x, y, stay, int(self.rng.integers(2)))
        self.flight, _ = self.simulate(self.plan, self.slots)

    def simulate(self, plan: Plan, slots: int) -> tuple[Flight, float]:
        """The flight of a plan in so many slots, and its value."""
        flight = empty_flight(self.slots, len(self.uavs), len(self.nodes))
        begin(self.mission, self.uavs, self.residual, flight)
        return flight, fly(self.mission, self.rates, plan, flight, 0, flight, slots)

    def edits(self) -> Iterator[tuple[int, int, Plan]]:
        """Edits of the plan: the kind, the first slot that it may change, and the edited plan."""
        for kind in [*range(_KINDS.max() + 1)] * 8:
            plan, words = _copy(self.plan), self.rng.integers(0, 2**32, 4, np.uint64)
            place, chart = int(np.argmax(kind == _KINDS)), self.rates.chart
            words[0] = (place * 2**16 // len(_KINDS) + 1) << 16 | int(words[0]) % 2**16
            slot = _edit(self.mission, self.uavs, self.nodes, chart, self.flight, plan, words)
            yield kind, slot, plan


LENGTHS = st.sampled_from([*range(8), MOST_WAYPOINTS - 1, MOST_WAYPOINTS])
SCENARIOS = scenarios(flying_time=50, charge_start=45, charge_complete=60, quota=600)
drawn = given(st.builds(Sea, SCENARIOS, st.lists(LENGTHS, min_size=6, max_size=6), seeds))


def _copy(plan: Plan) -> Plan:
    """A copy of a plan between two rows that are not its own."""
    return Plan(*(array.base.copy()[1:-1] for array in plan))


def _routes(plan: Plan) -> list[list[Waypoint]]:
    """The waypoints of each UAV."""
    rows = plan.waypoints[["x", "y", "stay", "turned"]]
    return [row[:length].tolist() for row, length in zip(rows, plan.lengths, strict=True)]


def _charges(plan: Plan) -> list[list[int]]:
    """The places in the plan of each UAV at which it charges."""
    return [[p for p, w in enumerate(route) if w[STAY] == CHARGE] for route in _routes(plan)]


def _is_void(kind: int, slot: int) -> bool:
    """Whether an edit was not possible, or is one that the search always takes back.

    The latter are moves to where the waypoints have been: they are taken out only.
    """
    return slot == _NO_EDIT or (kind == _MOVE and slot == NEVER)


def _check_new(kind: int, sea: Sea, gone: list[Waypoint], new: Waypoint) -> None:
    """Check a waypoint that an edit has made, of one that is gone if there is one."""
    nodes = [*map(tuple, sea.nodes.tolist())]
    cells = {_INSERT: nodes, _REPLACE: nodes, _CHARGE: []}.get(kind, sea.open)
    assert new[:2] in (sea.parking if new[STAY] == CHARGE else cells)
    assert new[STAY] in range(CHARGE, 3 if kind == _INSERT else 5) and new[TURNED] in (0, 1)
    for old in gone:
        steps = np.abs(np.subtract(new, old))
        assert {*np.flatnonzero(steps)} <= CHANGED[kind]
        assert steps.sum() == 1 or kind not in BY_ONE


@drawn
def test_an_edit_keeps_all_other_waypoints(sea: Sea) -> None:
    """Moves, swaps, reversals and crossings keep all; UAVs charge as often but for two kinds."""
    before = _routes(sea.plan)
    for kind, slot, plan in sea.edits():
        if _is_void(kind, slot):
            continue
        after = _routes(plan)
        one, other = (Counter(w for route in routes for w in route) for routes in (before, after))
        gone, come = [*(one - other).elements()], [*(other - one).elements()]
        assert max(len(gone), len(come)) <= (kind in CHANGED or kind in GROWTH)
        assert (grown := len(come) - len(gone)) in GROWTH.get(kind, {0})
        assert come or kind not in BY_ONE
        assert kind != _CHARGE or not grown or sea.mission["flight_cost"] > 0
        for new in come:
            _check_new(kind, sea, gone, new)
        more = [len(b) - len(a) for a, b in zip(_charges(sea.plan), _charges(plan), strict=True)]
        assert kind == _REMOVE or sum(more) == (grown if kind == _CHARGE else 0)
        assert kind in (_REMOVE, _CHARGE) or not any(more)
        changed = [i for i in range(len(after)) if after[i] != before[i]]
        assert sea.uavs["active"][changed].all()
        assert len(changed) <= 1 + (kind in (_MOVE, _SWAP, _CROSS))
        for i in changed if grown else ():  # the others are in their order
            short, long = sorted((before[i], after[i]), key=len)
            assert any(long[:p] + long[p + 1 :] == short for p in range(len(long)))


@drawn
def test_an_edit_writes_only_the_plan(sea: Sea) -> None:
    """When legs begin belongs to their places, so that stays; if no edit was possible, all does."""
    for _, slot, plan in sea.edits():
        assert plan.lengths.min() >= 0 and plan.lengths.max() <= MOST_WAYPOINTS
        assert (plan.waypoints["begun"] == sea.plan.waypoints["begun"]).all()
        for now, before in zip(plan, sea.plan, strict=True):
            rows = slice(None) if slot == _NO_EDIT else [0, -1]
            assert now.base[rows].tobytes() == before.base[rows].tobytes()


@drawn
def test_a_flight_is_the_same_until_the_slot_that_an_edit_returns(sea: Sea) -> None:
    for kind, slot, plan in sea.edits():
        if _is_void(kind, slot):
            continue
        slot = min(slot, _first_unplanned(sea.mission, sea.plan, plan))
        plans, slots = (sea.plan, plan), min(slot, sea.slots)
        (before, value), (after, edited) = (sea.simulate(_copy(p), slots) for p in plans)
        assert after.last.tolist() == before.last.tolist()
        assert (after.team[STATE] == before.team[STATE]).all() and (after.sea == before.sea).all()
        assert edited == value


@drawn
def test_the_value_of_a_search_is_that_of_its_plan(sea: Sea) -> None:
    """From any plan on, with charges that are moved, taken out or not reached; never worse."""
    plan, workspace = _copy(sea.plan), empty_workspace(sea.slots, len(sea.uavs), len(sea.nodes))
    arguments = sea.mission, sea.uavs, sea.residual, sea.nodes, sea.rates, plan, workspace
    improve(*arguments, 200, 2.0, 200)
    slots = min(sea.slots, MOST_SLOTS)
    before, after = (sea.simulate(p, slots)[1] for p in (sea.plan, plan))
    assert workspace.course[BEST] == after >= before


def test_every_kind_of_edit_is_tried() -> None:
    """Each changes what is reached in the flight, and each is refused."""
    done, refused = Counter[int](), Counter[int]()

    @drawn
    def count(sea: Sea) -> None:
        for kind, slot, _ in sea.edits():
            done[kind] += _NO_EDIT < slot < sea.flight.last[1]
            refused[kind] += slot == _NO_EDIT

    count()
    for kind in {*_KINDS.tolist()}:
        assert done[kind] >= 10 and refused[kind] >= 10
