"""Readers of files of users, by the ending of a file.

    read_places(Path("buoys.csv"))       # the places of a file, degrees or cells

Other packages may add readers (``GROUP``).
"""

from collections.abc import Callable, Iterable
from importlib.metadata import entry_points
from pathlib import Path
from typing import TypeVar

from dess.base.errors import InputError
from dess.scenario.places import Places
from dess.scenario.readers.geojson import read_geojson
from dess.scenario.readers.plan import read_plan
from dess.scenario.readers.table import read_table

# Readers of other packages: entry points whose names are file endings, as ".kml", and whose values
# are functions of a path that return ``Places``; for weather, times and columns
# (``dess.scenario.weather.formats``).
GROUP = "dess.readers"
READERS = {".csv": read_table, ".tsv": read_table, ".geojson": read_geojson, ".json": read_geojson}
READERS[".plan"] = read_plan

Read = TypeVar("Read")


def read_places(path: Path, others: Iterable[str] = ()) -> Places:
    """The places in a file, by its ending; other packages may read further ones (``GROUP``).

    Args:
        path: The file.
        others: Endings that are read elsewhere, for the message.

    Raises:
        InputError: If no reader knows the ending, or the file cannot be read.
    """
    ending = path.suffix.lower()
    if ending in READERS:
        return READERS[ending](path)
    return read_by_others(path, Places, [*others, *READERS])


def read_by_others(path: Path, kind: Callable[..., Read], others: Iterable[str]) -> Read:
    """What the reader of another package reads in a file (``GROUP``).

    Args:
        path: The file.
        kind: What is made of the items that it returns.
        others: Endings that are read here, for the message.

    Raises:
        InputError: If no reader knows the ending, or the file cannot be read.
    """
    added = {point.name: point for point in entry_points(group=GROUP)}
    point = added.get(path.suffix.lower())
    if point is None:
        raise InputError(path, "has no known file ending", ", ".join([*others, *added]))
    try:
        return kind(*point.load()(path))
    except InputError:
        raise
    except Exception as error:  # code of others may raise anything; name it
        problem = f"cannot be read by {point.value}: {type(error).__name__}: {error}"
        raise InputError(path, problem, f"a {point.name} file") from error
