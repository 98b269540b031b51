"""The geofence of a plan: the grid, and the no-fly cells near the ways of its flights."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from dess.analysis.flights.route import GeoPoint, Route, SeaMap
from dess.analysis.numbers import format_count
from dess.base.libraries import needs
from dess.physics.chart import NO_FLY

Corners = list[tuple[float, float]]

MOST_CORNERS = 64  # that PX4 keeps, of all polygons together
_CLEARANCE = 20.0  # of ways from the fence where it is simplified [m]


@dataclass(frozen=True)
class Fence:
    """The geofence of a plan.

    Attributes:
        inside: The corners in which UAVs stay; none if the sea crosses the 180th meridian, where
            autopilots do not know which side of a fence is meant.
        outside: The corners of each polygon that they do not enter.
        all_corners: How many corners the no-fly cells have without being simplified.
        left_out: How far the nearest no-fly cells that the fence does not have are from all ways
            [m]; None if it has all of them.
    """

    inside: list[GeoPoint]
    outside: list[list[GeoPoint]]
    all_corners: int
    left_out: float | None = None

    @classmethod
    def around(cls, sea: SeaMap, routes: Iterable[Route]) -> "Fence":
        """The fence of the flights of a sea.

        With more corners than an autopilot keeps, each piece of no-fly cells is simplified to its
        outside, as far as no way comes near. Pieces that are still too many are left out, those
        that are furthest from all ways.

        Raises:
            MissingLibraryError: If there are too many corners, and the library that simplifies them
                is not installed.
        """
        columns, rows = sea.scenario.size
        grid: Corners = [(0, 0), (columns, 0), (columns, rows), (0, rows)]
        inside = [sea.place_at(*corner) for corner in grid]
        if inside[0].lon > inside[1].lon:
            return cls([], [], 0)
        pieces = [*outline_pieces(sea.scenario.chart.zones == NO_FLY)]
        all_corners = len(grid) + sum(map(len, pieces))
        left_out = None
        if all_corners > MOST_CORNERS:
            pieces, left_out = _simplify(pieces, sea, routes, MOST_CORNERS - len(grid))
        outside = [[sea.place_at(*corner) for corner in piece] for piece in pieces]
        return cls(inside, outside, all_corners, left_out)

    @property
    def corners(self) -> int:
        """The number of all corners."""
        return len(self.inside) + sum(map(len, self.outside))

    def make_document(self) -> dict[str, Any]:
        """The fence as the file has it."""
        polygons = [_make_polygon(corners, inclusion=False) for corners in self.outside]
        if self.inside:
            polygons.insert(0, _make_polygon(self.inside, inclusion=True))
        return {"circles": [], "polygons": polygons, "version": 2}

    def list_sentences(self) -> list[str]:
        """What the fence has and what it leaves out."""
        if not self.inside:
            return ["There is no geofence, since the sea crosses the 180th meridian."]
        count = format_count(self.corners, "corner")
        lines = [f"The geofence has {count}."]
        if self.corners < self.all_corners:
            lines = [
                f"The geofence has {count} in the place of {self.all_corners}, since autopilots "
                f"keep {MOST_CORNERS}: it is simplified to the outside of the no-fly cells."
            ]
        if self.left_out is not None:
            far = f"{self.left_out:,.0f} m and more"
            lines.append(f"It leaves out no-fly cells that are {far} from all ways.")
        return lines


def _simplify(
    pieces: list[Corners], sea: SeaMap, routes: Iterable[Route], most: int
) -> tuple[list[Corners], float | None]:
    """Polygons of so many corners that cover the pieces nearest to the ways of flights.

    Returns:
        The polygons, and the distance of the nearest piece that is left out [m], if one is.
    """
    needs("geo", f"a geofence of more than {MOST_CORNERS} corners")
    import shapely

    size = sea.scenario.cell_size
    lines = [sea.spots([point.place for point in route.points]) for route in routes]
    ways = shapely.MultiLineString([line for line in lines if len(line) > 1])
    corridor = ways.buffer(min(_CLEARANCE / size, 0.25))
    shapely.prepare(corridor)
    land = shapely.union_all([shapely.Polygon(piece) for piece in pieces])
    islands = []
    for part in shapely.get_parts(land):
        filled = shapely.Polygon(part.exterior)
        if part.interiors and filled.intersects(ways):
            within = [piece for piece in pieces if part.contains(shapely.Polygon(piece))]
            islands += [_Outline(piece, corridor) for piece in within]
        else:
            corners = [(x, y) for x, y in filled.exterior.coords][:-1]
            islands.append(_Outline(corners, corridor))
    islands.sort(key=lambda island: island.distance_to(ways))
    kept: list[_Outline] = []
    left_out = None
    for island in islands:
        if sum(len(other.least) for other in kept) + len(island.least) <= most:
            kept.append(island)
        elif left_out is None:
            left_out = island.distance_to(ways) * size
    while sum(len(island.corners) for island in kept) > most:
        min(kept, key=lambda island: island.next_area).simplify()
    return [island.corners for island in kept], left_out


class _Outline:
    """The outline of a piece, and ever simpler ones that cover it, one corner less at a time."""

    def __init__(self, corners: Corners, corridor: Any):
        """Simplify an outline as far as it does not enter a corridor."""
        import shapely

        self._polygon = shapely.Polygon(corners)
        self._steps: list[tuple[float, Corners]] = [(0.0, corners)]
        exterior = shapely.geometry.polygon.orient(self._polygon).exterior  # counterclockwise
        ring = np.array(exterior.coords)[:-1]
        while len(ring) > 3 and (step := _without_a_corner(ring, corridor)):
            area, ring = step
            self._steps.append((area, [(x, y) for x, y in ring.tolist()]))
        self._number = 0

    @property
    def corners(self) -> Corners:
        """Those of the present outline."""
        return self._steps[self._number][1]

    @property
    def least(self) -> Corners:
        """Those of the simplest outline."""
        return self._steps[-1][1]

    @property
    def next_area(self) -> float:
        """What the next simpler outline covers in addition."""
        if self._number + 1 == len(self._steps):
            return np.inf
        return self._steps[self._number + 1][0]

    def simplify(self) -> None:
        """Go on to the next simpler outline."""
        self._number += 1

    def distance_to(self, ways: Any) -> float:
        """How far the piece is from ways [cells]."""
        return float(self._polygon.distance(ways))


def _without_a_corner(ring: np.ndarray, corridor: Any) -> tuple[float, np.ndarray] | None:
    """The area that a ring gains without one of its corners, and the smallest such ring.

    A corner that points inwards is left out, or an edge between two that point outwards, where the
    edges beside it meet.

    Args:
        ring: (K, 2) corners, counterclockwise.
        corridor: What the ring may not enter.
    """
    import shapely

    before, after, beyond = (np.roll(ring, shift, axis=0) for shift in (1, -1, -2))
    inner = _cross(ring - before, after - ring) <= 0
    along = ring - before
    back = after - beyond
    turn = _cross(along, back)
    is_edge = ~inner & ~np.roll(inner, -1) & (turn > 1e-9)
    share = np.divide(_cross(after - ring, back), turn, out=np.zeros(len(ring)), where=is_edge)
    is_edge &= share > 0
    tips = np.where(is_edge[:, None], ring + share[:, None] * along, before)
    triangles = np.stack([ring, tips, after], axis=1)
    areas = np.abs(_cross(tips - ring, after - ring)) / 2
    areas[~(inner | is_edge)] = np.inf
    for number in np.argsort(areas, kind="stable"):
        if not np.isfinite(areas[number]):
            return None
        if areas[number] > 0 and corridor.intersects(shapely.Polygon(triangles[number])):
            continue
        fewer = ring.copy()
        if inner[number]:
            fewer = np.delete(ring, number, axis=0)
        else:
            fewer[number] = tips[number]
            fewer = np.delete(fewer, (number + 1) % len(ring), axis=0)
        if shapely.Polygon(fewer).is_valid:
            return float(areas[number]), fewer
    return None


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def outline_pieces(closed: np.ndarray) -> Iterator[Corners]:
    """The outlines of pieces without holes that cover cells, each clockwise as a map shows it.

    A piece has one run of cells in each of its rows, which touches that in the row above. It ends
    where runs part or meet.

    Args:
        closed: (H, W) whether a cell is covered.
    """
    growing: list[list[tuple[int, int, int]]] = []
    for row, cells in enumerate(closed):
        edges = np.flatnonzero(np.diff(cells.astype(int), prepend=0, append=0)).tolist()
        runs = [*zip(edges[::2], edges[1::2], strict=True)]
        still_growing = []
        for start, end in runs:
            above = [piece for piece in growing if piece[-1][1] < end and start < piece[-1][2]]
            piece = []
            if len(above) == 1 and _count_touching(above[0][-1], runs) == 1:
                piece = above[0]
            piece.append((row, start, end))
            still_growing.append(piece)
        yield from (_trace_outline(piece) for piece in growing if piece[-1][0] < row)
        growing = still_growing
    yield from map(_trace_outline, growing)


def _count_touching(above: tuple[int, int, int], runs: list[tuple[int, int]]) -> int:
    """How many runs of a row touch a run of the row above."""
    return sum(start < above[2] and above[1] < end for start, end in runs)


def _trace_outline(piece: list[tuple[int, int, int]]) -> Corners:
    """The corners of a piece: down its right side, and up its left one."""
    right = [(end, y) for row, _, end in piece for y in (row, row + 1)]
    left = [(start, y) for row, start, _ in piece for y in (row, row + 1)]
    corners = right + left[::-1]
    kept: Corners = []
    for before, corner, after in zip(
        [corners[-1], *corners], corners, [*corners[1:], corners[0]], strict=False
    ):
        is_straight = before[0] == corner[0] == after[0] or before[1] == corner[1] == after[1]
        if corner != before and not is_straight:
            kept.append(corner)
    return kept


def _make_polygon(corners: list[GeoPoint], *, inclusion: bool) -> dict[str, Any]:
    return {
        "inclusion": inclusion,
        "polygon": [[corner.lat, corner.lon] for corner in corners],
        "version": 1,
    }
