"""The rows of missions: found in the tables of several files, and put into those of others."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import pandas as pd
import pyarrow as pa

from dess import InputError
from dess.analysis.metrics import LEAST, NODE_AGES, NODE_RATIOS, OLDEST
from dess.analysis.results import chunks, parquet
from dess.analysis.results.manifest import CellPart
from dess.analysis.stats.worst_node import worst_node


def rows_of(parts: Sequence[CellPart], stacked: pd.DataFrame) -> pd.DataFrame:
    """The rows of the missions of the parts, with the ``point`` and ``cell`` of each.

    Args:
        parts: The parts.
        stacked: The rows of these missions, and of others, as ``stack_tables`` returns them.
    """
    rows = _keys_of(parts).merge(stacked, on=["cell", "replication"], how="left")
    return rows[["point", *stacked]]


def _keys_of(parts: Sequence[CellPart]) -> pd.DataFrame:
    """The ``point``, ``cell`` and ``replication`` of every mission of the parts."""
    lengths = [len(part.replications) for part in parts]
    return pd.DataFrame(
        {
            "point": np.repeat([part.cell.point for part in parts], lengths),
            "cell": np.repeat([part.cell.key for part in parts], lengths),
            "replication": np.concatenate([part.replications for part in parts]),
        }
    )


def stack_tables(tables: Sequence[pa.Table]) -> pd.DataFrame:
    """The rows of all tables; nan in columns that only others of them have.

    Args:
        tables: Tables with the columns ``cell`` and ``replication``.

    Raises:
        InputError: If two tables have different rows for the same mission.
    """
    frame = pa.concat_tables(tables, promote_options="default").to_pandas().astype({"cell": str})
    key = [name for name in ("cell", "replication", "uav") if name in frame]
    if frame.duplicated(key).any():  # such as after files of two folders were merged
        hashable = frame.map(lambda v: v.tobytes() if isinstance(v, np.ndarray) else v)
        frame = frame[~hashable.duplicated()]
        if frame.duplicated(key).any():
            raise InputError(
                "results", "two files have different records of a mission", "one of them"
            )
    return frame


def tables_of(
    of_files: Sequence[chunks.Chunk], frames: Iterable[pd.DataFrame]
) -> Iterator[list[pa.Table]]:
    """The tables of chunks, from frames that have their missions and UAVs among others.

    The rows of all chunks are found at once, since to find those of one takes as long.
    """
    if not of_files:
        return
    keys = _keys_of([part for chunk in of_files for part in chunk.parts])
    keys["chunk"] = np.repeat(range(len(of_files)), [chunk.missions for chunk in of_files])
    of_frames = []
    for frame in frames:
        rows = keys.merge(frame, on=["cell", "replication"], how="left")
        ends = np.searchsorted(rows["chunk"], range(len(of_files) + 1))
        of_frames.append((rows[[*frame]], ends))
    for number, chunk in enumerate(of_files):
        parts = (rows.iloc[ends[number] : ends[number + 1]] for rows, ends in of_frames)
        columns = ({str(name): part[name].to_numpy() for name in part} for part in parts)
        yield parquet.tables_with(chunk, *columns)


def with_worst_nodes(missions: pd.DataFrame) -> pd.DataFrame:
    """The missions with the value of the node that is the worst at their design point.

    Without data sheets, and where an earlier version has simulated some of them, there is none.
    """
    for metric, nodes in ((LEAST, NODE_RATIOS), (OLDEST, NODE_AGES)):
        if nodes not in missions:
            continue
        if missions[nodes].isna().any():
            missions = missions.drop(columns=nodes)
            continue
        worst = np.empty(len(missions))
        for rows in missions.reset_index(drop=True).groupby("point").indices.values():
            by_node = np.stack(missions[nodes].to_numpy()[rows])
            worst[rows] = by_node[:, worst_node(by_node.mean(axis=0), metric)]
        missions[metric] = worst
    return missions
