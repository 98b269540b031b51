"""A year at sea: the windows of weather of a fleet, and what it carries from one to the next.

    campaign = Campaign(space, seed, replication)
    while campaign.begin_window(starts, b) >= 0:   # writes what mission b starts from
        ...                                        # launch it, and run it to its end
        campaign.end_window(record, state, b)      # takes what it ends with
    campaign.end_year(records, row)

A window is a mission that begins with the data, ages, batteries and failures with which the one
before it has ended, and with what has come in between. The times of a campaign are whole
milliseconds from the beginning of its year, those of a window are its mission slots.
"""

from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import fsum
from typing import NamedTuple

import numpy as np

from dess.base.elementary import exp, log
from dess.base.errors import InputError
from dess.base.kernels import inlined, kernel
from dess.model.record import AGES_OF_MONTHS, UAV_RECORD, MissionRecord, Records
from dess.model.rules import draw_idle_data
from dess.model.state import BATTERY, LOST, Starts, State, constants_of, types_of
from dess.physics import streams
from dess.physics.charging import charge_limit, charged_after, slots_to_charge
from dess.physics.energy import ACTIONS, SPEEDS, Consumption
from dess.physics.fleet import slowest
from dess.scenario.fields import SAMPLED
from dess.scenario.quantities import measured
from dess.scenario.scenario import ScenarioSpace
from dess.scenario.weather import Weather
from dess.scenario.weather.hours import HourState, Year, hours_of, years
from dess.scenario.weather.windows import windows_of

HOUR = 3_600_000  # [ms]
MOST_HOURS = 16_384  # of a year, in the numbers of the replications of its windows


class YearWindow(NamedTuple):
    """A run of open hours in which UAVs may fly.

    Attributes:
        first: The hour of the year in which it begins.
        hours: How many hours it has.
        costs: (S, 5) what slots take [% / 1000]: of each move and of hovering the largest of its
            hours, for UAVs that take 1, 2, ... slots for a cell.
    """

    first: int
    hours: int
    costs: np.ndarray


@dataclass(frozen=True, eq=False)
class YearPlan:
    """What the weather of a year lets a fleet do.

    Attributes:
        year: The year.
        hours: How many hours it has.
        operating: In how many of them the fleet would fly if the weather were fair.
        windows: Its windows, in order.
    """

    year: int
    hours: int
    operating: int
    windows: list[YearWindow]

    @cached_property
    def month_ends(self) -> list[int]:
        """The hours of the year in which its months end."""
        starts = np.arange(f"{self.year}-02", f"{self.year + 1}-02", dtype="datetime64[M]")
        begin = np.datetime64(f"{self.year}-01-01T00")
        return (starts.astype("datetime64[h]") - begin).astype(int).tolist()

    def month_of(self, hour: int) -> int:
        """The month of an hour of the year, from 0 on."""
        return bisect_right(self.month_ends, hour)

    @property
    def open_share(self) -> float:
        """The share of the operating hours that windows have."""
        return fsum(window.hours for window in self.windows) / max(self.operating, 1)

    @property
    def longest_gap(self) -> int:
        """The longest time without a window [h], that before the first and after the last too."""
        ends = [0, *(window.first + window.hours for window in self.windows)]
        begins = [*(window.first for window in self.windows), self.hours]
        return max(begin - end for begin, end in zip(begins, ends, strict=True))


@lru_cache(maxsize=64)
def plan_of(space: ScenarioSpace, year: Year) -> YearPlan:
    """What the weather of a year lets the fleet of a scenario do."""
    assert space.units
    hours = hours_of(space)
    state = hours.state[year.first : year.first + year.hours]
    longest = space.weather.longest_hours
    windows = [
        YearWindow(first - year.first, count, hours.costs[first : first + count].max(axis=0))
        for first, count in windows_of(hours, year, longest, space.units.slot)
    ]
    operating = int(np.count_nonzero(state != HourState.NIGHT))
    return YearPlan(year.year, year.hours, operating, windows)


def check_years(spaces: Iterable[ScenarioSpace], replications: np.ndarray) -> None:
    """Refuse replications that are years which the weather of a scenario does not have.

    Raises:
        InputError: If there are fewer whole years, or if fleets or batteries are drawn at random.
    """
    for space in spaces:
        if not space.weather.is_on:
            continue
        for name in SAMPLED:
            low, high = getattr(space, name)
            if low != high:
                raise InputError(name, f"[{low}, {high}] is drawn", "one number, with weather")
        whole = len(years(hours_of(space)))
        if len(replications) and replications.max() >= whole:
            problem = f"{replications.max() + 1} years are asked for"
            raise InputError("years", problem, f"{whole} at most, the whole ones of the weather")


