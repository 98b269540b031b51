"""Years at sea, many together: each place of a batch flies the windows of a year one by one.

    years = Years(campaigns, world)
    years.run(team, records, rows)      # row rows[b] is the year of campaigns[b]

A window is a mission of its own weather, so each place has its own table of ways. When a window
ends, the next one of the same year takes its place (``dess.model.campaign``). Fleets and years that
share a sea are advanced in lockstep, as the missions of ``simulate_batch`` are.
"""

from collections.abc import Callable, Sequence
from threading import Event
from typing import Any, NamedTuple

import numpy as np

from dess.base.errors import InputError, shown
from dess.base.kernels import kernel
from dess.model import rules
from dess.model.campaign import MOST_HOURS, Campaign, check_years, years_of
from dess.model.channel import World, empty_scratch, world_of
from dess.model.record import Records, empty_records, write_records
from dess.model.state import Starts, starts_of, state_of
from dess.model.view import decide, flight_of
from dess.model.ways import MOST_ENTRIES, WaysOfPlaces
from dess.physics.chart import Chart
from dess.physics.fleet import slowest
from dess.physics.landing import is_over
from dess.scenario.scenario import ScenarioSpace
from dess.scenario.weather.hours import hours_of


def most_places(spaces: Sequence[ScenarioSpace], chart: Chart) -> int:
    """How many places have room in memory for their tables of ways."""
    speeds = max(slowest(space.fleet) for space in spaces)
    return max(MOST_ENTRIES // (len(chart.parking) * speeds * chart.zones.size), 1)


class WindowStart(NamedTuple):
    """A window of a year, as a mission that can be simulated by itself.

    Attributes:
        scenario: Its scenario, without weather.
        starts: What it starts from: one row.
        replication: The number of its replication.
    """

    scenario: ScenarioSpace
    starts: Starts
    replication: int


def start_of_window(
    space: ScenarioSpace, team: Sequence[Any], seed: int, window: str
) -> WindowStart:
    """What a window of the weather of a scenario starts from, in the year of a study.

    Its year is simulated up to there, since it begins with what the windows before have left.

    Args:
        space: The scenario, with weather.
        team: The policies.
        seed: Seed of the study.
        window: The hour in which it begins [UTC], such as ``2013-02-09T14``.

    Raises:
        InputError: If no window begins then, or no UAV is there; if there is no weather.
    """
    if not space.weather.is_on:
        raise InputError("window", "is of a year with weather", "a scenario with weather")
    check_years([space], np.zeros(0, np.int64))
    begin = _hour_of(window)
    hour = int((begin - hours_of(space).first).astype(np.int64))
    order = years_of(space, seed)
    replications = [r for r, y in enumerate(order) if y.first <= hour < y.first + y.hours]
    if not replications:
        problem = f"{window} is in no whole year of the weather"
        raise InputError("window", problem, "an hour of one")
    (replication,) = replications
    year = order[replication]
    campaign = Campaign(space, seed, replication)
    firsts = [window.first for window in campaign.plan.windows]
    if hour - year.first not in firsts:
        near = sorted(firsts, key=lambda first: abs(first - (hour - year.first)))[:3]
        begins = [str(begin + first + year.first - hour) for first in near]
        raise InputError("window", f"none begins at {window}", f"such as {', '.join(begins)}")
    years = Years([campaign], world_of(space))
    number = years.run_to(team, firsts.index(hour - year.first))
    if number < 0:
        raise InputError("window", f"no UAV is there at {window}", "a window with a UAV")
    return WindowStart(campaign.scenario_of_window(), years.starts, number)


def _hour_of(text: str) -> np.datetime64:
    """The hour that a text names [UTC]."""
    try:
        return np.datetime64(text.removesuffix("Z"), "h")
    except ValueError:
        raise InputError("window", f"{shown(text)} is no time", "such as 2013-02-09T14") from None


class Years:
    """Years of fleets that share a sea, each at a place of a batch."""

    def __init__(self, campaigns: Sequence[Campaign], world: World):
        """Prepare a place for each campaign; none of them has begun."""
        spaces = [campaign.space for campaign in campaigns]
        self.campaigns = campaigns
        self.world = world
        self.state = state_of(spaces, len(spaces))
        self.starts = starts_of(spaces)
        uavs = self.state.uavs.shape[1]
        nodes = len(world.nodes)
        self.scratch = empty_scratch(uavs, nodes)
        speeds = max(slowest(space.fleet) for space in spaces)
        self.ways = WaysOfPlaces(len(spaces), speeds, world.chart)
        self.window = empty_records(1, uavs, True, nodes)
        self.has_window = np.zeros(len(spaces), np.bool_)

    def run(
        self,
        team: Sequence[Any],
        records: Records,
        rows: Sequence[int],
        progress: Callable[[int], object] | None = None,
        stopped: Event | None = None,
    ) -> None:
        """Simulate all years.

        Args:
            team: The policies of the fleets.
            records: Where the records are written.
            rows: The row of each place in them.
            progress: Called with 1 when a year has ended.
            stopped: When it is set, no further slot begins.
        """
        for b in range(len(self.campaigns)):
            self._begin_window(b)
        self._fly(team, progress, stopped)
        for campaign, row in zip(self.campaigns, rows, strict=True):
            campaign.end_year(records, row)

    def run_to(self, team: Sequence[Any], window: int) -> int:
        """Simulate the only year up to the start of one of its windows, by its number in the plan.

        Returns:
            The number of its replication, or -1 if no UAV is there to fly it.
        """
        (campaign,) = self.campaigns
        self._begin_window(0)
        self._fly(team, until=window)
        number = MOST_HOURS * campaign.replication + campaign.plan.windows[window].first
        return number if campaign.next == window and self.has_window[0] else -1

    def _fly(
        self,
        team: Sequence[Any],
        progress: Callable[[int], object] | None = None,
        stopped: Event | None = None,
        until: int | None = None,
    ) -> None:
        """Advance all years until they end, or until one begins a window of this number."""
        shown = self.world.shown()
        while self.has_window.any() and not (stopped and stopped.is_set()):
            if until is not None and self.campaigns[0].next >= until:
                return
            for b in self._advance(team, shown):
                self._end_window(b)
                self._begin_window(b)
                if progress and not self.has_window[b]:
                    progress(1)

    def _advance(self, team: Sequence[Any], shown: World) -> Sequence[int] | np.ndarray:
        """Advance every place by a slot, or a single one to the end of its window.

        The latter is faster, where the team can fly a mission in compiled code.

        Returns:
            The places whose windows have ended.
        """
        if fly := flight_of(team):
            b = int(np.argmax(self.has_window))
            fly(team, self.state, b, self.world, self.scratch, self.ways.reach)
            return [b]
        decide(team, self.state, shown, self.ways)  # type: ignore[arg-type]
        return _advance(self.has_window, self.state, self.world, self.scratch)

    def _begin_window(self, b: int) -> None:
        """Launch the next window of a place, if its year has one."""
        number = self.campaigns[b].begin_window(self.starts, b)
        self.has_window[b] = number >= 0
        if number < 0:
            self.state.missions["active"][b] = 0
            return
        self.ways.fill(b, self.starts.constants[b : b + 1])
        _launch(self.state, b, self.starts, number)

    def _end_window(self, b: int) -> None:
        write_records(np.array([b]), self.state, self.ways.home, self.window)
        self.campaigns[b].end_window(self.window.mission(0), self.state, b)


@kernel
def _launch(state, b, starts, number):
    rules.launch(state, b, starts, b, number)


@kernel
def _advance(has_window, state, world, scratch):
    """Advance every mission by one slot; return the places whose windows have ended."""
    ended = np.empty(len(has_window), np.int64)
    count = 0
    for b in range(len(has_window)):
        if has_window[b]:
            rules.run_slot(state, b, world, scratch)
            if is_over(state.missions[b]):
                ended[count] = b
                count += 1
    return ended[:count]
