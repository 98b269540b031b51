"""Joining the shards of a study."""

from collections.abc import Sequence
from pathlib import Path

from dess import InputError
from dess.analysis import numbers
from dess.analysis.results import shards
from dess.analysis.results.chunks import MANIFEST
from dess.analysis.results.manifest import CellPart, Manifest
from dess.analysis.results.store import Store
from dess.analysis.results.tables import Results, results_of

_SHOWN = 5  # shards and design points that a message names


def merge_shards(folders: Sequence[Path], out: Path | None = None) -> Results:
    """Join the shards of a study, and check that nothing is missing.

    The folder then has the same bytes as one in which the study was run at once.

    Args:
        folders: The results folders of the shards: one that they share, or several.
        out: The results folder in which they are joined; by default the first of ``folders``.

    Raises:
        InputError: If a folder holds another study, or a shard is missing or incomplete. What is
            there is kept, and the next call goes on with it.
    """
    first, *others = [Manifest.read(folder / MANIFEST) for folder in folders]
    for folder, other in zip(folders[1:], others, strict=True):
        if (other.key, other.study, other.code) != (first.key, first.study, first.code):
            allowed = "shards of one study, run with the same options and code"
            raise InputError(folder, f"holds another study than {folders[0]}", allowed)
    if first.study.rule and not first.complete:
        problem = "a rule decides how many missions there are, so it has no shards"
        raise InputError(folders[0], problem, "run the study again to complete it")
    if out:  # into which nothing is written if a shard is missing
        _check_complete([*map(Store.read, folders), *([Store.read(out)] if _is_store(out) else [])])
    with Store.open(first, out or folders[0]) as store:
        for folder in folders:
            if folder.resolve() != store.folder.resolve():
                store.copy_files(Store.read(folder))
                for shard in shards.shards_in(folder):
                    is_complete = shard.is_complete(folder)
                    shard.mark(store.folder, is_complete or shard.is_complete(store.folder))
        _check_complete([store])
        manifest = store.manifest
        store.finish(manifest.missions, manifest.selected)
        return results_of(store)


def _is_store(folder: Path) -> bool:
    return (folder / MANIFEST).exists()


def _check_complete(stores: Sequence[Store]) -> None:
    """Name the shards that some results folders lack together, with their missions.

    Raises:
        InputError: If there are any.
    """
    manifest = stores[0].manifest
    teams = range(len(manifest.policies))
    logged = [manifest.study.logged] * len(manifest.points)
    needs = {
        "mission": ("missions", [manifest.parts_of_team(team) for team in teams]),
        "event log": ("events", [manifest.parts_of_team(team, logged) for team in teams]),
        "bound": ("bounds", [manifest.parts_with_bounds()]),
    }
    gaps = {
        what: _missing(stores, kind, [part for of_team in parts for part in of_team])
        for what, (kind, parts) in needs.items()
    }
    if not any(gaps.values()):
        return
    counts = [
        numbers.format_count(sum(map(len, parts)), what) for what, parts in gaps.items() if parts
    ]
    points = sorted({part.cell.point for parts in gaps.values() for part in parts})
    places = f"{numbers.inflect('design point', len(points))} {_first_of(points)}"
    problem = f"{numbers.join_words(counts)} missing at {places}"
    again = "run the study again"
    if lost := shards.lost_shards([store.folder for store in stores]):
        named = f"{numbers.inflect('shard', len(lost))} {_first_of(lost)}"
        problem = f"{named} missing or incomplete: {problem}"
        again += f" with --shard {lost[0]}"
    raise InputError(stores[0].folder, problem, again)


def _missing(stores: Sequence[Store], kind: str, parts: Sequence[CellPart]) -> list[CellPart]:
    """What of some parts no folder has."""
    missing = [*parts]
    for store in stores:
        missing = store.contents.missing(kind, missing)
    return missing


def _first_of(things: Sequence[object]) -> str:
    """The first of some things, and how many more there are."""
    words = [*map(str, things[:_SHOWN])]
    if len(things) > _SHOWN:
        words.append(f"{len(things) - _SHOWN:,} more")
    return numbers.join_words(words)
