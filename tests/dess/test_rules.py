"""The consequences, one at a time: safety controller, energy, pads, communication, settlement."""

from typing import Any

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st
from scipy import special

from dess import rules, streams
from dess.channel import Scratch, World, empty_scratch, world_of
from dess.scenario import Scenario, ScenarioSpace
from dess.state import (
    ACTIVE,
    BATTERY,
    HOVER,
    QUOTA,
    STEP_X,
    STEP_Y,
    TRUNCATED,
    State,
    constants_of,
    empty_state,
    ranges_of,
    types_of,
)
from tests import compiled
from tests.drawn import EAST, NORTH, SOUTH, WEST, cells, replications, scenarios, seeds, spaces

STEPS = list(zip(STEP_X.tolist(), STEP_Y.tolist(), strict=True))


def _launched(scenario: Scenario, seed: int = 1, replication: int = 2) -> tuple[State, World, Any]:
    """A mission at the start of slot 0, its world, and working memory."""
    space = ScenarioSpace.of(scenario)
    state = empty_state(1, space.uavs[1], len(space.nodes))
    state.missions[:] = constants_of(space)
    state.missions["seed"], state.missions["replication"] = seed, replication
    rules.launch(
        state.missions[0],
        ranges_of(space),
        types_of(space),
        state.uavs[0],
        state.residual[0],
        state.sensors[0],
        state.teeth[0],
    )
    return state, world_of(space), empty_scratch(space.uavs[1], len(space.nodes))


def _communicate(state: State, world: World, scratch: Scratch, n: int) -> None:
    """Communication slot ``n`` of a mission slot."""
    mission, uavs, residual, sensors, teeth = (array[0] for array in state)
    nodes, mean_snr, *tables = world
    compiled.open_slot(mission, uavs, nodes, mean_snr, *tables, scratch.search)
    compiled.communicate(mission, uavs, residual, sensors, teeth, *tables, *scratch, n)


# --- launch ---


@given(spaces(), seeds, replications)
def test_uavs_start_on_distinct_cells_of_the_zone(
    space: ScenarioSpace, seed: int, replication: int
) -> None:
    state = empty_state(1, space.uavs[1], len(space.nodes))
    state.missions[:] = constants_of(space)
    state.missions["seed"], state.missions["replication"] = seed, replication
    mission, uavs = state.missions[0], state.uavs[0]
    rules.launch(
        mission,
        ranges_of(space),
        types_of(space),
        uavs,
        state.residual[0],
        state.sensors[0],
        state.teeth[0],
    )
    fleet = uavs[: mission["uavs"]]
    x, y, width, height = space.zone
    starts = {(int(u["x"]), int(u["y"])) for u in fleet}
    assert len(starts) == len(fleet) == mission["active"]
    assert all(x <= a < x + width and y <= b < y + height for a, b in starts)
    assert fleet["active"].all()
    assert not uavs[mission["uavs"] :]["active"].any()
    assert (fleet["battery"] == mission["flying_time"]).all()
    low, high = space.initial_data
    assert ((low <= state.residual) & (state.residual <= high)).all()
    assert mission["initial"] == pytest.approx(state.residual.sum(), abs=1e-9)


def test_start_cells_are_uniform() -> None:
    scenario = Scenario.of(zone=[3, 4, 3, 2], uavs=2, nodes=[[0, 0]])
    counts = np.zeros((32, 32))
    pairs = set()
    for replication in range(1500):
        uavs = _launched(scenario, 3, replication)[0].uavs[0]
        pairs.add(tuple(zip(uavs["x"].tolist(), uavs["y"].tolist(), strict=True)))
        np.add.at(counts, (uavs["x"], uavs["y"]), 1)
    assert len(pairs) == 6 * 5
    inside = counts[3:6, 4:6]
    assert inside.sum() == 3000
    assert abs(inside - 500).max() < 5 * np.sqrt(500)  # 5 standard deviations


# --- safety controller ---


