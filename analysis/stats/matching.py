"""Missions of treatments with the same random draws, side by side."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Literal, get_args

import numpy as np
import pandas as pd

from dess import InputError
from dess.analysis.metric_ranges import metric_in_groups
from dess.analysis.metrics import Metric, metric_group
from dess.analysis.stats.rows import check_columns, group_rows
from dess.analysis.stats.weights import values_within

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
        raise InputError("of", repr(of), ", ".join(get_args(Treatment)))
    check_columns(missions, [of, "replication", *metrics, *by])
    if of in by:
        raise InputError("by", f"{of} is what is compared", "other columns")
    for metric in metrics:
        values = pd.to_numeric(missions[metric], errors="coerce")
        if metric in metric_group("operations", in_units=True):
            values = values[missions[metric].notna()]
        if odd := int(len(values) - np.isfinite(values).sum()):
            raise InputError(metric, f"no number in {odd} missions", "finite numbers")
    keys = list(dict.fromkeys([*by, *(k for k in _MISSION if k in missions and k != of)]))
    twice = missions.duplicated([of, *keys])
    if twice.any():
        first = _first_row(missions.loc[twice, [of, *keys]])
        raise InputError("missions", f"{first} is there twice", "every mission once")
    spaces = [of, *(key for key in keys if key in (*by, "policy", "point", "seed"))]
    values = {metric: values_within(missions, metric, spaces) for metric in metrics}
    table = missions[[of, *keys]].assign(**values)
    return {name: part.set_index(keys)[[*values]] for (name,), part in group_rows(table, [of])}


def select_table(tables: Mapping[Any, pd.DataFrame], of: str, name: str | int) -> pd.DataFrame:
    """The table of a policy or point.

    Raises:
        InputError: If there are no missions of it.
    """
    if name not in tables:
        raise InputError(of, f"{name} has no missions", ", ".join(map(str, tables)))
    return tables[name]


def check_same_missions(tables: Mapping[Any, pd.DataFrame], name: Any, baseline: Any) -> None:
    """Raise ``InputError`` unless two policies, or points, have the same missions."""
    for lacking, having in ((name, baseline), (baseline, name)):
        absent = tables[having].index.difference(tables[lacking].index)
        if len(absent):
            raise InputError(
                lacking,
                f"lacks {len(absent)} of the missions of {having}, the first at "
                f"{_first_row(absent.to_frame())}",
                "the same missions for both",
            )


def match_groups(
    tables: Sequence[pd.DataFrame], by: Sequence[str]
) -> Iterator[tuple[tuple, list[dict[str, np.ndarray]]]]:
    """Groups of independent units: missions, or means over the missions of a replication.

    Yields:
        The group, and for each table the values of every metric, in the order of the units.
    """
    names = tables[0].index.names
    unit = [name for name in names if name in (*by, "seed", "replication")]
    means = [table.groupby(level=unit, dropna=False).mean() for table in tables]
    for group, part in group_rows(means[0].reset_index(), by):
        yield group, [{metric: m[metric].to_numpy()[part.index] for metric in m} for m in means]


def metrics_by_group(
    missions: pd.DataFrame, metrics: Iterable[str], by: Sequence[str]
) -> dict[tuple, Metric]:
    """Each metric with the range that it has in each group of missions.

    Args:
        missions: The missions, as ``metric_ranges.metric_in_missions`` takes them.
        metrics: The metrics.
        by: The columns whose values form the groups; without any, all missions are one.

    Returns:
        The metrics by their column and the values of the group. Where a value is nan, as of a field
        that a group does not have, the key has None.
    """
    groups = missions[[*by]].drop_duplicates(ignore_index=True)
    keys = [group_key(row) for row in groups.itertuples(index=False)] if by else [()]
    in_groups: dict[tuple, Metric] = {}
    for column in metrics:
        measure = metric_in_groups(missions, column, by, groups)
        in_groups |= {(column, *key): measure.at(place) for place, key in enumerate(keys)}
    return in_groups


def group_key(group: Iterable[Any]) -> tuple:
    """The values of a group in a form in which equal ones are found again, nan too."""
    return tuple(None if pd.isna(value) else value for value in group)


def _first_row(keys: pd.DataFrame) -> str:
    return ", ".join(f"{name} {keys[name].iloc[0]}" for name in keys)
