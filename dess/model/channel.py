"""The channel: mean SNR, shadowing and the search for the best node of a UAV (eq. 9-11).

A table holds, for each step of a UAV, the nodes in descending order of mean SNR. Shadowing is drawn
only for nodes that can still be the best. The normal deviates are bounded (``streams.MAX_NORMAL``),
so the search ends as soon as the mean SNR of all further nodes, plus the largest possible
shadowing, lies below the best SNR found.
"""

import math
from functools import lru_cache
from threading import get_ident
from typing import Any, NamedTuple

import numpy as np

from dess.base.elementary import exp, log1p
from dess.base.kernels import inlined, kernel, shared_kernel
from dess.model.link import Link, mean_snr_at
from dess.model.state import STEP_X, STEP_Y
from dess.physics import fleet, streams
from dess.physics.chart import Cell, Chart, chart_at, read_only
from dess.physics.radio import has_max_rate, has_steps, step_efficiency
from dess.scenario.fields import Fields
from dess.scenario.scenario import ScenarioSpace

GROUP = 4  # communication slots whose shadowing one Philox block holds
_BATCH = 8  # nodes whose shadowing is drawn together: as many as a vector register holds

_DB_TO_LOG = 2.302585092994046 / 10.0  # ln 10
_PER_LOG_2 = 1.0 / 0.6931471805599453  # ln 2

# Eight nodes that a UAV may serve in a group of communication slots.
BATCH = np.dtype(
    [
        ("node", np.int64, _BATCH),
        ("mean", np.float64, (GROUP, _BATCH)),  # mean SNR per communication slot [dB]
        ("words", np.uint64, (GROUP, _BATCH)),  # random words of the shadowing, per slot
        ("snr", np.float64, (GROUP, _BATCH)),  # SNR [dB], or an upper bound of it
        ("top", np.int64, GROUP),  # place of the highest SNR per communication slot
        ("rest", np.float64),  # highest mean SNR in the slot of all nodes behind these [dB]
    ]
)


class Site(NamedTuple):
    """All that a world is made of; scenarios with equal sites share one.

    Attributes:
        geometry: What their chart is made of.
        nodes: The cells of the sensor nodes.
        cell_size: The side of a cell [m].
        communication_slots: The communication slots of a mission slot.
        places, phases: What the speeds of the fleet ask for (``fleet.places_per_slot``,
            ``fleet.move_phases``).
        link: The link budget.
    """

    geometry: tuple[Any, ...]
    nodes: tuple[Cell, ...]
    cell_size: float
    communication_slots: int
    places: int
    phases: int
    link: Link

    @classmethod
    def of(cls, scenario: Fields) -> "Site":
        """The site of a scenario."""
        return cls(
            scenario.geometry,
            scenario.nodes,
            scenario.cell_size,
            scenario.communication_slots,
            fleet.places_per_slot(scenario.fleet),
            fleet.move_phases(scenario.fleet),
            Link.of(scenario),
        )


class World(NamedTuple):
    """The nodes and the tables of the channel, shared by all missions of a batch.

    A step is an action together with the cell that it leads to. The row of a step in ``order`` and
    ``means`` is computed when it is first needed; all other arrays are read-only. A copy shares
    them all.

    Attributes:
        nodes: (K, 2) cells of the sensor nodes.
        mean_snr: (M, F * (M - 1) + 1) mean SNR [dB] at a distance of ``a`` cells along one axis and
            ``b / F`` cells along the other, where M is the longer side of the grid; minus infinity
            out of range. These are all relative positions from which a UAV can serve a node. F is
            m, or a multiple of it if a move may take several slots.
        order: (5 * W * H, K + 1) for each step on a grid of W x H cells, the nodes in descending
            order of their highest mean SNR in the slot; the last column tells whether the row is
            filled. If a move may take several slots, there are such rows for each phase
            (``fleet.move_phase``).
        means: (5 * W * H, K, m) for each step, the mean SNR [dB] of the nodes in that order, per
            communication slot; rows as in ``order``.
        chart: The zones, the no-fly cells and the ways between cells.
    """

    nodes: np.ndarray
    mean_snr: np.ndarray
    order: np.ndarray
    means: np.ndarray
    chart: Chart

    @classmethod
    def of(
        cls, nodes: np.ndarray, mean_snr: np.ndarray, chart: Chart, steps: int, m: int
    ) -> "World":
        """The world of these nodes, with empty rows for so many steps."""
        # The operating system allocates memory page by page as the rows are filled.
        order = np.zeros((steps, len(nodes) + 1), np.int16)
        means = np.zeros((steps, len(nodes), m))
        return cls(read_only(nodes), read_only(mean_snr), order, means, chart)

    def __deepcopy__(self, memo: dict[int, Any]) -> "World":
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return World.of, (
            self.nodes,
            self.mean_snr,
            self.chart,
            len(self.order),
            self.means.shape[2],
        )

    def shown(self) -> "World":
        """The same world, of which nothing can be written to."""
        order = read_only(self.order.view())
        means = read_only(self.means.view())
        return World(self.nodes, self.mean_snr, order, means, self.chart)


