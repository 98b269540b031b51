"""Tables of results that somebody has changed, in files whose names have the right checksums."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from dess.analysis.results import parquet

Forge = Callable[[pa.Table], pa.Table]


def column(name: str, change: Callable[[np.ndarray], Any]) -> Forge:
    """Changes the values of a column, and not their type."""

    def forge(table: pa.Table) -> pa.Table:
        place = table.schema.get_field_index(name)
        field = table.schema.field(place)
        values = pa.array(change(np.array(table[name].to_pylist()))).cast(field.type)
        return table.set_column(place, field, values)

    return forge


def forged(path: Path, forge: Forge) -> None:
    """Put a changed table in the place of a file."""
    table = forge(pq.ParquetFile(path).read())
    path.unlink()
    parquet.write(path.parent, path.stem.rpartition("-")[0], table)
