"""Bounds as tables: a row per mission, with the ratio and the prices that prove it."""

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from analysis.bound import Bound
from analysis.results.chunks import Chunk
from analysis.results.parquet import KEY, PARTS, Row

# ``prices`` has a value for every cut and node, the nodes of the first cut first.
BOUNDS = pa.schema(
    [
        ("cell", KEY),
        ("replication", pa.int64()),
        ("ratio", pa.float64()),
        ("iterations", pa.int64()),
        ("cuts", pa.list_(pa.int64())),
        ("prices", pa.list_(pa.float64())),
    ]
)

Place = tuple[int, int]  # a design point and a replication


def table_of(chunk: Chunk, bounds: Sequence[Bound]) -> pa.Table:
    """The bounds of the missions of a chunk as a table, with their parts as metadata."""
    missions = [(part.cell.key, r) for part in chunk.parts for r in part.replications]
    cells, replications = zip(*missions, strict=True)
    columns = {
        "cell": pa.array(cells).dictionary_encode(),
        "replication": replications,
        "ratio": [bound.ratio for bound in bounds],
        "iterations": [bound.iterations for bound in bounds],
        "cuts": [bound.cuts.tolist() for bound in bounds],
        "prices": [bound.prices.ravel().tolist() for bound in bounds],
    }
    return pa.table(columns, schema=BOUNDS.with_metadata({PARTS: json.dumps(chunk.rows)}))


def bounds_in(rows: Iterable[Mapping[str, Any]]) -> list[Bound]:
    """The bounds in rows of tables."""
    return [
        Bound(
            ratio=row["ratio"],
            prices=np.array(row["prices"]).reshape(len(row["cuts"]), -1),
            cuts=np.array(row["cuts"], np.int64),
            iterations=row["iterations"],
        )
        for row in rows
    ]


def check(table: pa.Table, rows: Sequence[Row], nodes: Mapping[str, int]) -> None:
    """Check that a table has the bounds of some parts, and no value that no bound can have.

    Args:
        table: The bounds, such as those of a file that anybody may have written.
        rows: The key, start and stop of every part, in the order of the bounds.
        nodes: The number of nodes of the scenario of a cell, by the key of the cell. Cells that
            are not among them belong to no design point.

    Raises:
        ValueError: If the bounds are those of other missions, or a value is out of range.
    """
    if any(column.null_count for column in table.columns):
        raise ValueError("the bounds are not complete")
    wanted = [(key, number) for key, start, stop in rows for number in range(start, stop)]
    places = (table[name].to_pylist() for name in ("cell", "replication"))
    if [*zip(*places, strict=True)] != wanted:
        raise ValueError("the bounds are not those of the requested missions")
    ratios = table["ratio"].to_numpy()
    if not ((ratios >= 0) & (ratios <= 1)).all():  # nan is neither
        raise ValueError("the bounds have a ratio that is not between 0 and 1")
    if (table["iterations"].to_numpy() < 0).any():
        raise ValueError("the bounds have a number of iterations below 0")
    for row in table.to_pylist():
        cuts, prices = np.array(row["cuts"], np.int64), np.array(row["prices"], float)
        if not len(cuts) or (np.diff(cuts, prepend=-1) <= 0).any():
            raise ValueError("the bounds have cuts that do not follow each other")
        if len(prices) != len(cuts) * nodes.get(row["cell"], len(prices) // len(cuts)):
            raise ValueError("the bounds do not have a price for every cut and node")
        if not (np.isfinite(prices) & (prices >= 0)).all():  # a missing value is nan here
            raise ValueError("the bounds have a price that is not a number from 0 on")
