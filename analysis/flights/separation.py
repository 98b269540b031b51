"""How near UAVs come to each other, in the air and on the ground, at any time of a plan."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from dess.analysis.flights.route import Moment, SeaMap
from dess.scenario.scenario import Scenario

ROUNDING = 1e-6  # of distances [m]
_MARGIN = 0.5  # by which UAVs in flight are planned further apart [m]


class Separation(NamedTuple):
    """How far apart two UAVs have to be.

    Attributes:
        air: The least distance if one of them is in the air [m].
        ground: The least distance of the places where both stand [m].
    """

    air: float = 10.0
    ground: float = 3.0

    @property
    def spacing(self) -> float:
        """The distance of places in a zone, and of the altitudes of UAVs [m].

        Who takes off is in the air beside those who stand, so both have the larger distance. A
        metre more allows for the rounding of places, and for the margin of ``keeps_apart``.
        """
        return max(self) + 1

    def altitudes(self, scenario: Scenario) -> list[float]:
        """Those of the UAVs [m]: each flies higher than the one before it, and above who stands."""
        lowest = max(scenario.altitude, self.air)
        return [round(lowest + self.spacing * uav, 3) for uav in range(scenario.uavs)]


class Approach(NamedTuple):
    """How near two UAVs are at a time.

    Attributes:
        metres: Their distance.
        seconds: The time, from the start of the mission.
        uavs: Their numbers, from 0.
    """

    metres: float
    seconds: float
    uavs: tuple[int, int]


class Track(NamedTuple):
    """Where a UAV is over time; before and after it is where it begins and ends.

    Attributes:
        uav: The number of the UAV, from 0.
        times: (T,) [s].
        spots: (T, 2) places on the grid [cells].
        altitudes: (T,) [m].
    """

    uav: int
    times: np.ndarray
    spots: np.ndarray
    altitudes: np.ndarray

    @classmethod
    def of(cls, uav: int, moments: Sequence[Moment], sea: SeaMap) -> "Track":
        """That of moments in their order."""
        times, places, altitudes = zip(*moments, strict=True)
        return cls(uav, np.array(times), sea.spots(places), np.array(altitudes, float))

    def followed_by(self, moments: Sequence[Moment], sea: SeaMap) -> "Track":
        """The same with further moments."""
        more = Track.of(self.uav, moments, sea)
        pairs = zip(self[1:], more[1:], strict=True)
        return Track(self.uav, *(np.concatenate(pair) for pair in pairs))

    def at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N, 2) places on the grid, and (N,) altitudes, at N times."""
        x, y, altitudes = (
            np.interp(times, self.times, axis) for axis in (*self.spots.T, self.altitudes)
        )
        return np.stack([x, y], axis=1), altitudes


class Pieces(NamedTuple):
    """How near two UAVs come in each piece of time in which both move evenly.

    Attributes:
        metres: (N,) the least distance.
        seconds: (N,) when that is.
        on_ground: (N,) whether both stand on the ground all the time.
        in_air: (N,) whether neither stands on the ground all the time.
        in_zone: (N,) whether one of them is in a zone at an end of it.
    """

    metres: np.ndarray
    seconds: np.ndarray
    on_ground: np.ndarray
    in_air: np.ndarray
    in_zone: np.ndarray

    @classmethod
    def of(
        cls,
        track: Track,
        other: Track,
        sea: SeaMap,
        between: tuple[float, float] = (0.0, np.inf),
        longest: float = np.inf,
    ) -> "Pieces":
        """Those of two UAVs between two times, none longer than ``longest`` [s]."""
        start, end = between
        end = min(end, max(track.times[-1], other.times[-1], start) + 1)  # both on the ground
        knots = np.concatenate([track.times, other.times, np.arange(start, end, longest)])
        times = np.unique(np.concatenate([[start, end], knots[(knots > start) & (knots < end)]]))
        if len(times) == 1:
            times = np.repeat(times, 2)
        spots, altitudes = track.at(times)
        other_spots, other_altitudes = other.at(times)
        flat = sea.metres_between(spots, other_spots)
        away = np.column_stack([flat, other_altitudes - altitudes])
        step = np.diff(away, axis=0)
        length = (step * step).sum(axis=1)
        towards = -(away[:-1] * step).sum(axis=1)
        share = np.divide(towards, length, out=np.zeros_like(length), where=length > 0)
        share = np.clip(share, 0, 1)
        stands = _in_pieces(altitudes == 0)
        other_stands = _in_pieces(other_altitudes == 0)
        in_zone = sea.in_zones(spots) | sea.in_zones(other_spots)
        return cls(
            np.linalg.norm(away[:-1] + share[:, None] * step, axis=1),
            times[:-1] + share * np.diff(times),
            stands & other_stands,
            ~stands & ~other_stands,
            in_zone[:-1] | in_zone[1:],
        )


def _in_pieces(at_times: np.ndarray) -> np.ndarray:
    """(N - 1,) what holds at both ends of a piece."""
    return at_times[:-1] & at_times[1:]


def keeps_apart(
    track: Track,
    others: Iterable[Track],
    separation: Separation,
    sea: SeaMap,
    between: tuple[float, float],
) -> bool:
    """Whether a UAV keeps the distances to others between two times [s]."""
    for other in others:
        pieces = Pieces.of(track, other, sea, between)
        least = np.where(pieces.on_ground, separation.ground, separation.air)
        if (pieces.metres < least + _MARGIN * pieces.in_air - ROUNDING).any():
            return False
    return True


def closest_approach(
    tracks: Sequence[Track], sea: SeaMap, *, ground: bool = False, outside_zones: bool = False
) -> Approach | None:
    """When two UAVs are nearest to each other; None if there is no such time.

    Args:
        tracks: Those of all UAVs, over the whole mission.
        sea: Where they are.
        ground: Whether the time counts in which both stand on the ground, or else the other one.
        outside_zones: Whether only the time counts in which both are outside of all zones.
    """
    nearest: Approach | None = None
    longest = np.inf
    if outside_zones and sea.scenario.units:  # fine enough to say what lies in a zone
        longest = sea.scenario.units.slot / 4
    for number, track in enumerate(tracks):
        for other in tracks[number + 1 :]:
            pieces = Pieces.of(track, other, sea, longest=longest)
            counts = pieces.on_ground == ground
            if outside_zones:
                counts &= ~pieces.in_zone
            if not counts.any():
                continue
            best = int(np.where(counts, pieces.metres, np.inf).argmin())
            metres = float(pieces.metres[best])
            if nearest is None or metres < nearest.metres:
                nearest = Approach(metres, float(pieces.seconds[best]), (track.uav, other.uav))
    return nearest
