"""The hours of a series in which UAVs may fly, what a slot takes in each, and the calendar years.

    hours = hours_of(space)             # of a scenario with ``[weather]``
    years(hours)[0]                     # the first whole calendar year, in local time

An hour is open if UAVs operate in it, if its weather is known and within the limits, and if UAVs
can fly all moves in its wind.
"""

import math
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from dess.base.elementary import cos, exp_of_each, log10, sin
from dess.base.errors import InputError, listed
from dess.base.files.reading import version_of
from dess.physics.energy import ACTIONS, MOST_COST, PERCENT, SPEEDS
from dess.scenario.fields import Fields
from dess.scenario.projection import Projection
from dess.scenario.quantities import measured
from dess.scenario.rotary_wing import RotaryWing, airspeeds_of
from dess.scenario.weather import ALWAYS, DAYLIGHT, Weather
from dess.scenario.weather.formats import known_name
from dess.scenario.weather.series import HOUR, Series
from dess.scenario.weather.sun import is_light

DAY = 24 * HOUR
SHEAR = 0.11  # the exponent of the wind's growth with height, over open water
_LN10 = 2.302585092994046
_WINDS = ("wind", "gust")  # columns whose limits do not count in still air
_ROUNDING = 1e-9  # what rounding may add to the square of an airspeed, as a share


class HourState(IntEnum):
    """Why an hour is closed; ``LIMIT + i`` is limit i of the section, the first that it breaks."""

    OPEN = 0
    NIGHT = 1  # it is no operating hour
    MISSING = 2
    WIND = 3  # a move needs more than the largest airspeed
    LIMIT = 4


class Year(NamedTuple):
    """A whole calendar year of a series, in local time.

    Attributes:
        year: The year.
        first: Its first hour, as an index of ``Hours``.
        hours: The number of its hours.
    """

    year: int
    first: int
    hours: int


@dataclass(frozen=True, eq=False)
class Hours:
    """The hours of a series, N of them; those before and after it that years need are missing.

    Attributes:
        first: The first hour [UTC], as ``datetime64[h]``.
        state: (N,) int8 why an hour is closed (``HourState``); of several reasons the one that is
            first there.
        costs: (N, SPEEDS, 5) int16 what a slot of the moves north, east, south and west and of
            hovering takes of the battery [% / 1000], by the slots that a UAV takes for a cell; 0
            in closed hours and for more slots than those of the slowest type.
        limits: The columns that have limits, in the order of their states.
        offset: Local time less UTC [h].
        series: The series; ``wind`` is that at the height of the anemometer.
    """

    first: np.datetime64
    state: np.ndarray
    costs: np.ndarray
    limits: tuple[str, ...]
    offset: int
    series: Series

    @property
    def names(self) -> dict[int, str]:
        """What closes an hour in a word, by its state, such as limits.waves for a limit."""
        of_limits = {HourState.LIMIT + n: f"limits.{name}" for n, name in enumerate(self.limits)}
        states = (HourState.NIGHT, HourState.MISSING, HourState.WIND)
        return {int(state): state.name.lower() for state in states} | of_limits


class _Flight(NamedTuple):
    """What of a scenario tells which hours are open, and what a slot takes in them."""

    weather: Weather
    place: tuple[float, float] | None
    wing: RotaryWing
    cruise: float
    max_speed: float
    altitude: float
    of_cruising: float
    slots_per_cell: tuple[int, ...]


def hours_of(space: Fields) -> Hours:
    """The hours of the weather of a scenario; they are kept until its file changes.

    Args:
        space: A scenario with a data sheet and ``[weather]``.

    Raises:
        InputError: If the file cannot be read, is another one than the scenario's, has no column of
            a limit, or winds in which a slot takes too much.
    """
    sheet = space.data_sheet
    flight = _Flight(
        space.weather,
        place_of(space),
        sheet.wing,
        sheet.number("cruise"),
        sheet.number("max_speed"),
        sheet.number("altitude"),
        float(PERCENT * sheet.slot_of_cruising),
        tuple(sorted({kind.slots_per_cell for kind in space.fleet} or {1})),
    )
    return _hours_of(flight, version_of(space.weather.path))


def years(hours: Hours) -> list[Year]:
    """The calendar years, in local time, that the series covers but for a day at its edges."""
    begin = hours.series.first
    end = begin + len(hours.series.wind) * HOUR
    return [
        Year(year, _count(first - hours.first), _count(after - first))
        for year, first, after in _whole_years(begin, end, hours.offset)
    ]


def place_of(space: Fields) -> tuple[float, float] | None:
    """Latitude and longitude by which the sun stands [degrees]; None for a sea without degrees."""
    if space.centre is None:
        return None
    x, y, width, height = space.zone
    projection = Projection(space.centre, space.size, space.cell_size)
    [(lon, lat)] = projection.degrees(np.array([[x + width / 2, y + height / 2]]))
    if space.weather.longitude is not None:
        lon = space.weather.longitude
    return float(lat), float(lon)


def offset_of(longitude: float) -> int:
    """Local time less UTC [h]: the solar time of a longitude [degrees], in whole hours."""
    return math.floor(longitude / 15 + 0.5)


def wind_factor(altitude: float, height: float) -> float:
    """The wind at an altitude as a multiple of that at a height, both [m] above open water."""
    return float(exp_of_each(SHEAR * _LN10 * log10(altitude / height)))