def _resolve(
    grid: int, uavs: list[tuple[tuple[int, int], int]], forbid_swaps: bool = False, idle: Any = ()
) -> tuple[list[tuple[int, int]], list[bool]]:
    """The cells and the overruled flags after UAVs ``(cell, action)`` acted."""
    scenario = Scenario.of(
        grid=grid,
        zone=[0, 0, grid, grid],
        uavs=len(uavs),
        nodes=[[0, 0]],
        forbid_swaps=forbid_swaps,
    )
    state, _, _ = _launched(scenario)
    team = state.uavs[0]
    for i, ((x, y), action) in enumerate(uavs):
        team[i]["x"], team[i]["y"], team[i]["action"] = x, y, action
        team[i]["active"] = i not in idle
    compiled.resolve(state.missions[0], team)
    after = list(zip(team["x"].tolist(), team["y"].tolist(), strict=True))
    for u in team[team["active"]]:
        dx, dy = STEPS[u["executed"]]
        assert (u["from_x"] + dx, u["from_y"] + dy) == (u["x"], u["y"])
        assert u["overruled"] == (u["action"] != u["executed"])
    return after, team["overruled"].tolist()


def test_moves_off_the_grid_become_hover() -> None:
    for cell, action in [((1, 0), NORTH), ((2, 1), EAST), ((1, 2), SOUTH), ((0, 1), WEST)]:
        assert _resolve(3, [(cell, action)]) == ([cell], [True])


def test_y_grows_south_and_x_east() -> None:
    actions = [(NORTH, (1, 0)), (EAST, (2, 1)), (SOUTH, (1, 2)), (WEST, (0, 1)), (HOVER, (1, 1))]
    for action, cell in actions:
        assert _resolve(3, [((1, 1), action)]) == ([cell], [False])


def test_every_mover_into_a_claimed_cell_is_cancelled() -> None:
    # Three UAVs around (1, 1), all moving in: none gets it.
    start = [((0, 1), EAST), ((2, 1), WEST), ((1, 0), SOUTH)]
    assert _resolve(3, start) == ([(0, 1), (2, 1), (1, 0)], [True] * 3)
    # Onto one that hovers: the mover alone is overruled.
    assert _resolve(3, [((0, 1), EAST), ((1, 1), HOVER)]) == ([(0, 1), (1, 1)], [True, False])
    # Into a cell that is being left: allowed.
    assert _resolve(3, [((0, 1), EAST), ((1, 1), EAST)]) == ([(1, 1), (2, 1)], [False, False])


def test_cancelled_moves_cascade() -> None:
    # A column flies east in a row; the first runs into the edge, so all stay.
    column = [((x, 0), EAST) for x in range(4)]
    assert _resolve(4, column) == ([(0, 0), (1, 0), (2, 0), (3, 0)], [True] * 4)
    # The one ahead is stopped by a cross claim on (3, 0): again all stay, the claimant too.
    column = [((x, 0), EAST) for x in range(3)] + [((3, 1), NORTH)]
    assert _resolve(4, column) == ([(0, 0), (1, 0), (2, 0), (3, 1)], [True] * 4)
    # With room ahead the whole column moves.
    column = [((x, 0), EAST) for x in range(3)]
    assert _resolve(4, column) == ([(1, 0), (2, 0), (3, 0)], [False] * 3)


def test_swaps_are_allowed_unless_forbidden() -> None:
    swap = [((0, 0), EAST), ((1, 0), WEST)]
    assert _resolve(3, swap) == ([(1, 0), (0, 0)], [False, False])
    assert _resolve(3, swap, forbid_swaps=True) == ([(0, 0), (1, 0)], [True, True])
    # A ring of four is no swap.
    ring = [((0, 0), EAST), ((1, 0), SOUTH), ((1, 1), WEST), ((0, 1), NORTH)]
    after = [(1, 0), (1, 1), (0, 1), (0, 0)]
    assert _resolve(3, ring, forbid_swaps=True) == (after, [False] * 4)
    # A forbidden swap stops those behind it.
    train = [((0, 0), EAST), ((1, 0), EAST), ((2, 0), WEST)]
    assert _resolve(4, train, forbid_swaps=True) == ([(0, 0), (1, 0), (2, 0)], [True] * 3)


def test_inactive_uavs_block_nobody_and_stay() -> None:
    uavs = [((0, 0), EAST), ((1, 0), EAST)]
    assert _resolve(3, uavs, idle={1}) == ([(1, 0), (1, 0)], [False, False])


@st.composite
def _encounters(draw: st.DrawFn) -> tuple:
    grid = draw(st.integers(2, 5))
    count = draw(st.integers(1, min(8, grid * grid)))
    spots = draw(st.lists(cells(grid), min_size=count, max_size=count, unique=True))
    actions = draw(st.lists(st.integers(0, 4), min_size=count, max_size=count))
    idle = draw(st.sets(st.integers(0, count - 1), max_size=2))
    order = draw(st.permutations(range(count)))
    return grid, list(zip(spots, actions, strict=True)), draw(st.booleans()), idle, order


