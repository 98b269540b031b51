"""The rows of tables that belong to given parts of a study, in the order of the parts."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
import pyarrow as pa

from analysis.results.chunks import Part
from dess import InputError


def rows_of(parts: Sequence[Part], tables: Sequence[pa.Table]) -> pd.DataFrame:
    """The rows of the missions of the parts, with the ``point`` of each.

    Args:
        parts: Parts of one team; the tables must contain all of them.
        tables: Tables with the columns ``cell`` and ``replication``.

    Raises:
        InputError: If two tables have different rows for the same mission.
    """
    rows = _wanted(parts).merge(_stacked(tables), on=["cell", "replication"], how="left")
    return rows[["point", *(name for name in tables[0].column_names if name != "cell")]]


def _wanted(parts: Sequence[Part]) -> pd.DataFrame:
    """A table with the design point, cell and replication of every mission of the parts."""
    lengths = [len(part.replications) for part in parts]
    return pd.DataFrame(
        {
            "point": np.repeat([part.cell.point for part in parts], lengths),
            "cell": np.repeat([part.cell.key for part in parts], lengths),
            "replication": np.concatenate([part.replications for part in parts]),
        }
    )


def _stacked(tables: Sequence[pa.Table]) -> pd.DataFrame:
    """The rows of all tables."""
    frame = pa.concat_tables(tables).to_pandas().astype({"cell": str})
    one = [name for name in ("cell", "replication", "uav") if name in frame]
    if frame.duplicated(one).any():  # such as after files of two folders were merged
        frame = frame.drop_duplicates()
        if frame.duplicated(one).any():
            raise InputError(
                "results: two files have different records of a mission; allowed: one of them"
            )
    return frame