@lru_cache(maxsize=4)
def _hours_of(flight: _Flight, version: tuple[int, int]) -> Hours:
    weather = flight.weather
    series = weather.series()
    longitude = weather.longitude
    if longitude is None and flight.place:
        longitude = flight.place[1]
    offset = offset_of(longitude or 0.0)
    state = np.zeros(len(series.wind), np.int8)
    is_missing = np.isnan(series.wind) | np.isnan(series.origin)
    for number, limit in reversed([*enumerate(weather.bounds())]):
        values = series.column(limit.column)
        if values is None:
            problem = f"has no {limit.column}, of the limits"
            raise InputError(weather.path, problem, listed(series.columns))
        if weather.calm and known_name(limit.column) in _WINDS:
            continue
        beyond = values < limit.value if limit.is_least else values > limit.value
        state[beyond] = HourState.LIMIT + number
        is_missing |= np.isnan(values)
    wind = np.where(is_missing | weather.calm, 0.0, series.wind)
    wind = wind * wind_factor(flight.altitude, _height_of(weather))
    state[~_can_fly(flight, wind, series.origin)] = HourState.WIND
    state[is_missing] = HourState.MISSING
    state[~_is_operating(flight, series, offset)] = HourState.NIGHT
    is_open = state == HourState.OPEN
    costs = np.zeros((len(state), SPEEDS, ACTIONS), np.int16)
    costs[is_open] = _costs_of(flight, wind[is_open], series.origin[is_open])
    first, state, costs = _with_edges(series, offset, state, costs)
    for shared in (state, costs):
        shared.flags.writeable = False
    return Hours(first, state, costs, tuple(weather.limits), offset, series)


def _height_of(weather: Weather) -> float:
    return measured(weather.height, "m")[0]


def _can_fly(flight: _Flight, wind: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """(N,) whether the fastest UAVs can fly all moves: w^2 + v^2 + 2 v w k <= A^2.

    k is the larger of sine and cosine of the wind's direction. Slower ones then can as well.
    """
    speed = flight.cruise / min(flight.slots_per_cell)
    angle = np.radians(origin)
    along = np.maximum(np.abs(sin(angle)), np.abs(cos(angle)))
    square = wind * wind + speed * speed + 2 * wind * speed * along
    return np.asarray(square <= flight.max_speed * flight.max_speed * (1 + _ROUNDING))


def _costs_of(flight: _Flight, wind: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """(N, SPEEDS, 5) what slots take [% / 1000] in N winds, as ``DataSheet.costs`` has it."""
    costs = np.zeros((len(wind), SPEEDS, ACTIONS), np.int16)
    for slots in range(1, max(flight.slots_per_cell) + 1):
        speed = flight.cruise / slots
        shares = flight.wing.power(airspeeds_of(speed, wind, origin)) / flight.wing.power(speed)
        of_slots = np.maximum(np.ceil(flight.of_cruising * shares - 1e-6), 1)
        if slots in flight.slots_per_cell and len(wind) and of_slots.max() > MOST_COST:
            problem = f"an open hour takes {of_slots.max() / PERCENT:.1f} % a slot"
            raise InputError("data_sheet.max_speed", problem, f"{MOST_COST // PERCENT} % at most")
        costs[:, slots - 1] = np.minimum(of_slots, np.iinfo(np.int16).max)
    return costs


def _is_operating(flight: _Flight, series: Series, offset: int) -> np.ndarray:
    """(N,) whether UAVs operate in an hour, by its middle."""
    weather = flight.weather
    if weather.operating == ALWAYS:
        return np.ones(len(series.wind), np.bool_)
    if weather.operating == DAYLIGHT:
        assert flight.place, "the consistency of a scenario sees to it"
        return _light_hours(series.first, len(series.wind), *flight.place)
    begin, until = weather.clock()
    of_day = (series.hours.astype(np.int64) + offset) % 24 * 60 + 30
    if begin < until:
        return np.asarray((of_day >= begin) & (of_day < until))
    return np.asarray((of_day >= begin) | (of_day < until))


@lru_cache(maxsize=4)
def _light_hours(first: np.datetime64, count: int, lat: float, lon: float) -> np.ndarray:
    """(N,) whether the middle of an hour is light."""
    middles = first.astype("datetime64[m]") + 60 * np.arange(count) + 30
    return is_light(middles, lat, lon)


def _with_edges(
    series: Series, offset: int, state: np.ndarray, costs: np.ndarray
) -> tuple[np.datetime64, np.ndarray, np.ndarray]:
    """The first hour, states and costs, with the hours that the first and the last year lack."""
    begin, end = series.first, series.first + len(state) * HOUR
    whole = _whole_years(begin, end, offset)
    if not whole:
        return begin, state, costs
    before = max(_count(begin - whole[0][1]), 0)
    after = max(_count(whole[-1][2] - end), 0)
    state = np.pad(state, (before, after), constant_values=HourState.MISSING)
    return begin - before * HOUR, state, np.pad(costs, ((before, after), (0, 0), (0, 0)))


def _whole_years(
    begin: np.datetime64, end: np.datetime64, offset: int
) -> list[tuple[int, Any, Any]]:
    """The years that are whole, each with its first hour and that after it [UTC]."""
    local = (begin + offset * HOUR, end + offset * HOUR)
    first, last = (int(time.astype("datetime64[Y]").astype(np.int64)) + 1970 for time in local)
    whole = []
    for year in range(first, last + 2):
        starts = [
            np.datetime64(f"{number:04}-01-01T00", "h") - offset * HOUR
            for number in (year, year + 1)
        ]
        if begin - starts[0] <= DAY and starts[1] - end <= DAY:
            whole.append((year, starts[0], starts[1]))
    return whole


def _count(span: np.timedelta64) -> int:
    """The hours in a span of time."""
    return int(span / HOUR)
