"""Ranges of replications: which of them cells have, and which they lack."""

from collections import defaultdict
from collections.abc import Iterable

from dess.analysis.results.manifest import CellPart

Present = defaultdict[str, list[range]]  # replications by the key of their cell


def gaps_between(wanted: range, present: list[range]) -> list[range]:
    """The parts of a range that are in none of the present ranges."""
    missing = []
    begin = wanted.start
    for part in sorted(present, key=lambda r: r.start):
        if part.start > begin:
            missing.append(range(begin, min(part.start, wanted.stop)))
        begin = max(begin, part.stop)
        if begin >= wanted.stop:
            break
    return [gap for gap in [*missing, range(begin, wanted.stop)] if len(gap)]


def absent_parts(parts: Iterable[CellPart], present: Present) -> list[CellPart]:
    """What of some parts is not present."""
    return [
        CellPart(p.cell, gap)
        for p in parts
        for gap in gaps_between(p.replications, present[p.cell.key])
    ]


def joined_ranges(parts: Iterable[CellPart]) -> Present:
    """The replications of each cell, by its key, in as few ranges as there are between gaps."""
    joined: Present = defaultdict(list)
    for part in sorted(parts, key=lambda part: part.replications.start):
        ranges = joined[part.cell.key]
        if ranges and part.replications.start <= ranges[-1].stop:
            ranges[-1] = range(ranges[-1].start, max(ranges[-1].stop, part.replications.stop))
        else:
            ranges.append(part.replications)
    return joined
