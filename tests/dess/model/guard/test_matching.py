"""Zones with fewer cells than UAVs: no two UAVs count on the same cell."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from dess import load_scenario, policies
from dess.model.batch import simulate_batch
from dess.model.guard.queues import CHANGE
from dess.model.state import END_NAMES, HOVER
from tests import compiled
from tests.dess.envs.episodes import placed
from tests.dess.model.guard.test_guard import _mask
from tests.drawn import EAST, NORTH, SOUTH, WEST

# A strip of three rows with a zone of a cell for each UAV at its western end, and one of a single
# cell at its eastern end. Missions end on the ground, and there are no margins but for teammates.
STRIP: dict[str, Any] = {"grid": 24, "rows": 3, "zone": [0, 0, 1, 3], "nodes": [[12, 0]]}
STRIP |= {"zones": [{"cells": [23, 1, 1, 1], "pads": 1}], "charge_start": 10}
LANDING = STRIP | {"landing": True}


def _homes(uavs: list[dict[str, Any]], **scenario: Any) -> list[tuple[int, int]]:
    """The x and the way of the cell that each UAV counts on."""
    state, chart = placed(uavs, **scenario)
    mission, team = state.missions[0], state.uavs[0]
    homes = [compiled.parking_cell(mission, team, i, chart) for i in range(len(uavs))]
    return [(home.x, home.cells) for home in homes]


def test_a_uav_that_reaches_two_zones_leaves_the_last_cell_to_one_that_reaches_one():
    """It has less battery, so it would choose first, and it is nearer to the small zone."""
    both, one = {"x": 12, "y": 1, "battery": 13}, {"x": 18, "y": 1, "battery": 14}
    assert _homes([both, one], **LANDING) == [(0, 12), (23, 5)]
    assert _homes([one, both], **LANDING) == [(23, 5), (0, 12)]


def test_who_stands_in_the_cell_of_another_leaves_it():
    """It is charged and reaches the other zone; a UAV that charges stays."""
    standing, other = {"x": 23, "y": 1, "battery": 60}, {"x": 20, "y": 1, "battery": 12}
    assert _homes([standing, other], **LANDING) == [(0, 23), (23, 3)]
    assert not _mask(standing, other, **LANDING)[0, HOVER]
    charging = standing | {"charging": True, "pad_request": 3}
    assert _homes([charging, other], **LANDING)[0] == (23, 0)


def test_who_comes_first_takes_the_cell_behind_those_of_others():
    """The zone of two cells is at the end of a corridor, so the front one closes the way."""
    corridor = [[x, y] for x in range(4, 20) for y in (0, 2)]
    sea = LANDING | {"grid": 20, "zones": [{"cells": [18, 1, 2, 1], "pads": 1}], "no_fly": corridor}
    sea["nodes"] = [[12, 1]]
    uavs = [{"x": x, "y": 1, "battery": 14} for x in (14, 16, 1)]
    assert _homes(uavs, **sea) == [(18, 4), (19, 3), (0, 1)]


@pytest.mark.parametrize("seed", range(20))
def test_no_other_matching_has_a_lower_price(seed):
    draws = np.random.default_rng(seed)
    cells = draws.integers(1, 4, draws.integers(2, 6))
    uavs = int(draws.integers(1, cells.sum() + 1))
    prices = draws.integers(0, 50, (uavs, len(cells)))
    zones = compiled.spread_out(prices, prices.argmin(1), cells)
    assert (np.bincount(zones, minlength=len(cells)) <= cells).all()
    by_cell = np.repeat(prices, cells, axis=1)
    least = by_cell[linear_sum_assignment(by_cell)].sum()
    assert prices[np.arange(uavs), zones].sum() == least


def test_who_comes_first_to_a_full_zone_flies_on_to_the_deeper_cell():
    """The one behind it would fly around it; if it charges, it stays."""
    zones = [{"cells": [22, 1, 2, 1], "pads": 1}]
    first, second = {"x": 22, "y": 1, "battery": 9}, {"x": 20, "y": 1, "battery": 9}
    assert _homes([first, second], **LANDING | {"zones": zones}) == [(23, 1), (22, 2)]
    charging = first | {"charging": True, "pad_request": 1}
    assert _homes([charging, second], **LANDING | {"zones": zones}) == [(22, 0), (23, 5)]


def test_a_uav_flies_into_the_cell_that_a_teammate_is_told_to_leave():
    """Both move on by one cell at once; if it flew around, they might do so again and again."""
    sea = LANDING | {"zones": [{"cells": [22, 0, 2, 1], "pads": 1}], "charge_start": 20}
    outside, inside = {"x": 23, "y": 1, "battery": 12}, {"x": 23, "y": 0, "battery": 14}
    assert _homes([outside, inside], **sea) == [(23, 1), (22, 1)]
    moves = _mask(outside, inside, **sea)
    assert moves[0, NORTH] and not moves[1, HOVER]
    waiting = inside | {"pad_request": 1}
    assert not _mask(outside, waiting, **sea)[0, NORTH]


def test_a_charged_uav_does_not_make_room_by_moving_into_the_cell_that_a_teammate_chose():
    """A zone of three cells: the teammate counts on one beside it, and it may move to the other."""
    sea = LANDING | {"zones": [{"cells": [23, 0, 1, 3], "pads": 1}]}
    team = [{"x": 22, "y": 1, "battery": 8}, {"x": 23, "y": 1, "battery": 80}, {"x": 0, "y": 0}]
    state, chart = placed(team, **sea)
    home = compiled.parking_cell(state.missions[0], state.uavs[0], 0, chart)
    assert (home.x, home.y) == (23, 0)
    moves = _mask(*team, **sea)[1]
    assert not moves[NORTH] and moves[SOUTH]


def test_in_the_air_a_uav_at_c_s_keeps_its_cell_if_its_zone_has_one_for_all_that_come():
    """One pad, three cells, and two UAVs that can ask alike: the first chooses another cell."""
    sea = STRIP | {"zones": [{"cells": [23, 0, 1, 3], "pads": 1}], "charge_start": 20}
    ready = {"y": 1, "battery": 14, "latch": True}
    team = [ready | {"x": 22}, ready | {"x": 23}, {"x": 0, "y": 0, "battery": 60}]
    assert _homes(team, **sea)[:2] == [(23, 2), (23, 0)]
    moves = _mask(*team, **sea)
    assert np.flatnonzero(moves[1]).tolist() == [HOVER] and not moves[0, EAST]


def test_in_the_air_a_uav_that_waits_for_its_turn_keeps_its_cell():
    """It cannot ask above C_S, and would not leave the cell for the one that comes."""
    waiting = {"x": 0, "y": 1, "battery": 40, "executed": HOVER}
    team = [waiting, {"x": 1, "y": 1, "battery": 30}, {"x": 12, "y": 2}]
    assert _homes(team, **STRIP, pads=1)[1] == (0, 2)


def test_a_late_uav_flies_around_one_that_waits_and_has_just_overruled_it():
    """The one that waits cannot leave its cell in time, and would overrule it again."""
    waiting = {"x": 0, "y": 1, "battery": 40, "executed": HOVER}
    late = {"x": 1, "y": 1, "battery": 5, "latch": True}
    overruled = late | {"overruled": True, "overruled_by": 0}
    for state, around in ((late, False), (overruled, True)):
        moves = _mask(waiting, state, {"x": 12, "y": 2}, **STRIP, pads=1)[1]
        assert moves[WEST] != around
        assert (moves[NORTH] or moves[SOUTH]) == around


def test_a_cell_that_parked_uavs_close_off_does_not_count():
    """The corner of a zone of four cells: there is one cell for two UAVs."""
    sea = LANDING | {"zone": [0, 0, 2, 3], "zones": [{"cells": [22, 0, 2, 2], "pads": 2}]}
    parked = {"charging": True, "pad_request": 1, "battery": 20}
    team = [parked | {"x": 22, "y": 0}, parked | {"x": 23, "y": 1}]
    team += [{"x": x, "y": 1, "battery": 20} for x in (16, 15)]
    assert _homes(team, **sea)[2:] == [(22, 6), (1, 14)]


def test_where_missions_go_on_in_the_air_uavs_take_turns_in_a_cell():
    """The first UAV charges from 20 to 80 % in 6 slots; then the other one takes its cell."""
    waiting = {"latch": True, "pad_request": -1, "executed": HOVER}
    team = [{"x": x, "y": 1, "battery": b} | waiting for x, b in ((22, 21), (20, 19))]
    sea = STRIP | {"charge_start": 30, "charge_complete": 80, "pads": 1}
    state, chart = placed(team, **sea)
    plan, _ = compiled.plan_of_pads(state.missions[0], state.uavs[0], 0, chart)
    assert plan.turns["zone"].tolist() == [1, 1]
    assert plan.turns["begins"].tolist() == [1, 1 + 6 + CHANGE]
    assert _homes(team, **sea) == [(23, 1), (23, 3)]


def test_who_only_flies_over_a_small_zone_leaves_its_cell_to_one_that_reaches_no_other():
    """Missions go on in the air, where a latch alone does not say that a UAV stays."""
    sea = STRIP | {"zones": [{"cells": [12, 1, 1, 1], "pads": 1}], "charge_start": 30}
    over, other = ({"x": x, "y": 1, "battery": b, "latch": True} for x, b in ((12, 20), (16, 8)))
    assert _homes([over, other], **sea) == [(0, 12), (12, 4)]
    asked = over | {"pad_request": 1}
    assert _homes([asked, other], **sea)[0] == (12, 0)


# Seas of families whose second zone has four cells, for five UAVs. Each had a UAV that was lost or
# was not on the ground at the end.
TIGHT: dict[str, Any] = {"uavs": 5, "landing": True, "quota": 0}


@pytest.mark.parametrize(
    ("sea", "changes", "seed", "missions"),
    [
        ("archipelago:1040929", {"pads": 2, "max_slots": 201}, 1083329, range(24)),
        ("corridor:995720", {"pads": 1, "max_slots": 280}, 1038120, [17]),
        ("corridor:930954", {"pads": 2, "max_slots": 258}, 957454, [8, 9, 23]),
    ],
)
def test_all_uavs_land_on_tight_seas(sea, changes, seed, missions):
    zones = [{"cells": zone.cells, "pads": 1} for zone in load_scenario(sea).zones]
    space = load_scenario(sea, **TIGHT, **changes, zones=zones)
    ends = simulate_batch(space, policies.load("greedy"), seed, missions).uavs["end"]
    assert (ends == END_NAMES.index("landed")).all()


GUSTS = {"strength": 0.8, "direction": 40, "gusts": 0.25, "seed": 3}


@pytest.mark.parametrize(
    ("changes", "seed", "mission"),
    [
        # A UAV that flies over a zone asks there for a pad that a teammate takes for long.
        ({"uavs": 4, "pads": 2, "zones": [{"cells": [24, 3, 1, 3], "pads": 1}]}, 7029, 36),
        # A late UAV flies to and fro between the way to its zone and the one to a nearer, full one.
        (
            {"uavs": 6, "pads": 4, "zones": [{"cells": [4, 8, 1, 1], "pads": 1}], "landing": True}
            | {"quota": 0, "max_slots": 250, "wind": GUSTS},
            7022,
            13,
        ),
    ],
)
def test_no_uav_is_lost_near_a_small_zone_of_the_paper_sea(changes, seed, mission):
    space = load_scenario("paper", **changes)
    ends = simulate_batch(space, policies.load("greedy"), seed, [mission]).uavs["end"]
    assert set(ends[0]) <= {END_NAMES.index("quota"), END_NAMES.index("landed")}
