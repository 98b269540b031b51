"""Match missions of policies, or of design points, by the replication that they share."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal, get_args

import numpy as np
import pandas as pd

from analysis.names import MEASURES
from analysis.stats.intervals import check_columns, groups, values_within
from dess import InputError

Treatment = Literal["policy", "point"]

_MISSION = ("policy", "point", "seed", "replication")  # what identifies a mission


def metrics_by_treatment(
    missions: pd.DataFrame, of: Treatment, metrics: Sequence[str], by: Sequence[str]
) -> dict[Any, pd.DataFrame]:
    """The metrics of every policy (or point), indexed by the keys of their missions.

    Raises:
        InputError: If a column is missing or not of numbers, or a mission appears twice.
    """
    if of not in get_args(Treatment):
        raise InputError(f"of: {of!r}; allowed: {', '.join(get_args(Treatment))}")
    check_columns(missions, [of, "replication", *metrics, *by])
    if of in by:
        raise InputError(f"by: {of} is what is compared; allowed: other columns")
    for metric in metrics:
        values = pd.to_numeric(missions[metric], errors="coerce")
        values = values[missions[metric].notna()] if metric in MEASURES else values
        if odd := int(len(values) - np.isfinite(values).sum()):
            raise InputError(f"{metric}: no number in {odd} missions; allowed: finite numbers")
    keys = list(dict.fromkeys([*by, *(k for k in _MISSION if k in missions and k != of)]))
    twice = missions.duplicated([of, *keys])
    if twice.any():
        first = _first_row(missions.loc[twice, [of, *keys]])
        raise InputError(f"missions: {first} is there twice; allowed: every mission once")
    spaces = [of, *(key for key in keys if key in (*by, "policy", "point", "seed"))]
    values = {metric: values_within(missions, metric, spaces) for metric in metrics}
    table = missions[[of, *keys]].assign(**values)
    return {name: part.set_index(keys)[[*values]] for (name,), part in groups(table, [of])}


def select(tables: Mapping[Any, pd.DataFrame], of: str, name: str | int) -> pd.DataFrame:
    """The table of a policy or point.

    Raises:
        InputError: If there are no missions of it.
    """
    if name not in tables:
        raise InputError(f"{of}: {name} has no missions; allowed: {', '.join(map(str, tables))}")
    return tables[name]


def check_same_missions(tables: Mapping[Any, pd.DataFrame], name: Any, baseline: Any) -> None:
    """Raise ``InputError`` unless two policies, or points, have the same missions."""
    for lacking, having in ((name, baseline), (baseline, name)):
        absent = tables[having].index.difference(tables[lacking].index)
        if len(absent):
            raise InputError(
                f"{lacking}: lacks {len(absent)} of the missions of {having}, the first at "
                f"{_first_row(absent.to_frame())}; allowed: the same missions for both"
            )


def matched(
    tables: Sequence[pd.DataFrame], by: Sequence[str]
) -> Iterator[tuple[tuple, list[dict[str, np.ndarray]]]]:
    """Groups of independent units: missions, or means over the missions of a replication.

    Yields:
        The group, and for each table the values of every metric, in the order of the units.
    """
    names = tables[0].index.names
    unit = [name for name in names if name in (*by, "seed", "replication")]
    means = [table.groupby(level=unit, dropna=False).mean() for table in tables]
    for group, part in groups(means[0].reset_index(), by):
        yield group, [{metric: m[metric].to_numpy()[part.index] for metric in m} for m in means]


def _first_row(keys: pd.DataFrame) -> str:
    return ", ".join(f"{name} {keys[name].iloc[0]}" for name in keys)
