"""Every number of UAVs has the same weight in a mean: values that are post-stratified by it."""

from collections.abc import Sequence
from functools import reduce

import numpy as np
import pandas as pd

from dess.analysis.metric_ranges import metric_in_missions
from dess.analysis.metrics import NODES_BEHIND
from dess.analysis.stats.intervals import Moments
from dess.analysis.stats.rows import group_rows
from dess.analysis.stats.worst_node import worst_of_nodes

LEAST = 5  # missions of every number of UAVs for a post-stratified mean


def weights_of_fleets(counts: np.ndarray) -> np.ndarray | None:
    """The weights of the missions of every number of UAVs, relative to those of a plain mean.

    Every number of UAVs of a scenario space is equally probable, so all have the same weight in a
    mean over the space, however many missions have drawn each: the mean is post-stratified
    (Cochran, Sampling Techniques, 1977, Section 5A.9).

    Args:
        counts: (K,) numbers of missions with each number of UAVs that may be drawn.

    Returns:
        (K,) the weights. None, for a plain mean, if the number is not drawn, or if one of the
        numbers has fewer missions than ``LEAST``, which tell too little about their spread.
    """
    if len(counts) == 1 or counts.min() < LEAST:
        return None
    return counts.sum() / len(counts) / counts


def post_stratified(values: np.ndarray, fleets: np.ndarray) -> np.ndarray:
    """Values whose mean, and its standard error, are post-stratified by the number of UAVs.

    They are the linearised values: the mean of the strata's means, and the weighted deviations from
    the mean of the own stratum. So what tells an interval or a test from a sample of missions takes
    them in place of the values.

    Args:
        values: (n,) values of missions of one scenario space.
        fleets: (n,) their numbers of UAVs; those from the smallest to the largest may be drawn.

    Returns:
        (n,) the linearised values. The values themselves, if ``weights_of_fleets`` gives none, or
        if some are nan: then a mean is over the missions that have measured it, whose fleets have
        unknown weights.
    """
    if not values.size or np.isnan(values).any():
        return values
    stratum = fleets.astype(int) - int(fleets.min())
    counts = np.bincount(stratum)
    weights = weights_of_fleets(counts)
    if weights is None:
        return values
    means = np.bincount(stratum, values) / counts
    spread = weights * np.sqrt(counts / (counts - 1) * (1 - 1 / len(values)))
    return means.mean() + spread[stratum] * (values - means[stratum])


def moments_of_space(fleets: Sequence[Moments | None], missions: int) -> Moments:
    """The moments of the linearised values of ``post_stratified``.

    Args:
        fleets: For every number of UAVs that may be drawn the moments of its missions; None where
            it has none.
        missions: Number of missions; what some of them have not measured has a plain mean.
    """
    drawn = [fleet for fleet in fleets if fleet]
    whole = reduce(Moments.with_others, drawn)
    counts = np.array([fleet.n if fleet else 0 for fleet in fleets])
    weights = weights_of_fleets(counts)
    if weights is None or whole.n < missions:
        return whole
    mean = float(np.mean([fleet.mean for fleet in drawn]))
    spread = weights**2 * counts / (counts - 1) * (1 - 1 / whole.n)
    squares = float(spread @ [fleet.squares for fleet in drawn])
    cubes = float(spread**1.5 @ [fleet.cubes for fleet in drawn])
    return whole._replace(total=mean * whole.n, squares=squares, cubes=cubes)


def values_within(missions: pd.DataFrame, metric: str, spaces: Sequence[str]) -> np.ndarray:
    """The values of a metric, ``post_stratified`` in every scenario space by itself.

    Args:
        missions: A row per mission; without a column ``uavs``, the values are taken as they are.
        metric: The metric.
        spaces: The columns that tell the spaces apart, such as ``point``.
    """
    is_of_node = NODES_BEHIND.get(metric) in missions
    if is_of_node:
        values = np.empty(len(missions))
    else:
        values = missions[metric].to_numpy(float).copy()
        if "uavs" not in missions:
            return values
    table = missions[[*spaces]].reset_index(drop=True)
    for _, part in group_rows(table, spaces):
        rows = part.index.to_numpy()
        if is_of_node:
            values[rows] = _values_of_worst_node(missions, metric, rows)
        else:
            values[rows] = post_stratified(values[rows], missions["uavs"].to_numpy()[rows])
    return values


def _values_of_worst_node(missions: pd.DataFrame, metric: str, rows: np.ndarray) -> np.ndarray:
    """The linearised values of ``worst_of_nodes``, of rows of missions of one scenario space.

    Those of scenarios with different numbers of nodes are the values of the worst node of each.
    """
    of_space = missions.iloc[rows]
    of_missions = of_space[NODES_BEHIND[metric]].to_numpy()
    if len({len(nodes) for nodes in of_missions}) > 1:
        return of_space[metric].to_numpy(float)
    by_node = np.stack(of_missions)
    if "uavs" in of_space and of_space["uavs"].nunique() > 1:
        fleets = of_space["uavs"].to_numpy()
        by_node = np.apply_along_axis(post_stratified, 0, by_node, fleets)
    return worst_of_nodes(by_node, metric_in_missions(of_space, metric))


def by_replication(
    missions: pd.DataFrame, metric: str, columns: str | Sequence[str]
) -> pd.DataFrame:
    """A metric with a row per replication and a column per setting, ``post_stratified``.

    Args:
        missions: A row per mission.
        metric: The metric.
        columns: What tells the settings apart, such as ``point``.
    """
    if isinstance(columns, str):
        names = [columns]
    else:
        names = [*columns]
    table = missions[["replication", *names]].assign(value=values_within(missions, metric, names))
    return table.pivot(index="replication", columns=columns, values="value")