def years_of(space: ScenarioSpace, seed: int) -> list[Year]:
    """The whole years of the weather of a scenario, in the order of their replications.

    The order is drawn by the seed, so that a few of them are a sample of all.
    """
    whole = years(hours_of(space))
    words = [streams.block(np.uint64(seed), 0, streams.YEAR, 0, 0, n)[0] for n in range(len(whole))]
    return [whole[n] for n in sorted(range(len(whole)), key=lambda n: (int(words[n]), n))]


class Uav:
    """A UAV of a fleet between windows.

    Attributes:
        number: Its number in the fleet.
        state: Its ``UAV`` record at the start of the next window.
        arrives: When the one that replaces it arrives [ms], or 0 if it is there.
    """

    def __init__(self, number: int, kind: np.void):
        self.number = number
        self.kind = kind
        self.arrives = 0
        self.state = kind.copy()

    @property
    def has_cell(self) -> bool:
        """Whether it stands in a zone; a new one is put on a cell when a window begins."""
        return bool(self.state["x"] >= 0)

    def replace(self, arrives: int) -> None:
        """Let a new UAV take its place at a time [ms]."""
        self.state = self.kind.copy()
        self.arrives = arrives

    def land(self, record: np.void) -> None:
        """Take the battery and the cell with which a window has ended."""
        for name in ("x", "y", "from_x", "from_y", "zone", "battery", "remainder", "grounded"):
            self.state[name] = record[name]