class Scratch(NamedTuple):
    """Working memory of a slot.

    Attributes:
        batches: (I, C) ``BATCH`` records: the nodes tried for each UAV, eight at a time.
        search: (I, 4) for each UAV, the number of batches drawn, the rank of the next node to draw,
            the row of the UAV's step, and the number of nodes in a batch, which is always eight.
            The compiled code reads this last number at run time, because the compiler does not
            vectorise a loop that it knows to be so short.
        arrivals: (K,) the new data of the slot [data units].
    """

    batches: np.ndarray
    search: np.ndarray
    arrivals: np.ndarray


DRAWN, RANK, ROW, WIDTH = range(4)  # columns of Scratch.search


def empty_scratch(uavs: int, nodes: int) -> Scratch:
    """Working memory for missions of at most that many UAVs and nodes."""
    search = np.zeros((uavs, 4), np.int64)
    search[:, WIDTH] = _BATCH
    return Scratch(np.zeros((uavs, -(-nodes // _BATCH)), BATCH), search, np.zeros(nodes))


def world_of(scenario: ScenarioSpace) -> World:
    """The nodes of a scenario and the tables of its channel (eq. 10, in dB).

    Every thread has its own tables, because each thread fills them row by row while it simulates.
    """
    return _world_of(Site.of(scenario), get_ident())


@lru_cache(maxsize=8)
def _world_of(site: Site, thread: int) -> World:
    return make_world(site)


def make_world(site: Site) -> World:
    """The world of a site, new: it is not kept for the next mission."""
    chart = chart_at(*site.geometry)
    m = site.communication_slots
    places = m * site.places
    steps = 5 * chart.zones.size * site.phases
    longest = max(chart.zones.shape)
    fine = np.arange(places * (longest - 1) + 1)
    mean_snr = np.empty((longest, len(fine)))
    for row in range(longest):  # each takes a moment, all of a large grid may take seconds
        # From an integer: at equal distances, the SNR is equal to the bit.
        coarse = places * row
        squares = coarse * coarse + fine * fine
        mean_snr[row] = mean_snr_at(site.link, site.cell_size * (np.sqrt(squares) / places))
    return World.of(np.array(site.nodes, np.int64), mean_snr, chart, steps, m)


@shared_kernel
def _fill_row(u, row, nodes, mean_snr, order, means):
    """Fill the row of a step: the nodes by descending mean SNR (ties: lower index), and the SNR.

    The functions of numpy that sort and copy arrays would take seconds to compile.
    """
    count, m = means.shape[1:]
    places = (mean_snr.shape[1] - 1) // (mean_snr.shape[0] - 1)  # per cell
    part = places // (m * u.slots_per_cell)  # places that the UAV flies per communication slot
    step = STEP_X[u.executed] + STEP_Y[u.executed]
    along_x = STEP_Y[u.executed] == 0
    value = np.empty((count, m))
    high = np.empty(count)
    for k in range(count):
        high[k] = -math.inf
        order[row, k] = k
        dx = u.x - nodes[k, 0]
        dy = u.y - nodes[k, 1]
        fine, coarse = (places * dx, dy) if along_x else (places * dy, dx)
        for n in range(m):  # the UAV has still this part of the step before it
            ahead = (u.slots_left * m + m - 1 - n) * part
            value[k, n] = mean_snr[abs(coarse), abs(fine - ahead * step)]
            high[k] = max(high[k], value[k, n])
    gap = count // 2
    while gap > 0:  # Shell's sort
        for end in range(gap, count):
            k = order[row, end]
            rank = end
            while rank >= gap and _is_before(high, k, order[row, rank - gap]):
                order[row, rank] = order[row, rank - gap]
                rank -= gap
            order[row, rank] = k
        gap //= 2
    for rank in range(count):
        for n in range(m):
            means[row, rank, n] = value[order[row, rank], n]
    order[row, count] = 1


@inlined
def _is_before(high, k, other):
    return high[k] > high[other] or (high[k] == high[other] and k < other)


@inlined
def open_slot(mission, uavs, nodes, mean_snr, order, means, zones, search):
    """Begin a mission slot: find the rows of the UAVs' steps, and fill them where they are new."""
    rows, columns = zones.shape
    for i in range(mission.uavs):
        u = uavs[i]
        if u.active:
            phase = fleet.move_phase(u)
            row = ((phase * 5 + u.executed) * rows + u.y) * columns + u.x
            search[i, ROW] = row
            if order[row, mission.nodes] == 0:
                _fill_row(u, row, nodes, mean_snr, order, means)


@inlined
def open_group(i, search):
    """Begin a group of communication slots for UAV ``i``, without drawing any shadowing."""
    search[i, DRAWN], search[i, RANK] = 0, 0


@inlined
def best_node(mission, i, residual, order, means, batches, search, n):
    """The highest SNR [dB] of UAV ``i`` among the nodes with data, and the index of that node.

    The index is -1 if no node has data. On a tie the node with the lowest index wins. The arrays of
    ``World`` and ``Scratch`` are passed one by one, because the reference counting of tuples would
    cost more time than the search itself.

    Args:
        mission: ``MISSION`` record.
        i: Index of the UAV.
        residual: (K,) residual data [data units].
        order, means: As in ``World``.
        batches, search: As in ``Scratch``; ``open_slot`` and ``open_group`` must have begun the
            mission slot and the group of slot ``n``.
        n: Communication slot, 1..m.
    """
    group = (n - 1) // GROUP
    word = (n - 1) % GROUP
    reach = mission.shadowing_deviation * streams.MAX_NORMAL
    best = -math.inf
    node = -1
    for count in range(batches.shape[1]):
        batch = batches[i, count]
        if count == search[i, DRAWN]:
            rank, row = search[i, RANK], search[i, ROW]
            search[i, DRAWN] += 1
            search[i, RANK] = _fill_batch(mission, residual, order, means, row, rank, group, batch)
            _draw(mission, group * 65536 + i, batch, search[i, WIDTH])
        snr, k = _best_of_batch(mission, residual, batch, word, search[i, WIDTH])
        if snr > best or (snr == best and k < node):
            best = snr
            node = k
        if batch.rest + reach < best or batch.rest == -math.inf:
            break
    return best, node


@inlined
def _fill_batch(mission, residual, order, means, row, rank, group, batch):
    """Put the next nodes of a row, from a rank on, into a batch; return the rank after the last."""
    node, mean = batch.node, batch.mean
    first = group * GROUP
    count = min(GROUP, mission.communication_slots - group * GROUP)
    place = 0
    while place < _BATCH and rank < mission.nodes:
        k = order[row, rank]
        node[place] = k
        for word in range(count):
            mean[word, place] = means[row, rank, first + word]
        rank += 1
        place += residual[k] > 0.0
    for empty in range(place, _BATCH):
        node[empty] = 0
        mean[:, empty] = -math.inf  # never wins
    batch.rest = -math.inf
    if rank < mission.nodes:
        for word in range(count):
            batch.rest = max(batch.rest, means[row, rank, first + word])
    return rank


@inlined
def _draw(mission, substream, batch, width):
    """Draw the shadowing of a batch and set the SNR [dB] of its nodes.

    In the tails of the normal distribution, an upper bound is set in place of the SNR; it is
    replaced by the exact value only where that value is needed (``_best_of_batch``).
    """
    words, mean, snr = batch.words, batch.mean, batch.snr
    streams.blocks(
        mission.seed, mission.replication, streams.SHADOWING, substream, mission.slot,
        batch.node, words, width,
    )  # fmt: skip
    _add_shadowing(mean, words, mission.shadowing_deviation, snr, width)
    for word in range(GROUP):
        batch.top[word] = _top(batch.node, snr, word, width)


@kernel
def _add_shadowing(mean, words, deviation, snr, width):
    """The SNR [dB] of nodes. As a function that is optimized on its own, it becomes vector code."""
    for word in range(GROUP):
        for place in range(width):
            deviate = streams.normal_or_bound(words[word, place])
            snr[word, place] = mean[word, place] + deviation * deviate


@inlined
def _best_of_batch(mission, residual, batch, word, width):
    """The highest SNR [dB] in a batch and its node, -1 if no node of the batch has data."""
    exact = 0  # a bit per place: whether its bound has been replaced by the exact value
    while True:
        place = batch.top[word]
        node = batch.node[place]
        snr = batch.snr[word, place]
        if snr == -math.inf:
            return snr, -1
        drawn = batch.words[word, place]
        if residual[node] <= 0.0:  # emptied since the batch was drawn
            batch.snr[word, place] = -math.inf
        elif streams.is_central(drawn) or exact >> place & 1:
            return snr, node
        else:
            deviate = streams.normal(drawn)
            batch.snr[word, place] = batch.mean[word, place] + mission.shadowing_deviation * deviate
            exact |= 1 << place
        batch.top[word] = _top(batch.node, batch.snr, word, width)


@inlined
def _top(node, snr, word, width):
    """The place of the highest SNR in a communication slot; on a tie, of the lowest node index."""
    best = snr[word, 0]
    for place in range(1, _BATCH):
        value = snr[word, place]
        best = value if value > best else best
    first = 2**62
    for place in range(width):
        key = node[place] * _BATCH + place
        key = key if snr[word, place] == best else 2**62
        first = key if key < first else first
    return first % _BATCH


@inlined
def rate(mission, snr):
    """Data units per communication slot at an SNR [dB] (eq. 9)."""
    return mission.communication_slot_length * efficiency(mission, snr)


@inlined
def efficiency(mission, snr):
    """The spectral efficiency [bit/s/Hz] at an SNR [dB]: of a step, or ``log2(1 + SNR)``."""
    if has_steps(mission):
        return step_efficiency(mission, snr)
    shannon = _PER_LOG_2 * log1p(exp(snr * _DB_TO_LOG))
    if has_max_rate(mission):
        return min(shannon, mission.max_rate)
    return shannon