@given(_encounters())
def test_the_safety_controller_knows_no_numbering_and_no_shared_cells(encounter: tuple) -> None:
    grid, uavs, forbid_swaps, idle, order = encounter
    after, overruled = _resolve(grid, uavs, forbid_swaps, idle)
    active = [i for i in range(len(uavs)) if i not in idle]
    assert len({after[i] for i in active}) == len(active)
    assert all(after[i] == uavs[i][0] for i in idle)
    assert all(0 <= coordinate < grid for cell in after for coordinate in cell)

    renumbered = [uavs[i] for i in order]
    idle_renumbered = {order.index(i) for i in idle}
    again, overruled_again = _resolve(grid, renumbered, forbid_swaps, idle_renumbered)
    assert again == [after[i] for i in order]
    assert overruled_again == [overruled[i] for i in order]

    # Nobody is overruled without need: the cell asked for is off the grid or another's, or a
    # forbidden swap, given what all others did.
    for i in active:
        cell, action = uavs[i]
        wanted = (cell[0] + STEPS[action][0], cell[1] + STEPS[action][1])
        if overruled[i]:
            event("overruled")
            others = [j for j in active if j != i]
            claimed = {after[j] for j in others}
            for j in others:
                (x, y), asked = uavs[j]
                claimed.add((x + STEPS[asked][0], y + STEPS[asked][1]))
            assert not all(0 <= c < grid for c in wanted) or wanted in claimed or forbid_swaps
        else:
            assert after[i] == wanted


# --- energy ---

ENERGY = {"grid": 4, "zone": [1, 1, 2, 2], "nodes": [[0, 0]], "charge_start": 30}


def _one_slot(u: dict[str, Any], **scenario: Any) -> Any:
    """What a lone UAV with the given state is after one whole slot of ``rules.advance``."""
    state, world, scratch = _launched(Scenario.of(**(ENERGY | {"uavs": 1} | scenario)))
    own = state.uavs[0, 0]
    for name, value in u.items():
        own[name] = value
    arrivals = np.zeros(state.residual.shape[1], np.int64)
    compiled.advance(
        state.missions[0],
        state.uavs[0],
        state.residual[0],
        state.sensors[0],
        state.teeth[0],
        arrivals,
        *world,
        *scratch,
    )
    return own


IN_ZONE = {"x": 1, "y": 1, "action": HOVER, "battery": 25, "latch": True}


def test_a_latched_hovering_uav_in_the_zone_charges_and_does_not_communicate() -> None:
    u = _one_slot(IN_ZONE)
    assert (u["battery"], u["charging"], u["slots_charging"], u["slots_flying"]) == (35, True, 1, 0)
    assert (u["communications"], u["collected"]) == (0, 0.0)
    assert u["latch"]  # above C_S, but the latch holds until C_C


@pytest.mark.parametrize(
    "but",
    [
        {"latch": False, "battery": 31},  # not latched
        {"x": 0, "y": 1},  # next to the zone
        {"action": EAST},  # moves inside the zone
        {"x": 0, "y": 1, "action": EAST},  # moves into the zone
    ],
)
def test_without_one_of_the_conditions_it_flies_on(but: dict[str, Any]) -> None:
    u = _one_slot(IN_ZONE | but)
    assert u["battery"] == (IN_ZONE | but)["battery"] - 1
    assert (u["charging"], u["slots_charging"], u["slots_flying"]) == (False, 0, 1)
    assert u["communications"] == 4


@pytest.mark.parametrize(("x", "after"), [(0, 25), (1, 35)])
def test_without_flight_cost_the_battery_can_only_gain(x: int, after: int) -> None:
    u = _one_slot(IN_ZONE | {"x": x}, flight_cost=0)
    assert (u["battery"], u["slots_flying"], u["slots_charging"]) == (after, 1 - x, x)


def test_a_cancelled_move_does_not_start_charging() -> None:
    # model.md: the executed action is Hover because it was asked for or because it is charging.
    u = _one_slot(IN_ZONE | {"x": 0, "y": 1, "action": WEST}, zone=[0, 0, 2, 2])
    assert u["overruled"]
    assert (u["battery"], u["charging"], u["slots_charging"]) == (24, False, 0)