class Campaign:
    """A year of a fleet, window by window."""

    def __init__(self, space: ScenarioSpace, seed: int, replication: int):
        """Begin a year with nodes that have just been emptied, and full batteries.

        Args:
            space: The scenario of the fleet, which has weather.
            seed: Seed of the study.
            replication: The number of the year among its replications.
        """
        assert space.units
        self.space = space
        self.replication = replication
        self.plan = plan_of(space, years_of(space, seed)[replication])
        self.slot = 1000 * space.units.slot  # [ms]
        self.mission = constants_of(space).view(np.recarray)
        self.mission.seed = seed
        self.mission.replication = replication
        self.mission.age_measured = 0
        self.mission.due = 1000 * measured(space.weather.due, "s")[0] / self.slot
        self.rates = np.array(space.node_rates)
        self.data = np.array([low for low, _ in space.node_data])
        self.emptied = np.zeros(len(self.rates), np.int64)  # when each node was emptied last [ms]
        self.silent = np.zeros(len(self.rates), np.bool_)
        self.fleet = [Uav(i, kind) for i, kind in enumerate(types_of(space).view(np.recarray))]
        self.flying: list[Uav] = []  # in the present window, in the order of its mission
        self.spares = space.data_sheet.spares
        self.ordered: list[int] = []  # when new spares arrive [ms]
        self.next = 0  # the number of the next window in the plan
        self.clock = 0  # the end of the last window [ms]
        self.totals = Totals(self.data, len(self.fleet))

    def begin_window(self, starts: Starts, b: int) -> int:
        """Write what the next window with a UAV starts from into row ``b``.

        Returns:
            The number of its replication, or -1 if the year has no further window.
        """
        while self.next < len(self.plan.windows):
            window = self.plan.windows[self.next]
            begin = window.first * HOUR
            slots = int(window.hours * HOUR / self.slot + 1e-9)
            number = MOST_HOURS * self.replication + window.first
            if slots > 0 and self._prepare_fleet(begin, number):
                self._write_start(starts, b, window, slots, begin)
                return number
            self.next += 1
        return -1

    def _prepare_fleet(self, begin: int, number: int) -> bool:
        """Replace, repair and charge UAVs until a window begins; return whether there is one."""
        awaited = [arrives for arrives in self.ordered if arrives > begin]
        self.spares += len(self.ordered) - len(awaited)
        self.ordered = awaited
        self.flying = []
        for uav in self.fleet:
            if uav.arrives > begin and self.spares > 0:
                self.spares -= 1
                self.ordered.append(uav.arrives)
                uav.arrives = 0
            if uav.arrives <= begin and (uav.has_cell or self._put_on_free_cell(uav)):
                self.flying.append(uav)
        if not self.flying:  # the gap goes on, so that nothing in it happens yet
            return False
        gap = (begin - self.clock) / self.slot
        grounded = np.array([uav.state["grounded"] for uav in self.fleet])
        repair_in_gap(self.mission[0], number, gap, self.silent, grounded)
        for uav, is_grounded in zip(self.fleet, grounded, strict=True):
            uav.state["grounded"] = is_grounded
        self.charge(gap)
        return True

    def _put_on_free_cell(self, uav: Uav) -> bool:
        """Put a new UAV on the first free cell of a zone, if another UAV stands in some zone."""
        taken = {(int(u.state["x"]), int(u.state["y"])) for u in self.fleet if u.has_cell}
        if not taken:
            return True  # all are new: their cells are drawn when the mission is launched
        for zone, (x0, y0, width, height) in enumerate(self.space.rectangles):
            for cell in range(width * height):
                x = x0 + cell % width
                y = y0 + cell // width
                if (x, y) not in taken:
                    full = uav.state["battery"] or self.mission[0].flying_time
                    place = {"x": x, "y": y, "from_x": x, "from_y": y}
                    for name, value in {**place, "zone": zone, "battery": full}.items():
                        uav.state[name] = value
                    return True
        return False

    def charge(self, gap: float) -> None:
        """Charge the UAVs for so many slots, on the working pads of the zones where they stand.

        They are charged one after the other, the lowest battery first.
        """
        mission = self.mission[0]
        for zone, pads in enumerate(self._working_pads()):
            free = [int(gap)] * pads
            budget = int(gap) * int(mission.power)
            parked = [uav for uav in self.fleet if uav.has_cell and uav.state["zone"] == zone]
            for uav in sorted(parked, key=lambda uav: (int(uav.state["battery"]), uav.number)):
                u = uav.state
                lacking = min(int(charge_limit(mission, u)), int(mission.charge_complete))
                lacking -= int(u["battery"])
                if uav.state["grounded"] or not free or lacking <= 0:
                    continue
                pad = int(np.argmax(free))
                slots = min(int(slots_to_charge(mission, u, lacking)), free[pad])
                added = min(int(charged_after(mission, u, slots)), lacking)
                if mission.power > 0:
                    added = min(added, budget)
                    budget -= added
                free[pad] -= slots
                u["battery"] += added
                self.totals.uavs["charged"][uav.number] += added

    def _working_pads(self) -> list[int]:
        """The working pads of each zone."""
        ends = np.cumsum(self.space.zone_pads)
        by_zone = np.split(self.mission[0].pads_out, ends)[: len(ends)]
        return [len(out) - int(np.count_nonzero(out)) for out in by_zone]

    def _write_start(
        self, starts: Starts, b: int, window: YearWindow, slots: int, begin: int
    ) -> None:
        mission = starts.constants[b : b + 1].view(np.recarray)
        mission[0] = self.mission[0]
        costs = np.ones((SPEEDS, ACTIONS), np.int64)
        costs[: len(window.costs)] = window.costs
        most = costs[: slowest(self.space.fleet)].max()
        gap = (begin - self.clock) / self.slot
        mission.max_slots = slots
        mission.idle = gap
        mission.energy = b
        mission.slot_costs = costs.reshape(-1)
        mission.max_slot_cost = mission.waiting_slot = most
        starts.ranges[b, 0] = len(self.flying)
        for i, uav in enumerate(self.flying):
            starts.uavs[b, i] = uav.state
        starts.data[b] = (self.data + self.rates * gap)[:, None]
        starts.rates[b] = self.rates
        starts.ages[b] = (self.clock - self.emptied) / self.slot
        starts.silent[b] = self.silent
        self._count_closed(begin)

    def scenario_of_window(self) -> ScenarioSpace:
        """The scenario of the next window, as a mission without weather."""
        window = self.plan.windows[self.next]
        rows = window.costs[: slowest(self.space.fleet)].tolist()
        costs = tuple((north, east, south, west, hover) for north, east, south, west, hover in rows)
        return self.space.model_copy(
            update={
                "weather": Weather.off(),
                "data_sheet": self.space.data_sheet.model_copy(update={"horizon": None}),
                "max_slots": int(window.hours * HOUR / self.slot + 1e-9),
                "consumption": Consumption(slots=costs),
            }
        )

    def end_window(self, record: MissionRecord, state: State, b: int) -> None:
        """Take over what the window of mission ``b`` has ended with."""
        assert record.nodes is not None
        mission = state.missions[b]
        sensors = state.sensors[b]
        nodes = len(self.data)
        newest = np.rint(sensors["newest"][:nodes] * self.slot).astype(np.int64)
        self.totals.arrived += record.nodes["initial"] - self.data  # in the gap before the window
        month = self.plan.month_of(self.plan.windows[self.next].first)
        self.totals.count_window(record, mission, sensors["late"], month)
        self.emptied = np.where(newest > 0, self.clock + newest, self.emptied)
        self.clock += round(int(mission["slot"]) * self.slot)
        self.data = record.nodes["residual"].copy()
        self.silent = sensors["silent"].copy()
        self.mission[0].pads_out = mission["pads_out"]
        for uav, u, row in zip(self.flying, state.uavs[b], record.uavs, strict=False):
            self.totals.count_uav(uav.number, row)
            if u["end"] in (BATTERY, LOST) or u["zone"] < 0:
                self.totals.uavs["down"][uav.number] += 1
                uav.replace(self.clock + self.space.data_sheet.delivery_ms)
            else:
                uav.land(u)
        self.next += 1

    def end_year(self, records: Records, row: int) -> None:
        """Close the year after its last window, and write its record."""
        end = self.plan.hours * HOUR
        gap = (end - self.clock) / self.slot
        mission = self.mission[0]
        mission.replication = MOST_HOURS * self.replication + self.plan.hours
        collected = collect_idle_data(mission, self.rates * gap)
        self._count_closed(end)
        self.totals.arrived += collected
        self.data = self.data + collected
        self.totals.late += np.maximum((end - self.emptied) / self.slot - mission.due, 0.0)
        mission.replication = self.replication
        self._write_year(records, row, end / self.slot)

    def _count_closed(self, until: int) -> None:
        """Count the ages from the end of the last window to a time [ms], month by month."""
        while self.clock < until:
            month = self.plan.month_of(self.clock // HOUR)
            end = min(until, self.plan.month_ends[month] * HOUR)
            age = (self.clock - self.emptied) / self.slot
            gap = (end - self.clock) / self.slot
            self.totals.count_ages((age + gap / 2) * gap, month)
            self.clock = end

    def _write_year(self, records: Records, row: int, slots: float) -> None:
        """Write the record of a year of so many slots."""
        year = records.missions[row]
        totals = self.totals
        mission = self.mission[0]
        for name in ("seed", "replication", "flying_time", "charge_start", "charge_complete"):
            year[name] = mission[name]
        windows = max(totals.windows, 1)
        year["uavs"], year["slots"] = len(self.fleet), totals.slots  # hours are paid in windows
        year["success"] = totals.success / windows
        year["home"] = totals.home / windows
        year["initial"] = fsum(totals.initial)
        year["arrived"] = fsum(totals.arrived)
        year["collected"] = totals.lands
        year["residual"] = fsum(self.data)
        year["reward"] = fsum(totals.uavs["reward"])
        year["uav_slots"] = totals.slots_of_uavs("slots_flying", "slots_charging")
        data = year["initial"] + year["arrived"]
        year["collection_ratio"] = min(max(totals.lands / data, 0.0), 1.0) if data > 0 else 1.0
        year["collection_ratio_and_communication"] = year["collection_ratio"] * year["success"]
        fleet = len(self.fleet)
        records.uavs[row, :fleet] = totals.uavs
        records.uavs["battery"][row, :fleet] = [uav.state["battery"] for uav in self.fleet]
        self._write_nodes(records.nodes[row], slots)
        self._write_operations(records.operations[row], slots)

    def _write_nodes(self, nodes: np.ndarray, slots: float) -> None:
        out = nodes[: len(self.data)]
        out["initial"] = self.totals.initial
        out["arrived"] = self.totals.arrived
        out["collected"] = self.totals.collected
        out["residual"] = self.data
        out["age"] = self.totals.age_area / slots
        out["age_at_end"] = slots - self.emptied / self.slot

    def _write_operations(self, out: np.void, slots: float) -> None:
        totals = self.totals
        out["age"] = fsum(totals.age_area) / len(totals.age_area) / slots
        out["late"] = fsum(self.rates * totals.late) / (fsum(self.rates) * slots)
        out["open"] = self.plan.open_share
        out["longest_gap"] = self.plan.longest_gap
        out["windows"] = totals.windows
        hours = np.diff(self.plan.month_ends, prepend=0)
        for name, area, length in zip(AGES_OF_MONTHS, totals.area_of_month, hours, strict=True):
            out[name] = area / (length * HOUR / self.slot)
        waited = totals.slots_of_uavs("slots_waiting")
        if self.mission[0].has_charging:
            out["pad_requests"] = totals.pad_requests
            out["waiting"] = waited / totals.pad_requests if totals.pad_requests else np.nan
            charged = totals.slots_of_uavs("slots_charging")
            flown = max(totals.slots, 1)
            out["queue"] = waited / flown
            out["utilisation"] = charged / (self.space.charging_pads * flown)
        if self.mission[0].has_failures:
            out["failures"] = totals.failures
            out["slots_grounded"] = totals.slots_grounded
            out["lost"] = totals.lost


class Totals:
    """What is counted in the windows of a year, and between them."""

    def __init__(self, initial: np.ndarray, uavs: int):
        """Begin to count with (K,) initial data of the nodes, for so many UAVs."""
        self.initial = initial.copy()
        self.arrived, self.collected, self.age_area, self.late = np.zeros((4, len(initial)))
        self.area_of_month = np.zeros(12)
        self.uavs = np.zeros(uavs, UAV_RECORD)
        self.windows = self.slots = self.success = self.home = 0
        self.pad_requests = self.failures = self.slots_grounded = 0
        self.lands = self.lost = 0.0

    def count_window(
        self, record: MissionRecord, mission: np.void, late: np.ndarray, month: int
    ) -> None:
        """Count a window of a month, whose nodes had (K,) ``late`` data [slots]."""
        assert record.nodes is not None
        self.windows += 1
        self.slots += int(record.slots)
        self.success += int(record.success)
        self.home += int(record.home)
        self.lands += record.collected
        self.lost += mission["lost"]
        self.pad_requests += int(mission["pad_requests"])
        self.failures += int(mission["uav_failures"])
        self.slots_grounded += int(mission["slots_grounded"])
        self.arrived += record.nodes["arrived"]
        self.collected += record.nodes["collected"]
        self.count_ages(record.nodes["age"] * record.slots, month)
        self.late += late

    def count_ages(self, areas: np.ndarray, month: int) -> None:
        """Count (K,) areas below the ages of the nodes in a month [slots^2]."""
        self.age_area += areas
        self.area_of_month[month] += fsum(areas) / len(areas)

    def slots_of_uavs(self, *names: str) -> int:
        """How many slots all UAVs together have spent with something."""
        return int(np.add.reduce([np.add.reduce(self.uavs[name]) for name in names]))

    def count_uav(self, number: int, row: np.void) -> None:
        """Count what a UAV has done in a window."""
        total = self.uavs[number]
        for name in _SUMMED:
            total[name] += row[name]
        total["end"] = row["end"]


_SUMMED = (
    *("quota", "slots_flying", "slots_charging", "slots_waiting", "collected", "reward"),
    "charged",
)


@kernel
def collect_idle_data(mission, means):
    """(K,) the data that nodes collect until the end of a year, of their means."""
    data = np.empty(len(means))
    for k in range(len(means)):
        data[k] = draw_idle_data(mission, means[k], k)
    return data


@kernel
def repair_in_gap(mission, number, gap, silent, grounded):
    """Repair what is out of order at the end of a window, before the next one begins.

    Args:
        mission: ``MISSION`` record; its pads are repaired.
        number: The number of the replication of the next window.
        gap: The slots between the windows.
        silent: (K,) whether nodes are silent.
        grounded: (I,) whether UAVs are grounded.
    """
    pad = 0
    for zone in range(mission.zones):
        for _ in range(mission.zone_pads[zone]):
            if mission.pads_out[pad] and _is_repaired(
                mission, number, gap, streams.PAD_FAILURE, pad, mission.zone_pad_repair[zone]
            ):
                mission.pads_out[pad] = 0
            pad += 1
    for k in range(len(silent)):
        silent[k] = silent[k] and not _is_repaired(
            mission, number, gap, streams.NODE_FAILURE, k, mission.node_repair
        )
    for i in range(len(grounded)):
        grounded[i] = grounded[i] and not _is_repaired(
            mission, number, gap, streams.UAV_FAILURE, i, mission.uav_repair
        )


@inlined
def _is_repaired(mission, number, gap, stream, index, probability):
    """Whether a repair ends within so many slots, of which each ends it with a probability."""
    if probability <= 0.0 or gap <= 0.0:
        return False
    stays = 0.0
    if probability < 1.0:
        stays = exp(gap * log(1.0 - probability))
    words = streams.block(mission.seed, number, stream, 1, 0, index)
    return streams.uniform(words[0]) >= stays
