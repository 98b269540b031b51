"""The places of a zone: one for each pad, and one for each UAV to stand on.

Where there is a pad for each UAV, each stands on its own.
"""

from typing import NamedTuple

import numpy as np

from dess.analysis.flights.route import GeoPoint, SeaMap
from dess.analysis.numbers import format_count
from dess.base.errors import InputError
from dess.scenario.projection import EARTH_RADIUS


class ZonePlaces(NamedTuple):
    """The places of a zone.

    Attributes:
        pads: Where UAVs are charged.
        standing: Where each UAV of the fleet stands while it is not charged.
    """

    pads: tuple[GeoPoint, ...]
    standing: tuple[GeoPoint, ...]

    @classmethod
    def lay_out(cls, sea: SeaMap, zone: int, spacing: float) -> "ZonePlaces":
        """Lay places out in squares about the place of a zone, within its cells.

        The pads come first, nearest to the middle.

        Args:
            sea: Where the zone is.
            zone: Its number, from 0.
            spacing: The distance of neighbours [m].

        Raises:
            InputError: If they do not fit into the zone.
        """
        scenario = sea.scenario
        pads = scenario.zone_pads[zone]
        count = pads
        if pads < scenario.uavs:
            count += scenario.uavs
        places = _lay_squares(sea, zone, spacing, count)
        if len(places) < count:
            *_, width, height = scenario.rectangles[zone]
            size = scenario.cell_size
            problem = (
                f"zone {zone + 1} of {width * size:.0f} x {height * size:.0f} m has no room for "
                f"{format_count(count, 'place')}, {spacing:g} m from each other"
            )
            raise InputError("--plan", problem, "a larger zone, or smaller distances")
        standing = places[pads:] or places[: scenario.uavs]
        return cls(tuple(places[:pads]), tuple(standing))

    def name_of(self, place: GeoPoint) -> str:
        """What a place is called: pads by their numbers, other places by their UAVs', from 1."""
        if place in self.pads:
            return f"pad {self.pads.index(place) + 1}"
        return f"place {self.standing.index(place) + 1}"


def _lay_squares(sea: SeaMap, zone: int, spacing: float, count: int) -> list[GeoPoint]:
    """Up to so many places in squares, the nearest to the zone's place first."""
    x, y, width, height = sea.scenario.rectangles[zone]
    [middle] = sea.spots([sea.place_of_zone(zone)])
    [(lon, lat)] = sea.projection.degrees(middle[None])
    # As far as any corner of the zone, but no further than what the places need.
    reach = int(min(max(width, height) * sea.scenario.cell_size / spacing + 1, 2 * count))
    columns, rows = np.meshgrid(np.arange(-reach, reach + 1), np.arange(-reach, reach + 1))
    steps = np.stack([columns.ravel(), rows.ravel()], axis=1)
    steps = steps[np.lexsort((steps[:, 0], steps[:, 1], (steps * steps).sum(axis=1)))]
    degree = np.degrees(spacing / EARTH_RADIUS)
    degrees = np.array([lon, lat]) + steps * degree / [np.cos(np.radians(lat)), 1]
    spots = sea.projection.cells(degrees.copy())
    is_inside = ((spots >= [x, y]) & (spots <= [x + width, y + height])).all(axis=1)
    is_inside |= (steps == 0).all(axis=1)
    return [GeoPoint.of(*degree) for degree in degrees[is_inside][:count].tolist()]
