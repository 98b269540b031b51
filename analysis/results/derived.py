"""What answers and pages have computed from the missions of a results folder, kept in it.

    derived = store.derived
    if not derived.has("times"):
        derived.keep("times", times)
    derived.load("times", Times, "what is made by: dess report")

Documents and event logs of missions that were simulated again lie in ``derived/``. The records of
a study do not depend on them, nor does anything that checks or publishes its results: what is
deleted here is computed again. The name of a document has the key of the study, as other missions
lead to another one; the name of a log has the key of its cell.
"""

from pathlib import Path
from typing import TypeVar

import pandas as pd
import pyarrow as pa

from dess.analysis.results import parquet
from dess.analysis.results.chunks import DERIVED, check_places, log_name
from dess.analysis.results.manifest import Cell
from dess.base.files.documents import Document
from dess.base.files.reading import paths_in
from dess.base.files.writing import write_file

_Kind = TypeVar("_Kind", bound=Document)


class Derived:
    """What is kept in a results folder beside the records of its study.

    Attributes:
        results: The results folder.
        key: The key of its study.
    """

    def __init__(self, results: Path, key: str):
        self.results = results
        self.key = key

    @property
    def _folder(self) -> Path:
        return self.results / DERIVED

    def _path_of(self, name: str) -> Path:
        return self._folder / f"{name}-{self.key}.json"

    def has(self, name: str) -> bool:
        """Whether there is a document of this name."""
        return self._path_of(name).exists()

    def load(self, name: str, kind: type[_Kind], allowed: str) -> _Kind:
        """Read a document.

        Args:
            name: Its name.
            kind: Its class.
            allowed: What messages say is allowed.

        Raises:
            InputError: If there is none, or it is damaged.
        """
        return kind.load(self._path_of(name), allowed)

    def keep(self, name: str, document: Document) -> None:
        """Write a document.

        Raises:
            InputError: If it cannot be written.
        """
        check_places(self.results)
        write_file(self._path_of(name), document.model_dump_json(indent=1) + "\n")

    def load_log(self, cell: Cell, replication: int) -> pd.DataFrame | None:
        """The event log of a replication of a cell; None if there is none that is undamaged."""
        files = paths_in(self._folder, f"{log_name(cell, replication)}-*.parquet")
        tables = (parquet.read(path) for path in files)
        return next((table.to_pandas() for table in tables if table is not None), None)

    def keep_log(self, cell: Cell, replication: int, events: pd.DataFrame) -> None:
        """Write the event log of a replication of a cell.

        Raises:
            InputError: If it cannot be written.
        """
        check_places(self.results)
        # Arrow would read the nan of a pandas column as a missing value.
        columns = {name: events[name].to_numpy() for name in events}
        table = pa.table(columns, schema=parquet.EVENTS)
        parquet.write(self._folder, log_name(cell, replication), table)