@pytest.mark.parametrize(
    ("battery", "complete", "rate", "after", "charging"),
    [
        (25, 80, 10, 35, True),
        (70, 80, 10, 80, False),
        (75, 80, 10, 80, False),
        (79, 80, 25, 80, False),
        (89, 100, 10, 99, True),
        (95, 100, 10, 100, False),
    ],
)
def test_charging_ends_at_c_c_and_never_above(
    battery: int, complete: int, rate: int, after: int, charging: bool
) -> None:
    begun = {"battery": battery, "charging": True, "pad_request": 0}
    u = _one_slot(IN_ZONE | begun, charge_complete=complete, charge_rate=rate)
    assert (u["battery"], u["charging"], u["latch"]) == (after, charging, charging)


def test_while_charging_the_action_is_hover_whatever_was_asked() -> None:
    begun = {"charging": True, "pad_request": 0, "action": EAST}
    u = _one_slot(IN_ZONE | begun)
    assert (u["x"], u["y"], u["battery"], u["overruled"]) == (1, 1, 35, False)


@pytest.mark.parametrize(
    ("battery", "latch", "after"),
    [
        (32, False, False),  # 31 > C_S
        (31, False, True),  # 30 <= C_S
        (31, True, True),
        (60, True, True),  # holds above C_S
        (81, True, False),  # 80 >= C_C
    ],
)
def test_the_latch_is_judged_at_the_start_of_the_next_slot(
    battery: int, latch: bool, after: bool
) -> None:
    u = _one_slot({"x": 0, "y": 0, "action": HOVER, "battery": battery, "latch": latch})
    assert u["latch"] == after


def test_the_latch_at_the_start_of_the_mission() -> None:
    def latch(flying_time: int) -> bool:
        state, _, _ = _launched(Scenario.of(**ENERGY, uavs=1, flying_time=flying_time))
        return bool(state.uavs[0, 0]["latch"])

    assert [latch(b) for b in (29, 30, 31, 80)] == [True, True, False, False]


# --- pads ---


def _queue(pads: int, requests: list[int], charging: list[int], slot: int = 9) -> list[int]:
    """Who charges after the grant: UAVs latched and hovering in the zone, -1 for a new request."""
    scenario = Scenario.of(zone=[0, 0, 4, 4], uavs=len(requests), pads=pads, charge_start=30)
    state, _, _ = _launched(scenario)
    state.missions["slot"] = slot
    team = state.uavs[0]
    team["latch"], team["battery"], team["action"] = True, 20, HOVER
    team["pad_request"], team["charging"] = requests, np.isin(range(len(requests)), charging)
    compiled.grant_pads(state.missions[0], team)
    assert (team["pad_request"] == np.where(np.array(requests) < 0, slot, requests)).all()
    return np.nonzero(team["charging"])[0].tolist()


def test_pads_are_granted_first_come_first_served() -> None:
    assert _queue(2, [-1, -1, -1], []) == [0, 1]  # ties in index order
    assert _queue(1, [8, 7, 6], []) == [2]  # the longest waiting
    assert _queue(2, [-1, 8, 3], [2]) == [1, 2]  # holders keep, waiting before new
    assert _queue(1, [-1, 8, 3], [2]) == [2]  # none free
    assert _queue(4, [-1, -1, -1], []) == [0, 1, 2]


def test_who_no_longer_hovers_leaves_the_queue() -> None:
    state, _, _ = _launched(Scenario.of(zone=[0, 0, 4, 4], uavs=3, pads=1, charge_start=30))
    team = state.uavs[0]
    team["latch"], team["battery"] = True, 20
    team["action"] = [EAST, HOVER, HOVER]
    team["pad_request"] = [1, 3, 2]
    compiled.grant_pads(state.missions[0], team)
    assert team["charging"].tolist() == [False, False, True]
    assert team["pad_request"].tolist() == [-1, 3, 2]


# --- communication, against a plain reference that prunes nothing ---


def _reference_snr(
    scenario: Scenario, u: Any, i: int, slot: int, n: int, seed: int, replication: int
) -> tuple[np.ndarray, np.ndarray]:
    """(K,) mean SNR and shadowing of eq. 10 [dB], all drawn, distances from metres."""
    m, c = scenario.communication_slots, scenario.cell_size
    x = c * (u["from_x"] + (u["x"] - u["from_x"]) * n / m)
    y = c * (u["from_y"] + (u["y"] - u["from_y"]) * n / m)
    nodes = np.array(scenario.nodes) * c
    d = np.sqrt((x - nodes[:, 0]) ** 2 + (y - nodes[:, 1]) ** 2 + scenario.altitude**2)
    d_edge = np.sqrt(2) / 2 * scenario.grid * c
    mean = scenario.edge_snr - 10 * scenario.path_loss_exponent * np.log10(d / d_edge)
    substream, word = ((n - 1) // 4 << 16) + i, (n - 1) % 4
    words = [
        streams.block(np.uint64(seed), replication, streams.SHADOWING, substream, slot, k)[word]
        for k in range(len(nodes))
    ]
    eta = special.ndtri((np.array(words, np.float64) + 0.5) / 2**32)
    return mean, np.sqrt(scenario.shadowing_variance) * eta


@st.composite
def _harvests(draw: st.DrawFn) -> tuple:
    # Slow decay and small grids: many nodes come close, so that shadowing decides.
    scenario = draw(
        scenarios(
            uavs=2,
            zone=(0, 0, 2, 1),
            pads=None,
            path_loss_exponent=draw(st.sampled_from([0.1, 2.27])),
            initial_data=(0.0, draw(st.sampled_from([0.5, 5.0, 40.0]))),
        )
    )
    flights = []
    for _ in range(2):
        x, y = draw(cells(scenario.grid))
        inside = [0 <= c < scenario.grid for dx, dy in STEPS for c in (x + dx, y + dy)]
        legal = [a for a in range(5) if inside[2 * a] and inside[2 * a + 1]]
        flights.append((x, y, draw(st.sampled_from(legal))))
    empty = draw(st.sets(st.integers(0, len(scenario.nodes) - 1), max_size=3))
    slot = draw(st.integers(0, 500))
    return scenario, flights, empty, slot, draw(seeds), draw(replications)


def _compare_with_reference(
    scenario: Scenario, flights: list, empty: Any, slot: int, seed: int, replication: int
) -> list[bool]:
    """One mission slot of communication; whether shadowing decided, per communication."""
    state, world, scratch = _launched(scenario, seed, replication)
    mission, team, residual = state.missions[0], state.uavs[0], state.residual[0]
    mission["slot"] = slot
    residual[list(empty)] = 0.0
    for u, (x, y, action) in zip(team, flights, strict=True):
        dx, dy = STEPS[action]
        u["from_x"], u["from_y"], u["x"], u["y"] = x, y, x + dx, y + dy
        u["executed"] = action
    delta_n = scenario.slot_length / scenario.communication_slots
    collected, decided = 0.0, []
    for n in range(1, scenario.communication_slots + 1):
        left = residual.copy()
        _communicate(state, world, scratch, n)
        for i, u in enumerate(team):
            if not (left > 0).any():
                assert u["served"] == -1
                continue
            mean, eta = _reference_snr(scenario, u, i, slot, n, seed, replication)
            snr = np.where(left > 0, mean + eta, -np.inf)
            best = int(u["served"])
            # Without shadowing nodes can tie; the table and the metres round differently.
            assert best == np.argmax(snr) or snr[best] > snr.max() - 1e-9
            decided.append(mean[best] < mean[left > 0].max() - 1e-9)
            rate = delta_n * np.log2(1 + 10 ** (snr[best] / 10))
            assert u["amount"] == pytest.approx(min(rate, left[best]), abs=1e-9)
            left[best] -= u["amount"]
            assert left[best] >= 0
            collected += u["amount"]
        np.testing.assert_array_equal(residual, left)
    assert mission["slot_collected"] == pytest.approx(collected, abs=1e-9)
    assert team["collected"].sum() == pytest.approx(collected, abs=1e-9)
    assert team["communications"].sum() == len(decided)
    return decided


@given(_harvests())
def test_communication_equals_the_plain_reference(harvest: tuple) -> None:
    decided = _compare_with_reference(*harvest)
    if not decided:
        event("nothing to serve")
    elif any(decided):
        event("shadowing decides")


def test_communication_equals_the_plain_reference_where_shadowing_decides() -> None:
    nodes = [[x, y] for x in range(6) for y in range(6)]
    scenario = Scenario.of(
        grid=6, zone=[2, 2, 2, 1], nodes=nodes, uavs=2, altitude=2000, shadowing_variance=9
    )
    decided = []
    for slot in range(60):
        flights = [(slot % 6, 3, HOVER), (2, slot % 5, SOUTH)]
        decided += _compare_with_reference(scenario, flights, [slot % 36], slot, 2**64 - 1, slot)
    assert len(decided) == 60 * 2 * 4
    assert 0.3 < np.mean(decided) < 1.0


def test_ties_go_to_the_node_of_lowest_index() -> None:
    for nodes in ([[0, 1], [2, 1], [1, 0], [1, 2]], [[1, 2], [1, 0], [2, 1], [0, 1]]):
        scenario = Scenario.of(
            grid=3, zone=[1, 1, 1, 1], nodes=nodes, uavs=1, shadowing_variance=0.0
        )
        state, world, scratch = _launched(scenario)
        _communicate(state, world, scratch, 1)
        assert state.uavs[0, 0]["served"] == 0
        state.residual[0, 0] = 0.0
        _communicate(state, world, scratch, 2)
        assert state.uavs[0, 0]["served"] == 1


def test_charging_and_inactive_uavs_do_not_communicate() -> None:
    state, world, scratch = _launched(Scenario.of(uavs=3))
    team = state.uavs[0]
    team["charging"][0], team["active"][1] = True, False
    _communicate(state, world, scratch, 1)
    assert team["served"].tolist()[:2] == [-1, -1]
    assert team["communications"].tolist() == [0, 0, 1]


# --- arrivals and settlement ---


def test_arrivals_are_the_poisson_deviates_of_their_coordinates() -> None:
    scenario = Scenario.of(arrival_rate=1.5, nodes=[[k, 0] for k in range(7)])
    state, _, _ = _launched(scenario, 8, 9)
    arrivals = np.zeros(state.residual.shape[1], np.int64)
    before = state.residual[0].copy()
    state.missions["slot"] = 33
    compiled.arrive(state.missions[0], state.residual[0], arrivals)
    words = [
        streams.block(np.uint64(8), 9, streams.ARRIVAL, 0, 33, k // 4)[k % 4] for k in range(7)
    ]
    packets = [streams.poisson(word, 1.5) for word in words]
    assert sum(packets) > 0
    np.testing.assert_array_equal(state.residual[0], before + packets)
    assert arrivals.tolist() == packets
    assert state.missions[0]["arrived"] == sum(packets)


SETTLED = [
    # communications, battery, slots done -> end, and the reward beside data and step
    ((439, 1, 5), ACTIVE, 0.0),
    ((440, 1, 5), QUOTA, 100.0),
    ((442, 1, 5), QUOTA, 100.0),
    ((439, 0, 5), BATTERY, -300.0),
    ((440, 0, 5), QUOTA, 100.0),  # in the slot in which b reaches 0 the quota counts as filled
    ((439, 1, 499), TRUNCATED, 0.0),
    ((440, 1, 499), QUOTA, 100.0),
    ((439, 0, 499), BATTERY, -300.0),
]


@pytest.mark.parametrize(("progress", "end", "bonus"), SETTLED)
@pytest.mark.parametrize("overruled", [False, True])
def test_settlement(
    progress: tuple[int, int, int], end: int, bonus: float, overruled: bool
) -> None:
    state, _, _ = _launched(Scenario.of(uavs=2))
    mission, (u, mate) = state.missions[0], state.uavs[0]
    u["communications"], u["battery"], mission["slot"] = progress
    u["overruled"] = overruled
    mission["slot_collected"] = 7.0  # by the whole team: each UAV is paid for all of it
    compiled.settle(mission, state.uavs[0])
    assert u["end"] == end
    assert u["active"] == (end == ACTIVE)
    assert mission["active"] == int(u["active"]) + int(mate["active"])
    assert mate["end"] == (TRUNCATED if progress[2] == 499 else ACTIVE)
    assert u["reward"] == pytest.approx(1.3 * 7 - 0.1 + bonus - overruled, abs=1e-12)
    assert mate["reward"] == pytest.approx(1.3 * 7 - 0.1, abs=1e-12)
    assert u["total_reward"] == u["reward"]
    assert mission["slot"] == progress[2] + 1


def test_charging_is_rewarded_and_the_inactive_get_nothing() -> None:
    state, _, _ = _launched(Scenario.of(uavs=2))
    u, gone = state.uavs[0]
    u["charging"], u["battery"] = True, 50
    gone["active"], gone["reward"], gone["total_reward"] = False, 3.0, 3.0
    state.missions["slot_collected"] = 2.0
    compiled.settle(state.missions[0], state.uavs[0])
    assert u["reward"] == pytest.approx(1.3 * 2 - 0.1 + 0.05, abs=1e-12)
    assert (gone["reward"], gone["total_reward"]) == (0.0, 3.0)
