"""The two sides of a variation, baseline and variation, compared on the same missions.

    compare_sides(load_results("results/what-if/HASH"))   # a row per policy and metric

The study has two design points: the baseline, then the variation.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import brentq
from scipy.special import ndtri

from dess.analysis.answers import summary
from dess.analysis.answers.policies import ranks
from dess.analysis.answers.settings.home import with_way_home
from dess.analysis.measured import measured_in
from dess.analysis.metric_ranges import limit_of
from dess.analysis.metrics import (
    COST,
    METRICS,
    MOST_SLOTS,
    PRODUCT,
    column_in_sheet_unit,
    columns_in_units,
    in_either,
)
from dess.analysis.results.tables import Results, compute_once
from dess.analysis.stats.corrections import add_adjusted
from dess.analysis.stats.differences import compare
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.weights import by_replication

BASELINE, VARIATION = 0, 1  # the design points
SIDES = ("baseline", "variation")

# Further quantities per mission, in addition to the paper's metrics.
MEASURES = {
    "slots": "Mission slots",
    "collected": "Data collected",
    "collected_per_uav": "Data collected per UAV",
    "residual": "Data left",
    "charging_per_uav": "Slots charging per UAV",
    "waiting_per_uav": "Slots waiting per UAV",
    "depleted": "Depleted batteries in 100 missions",
}

# Power, for ``missions_needed``: the probability that a difference of this size is significant.
POWER = 0.8

# What is 0 where nothing can fail and no buffer is limited, which is not measured then.
_NOTHING = ("failures", "slots_grounded", "lost")

_MISSION = ["policy", "point", "replication"]


@compute_once
def missions_of(results: Results) -> pd.DataFrame:
    """``results.missions`` with all of ``MEASURES``; nothing failed where nothing can fail.

    There, none can (``metric_ranges.limit_of``), so that the other side cannot have less.
    """
    uavs = results.uavs.assign(depleted=100 * (results.uavs["end"] == "battery"))
    sums = uavs.groupby(_MISSION)[["slots_charging", "slots_waiting", "depleted"]].sum()
    missions = results.missions.join(sums, on=_MISSION)
    units = results.store.manifest.units_at(missions["point"].to_numpy())
    fillable = [name for name in _NOTHING if name in missions]
    sides = missions.fillna(dict.fromkeys(fillable, 0.0)).assign(
        collected_per_uav=missions["collected"] / missions["uavs"],
        charging_per_uav=missions["slots_charging"] / missions["uavs"],
        waiting_per_uav=missions["slots_waiting"] / missions["uavs"],
    )
    if units:
        sides = sides.assign(**columns_in_units(sides, units))
    limits: dict[str, np.ndarray] = {}
    for name in fillable:
        most = np.where(missions[name].isna(), 0.0, np.inf)
        limits |= {limit_of(column): most for column in in_either(name) if column in sides}
    return sides.assign(**limits)


def measured_columns(results: Results) -> list[str]:
    """What scenarios beyond the paper measure, on at least one of both sides."""
    missions = results.missions
    return [name for name in measured_in(missions) if missions[name].notna().any()]


def means_of_sides(results: Results) -> pd.DataFrame:
    """Means with intervals: rows of ``dess.analysis.summary`` by ``policy`` and ``point``."""
    table = summary.means_of_points(replace(results, missions=missions_of(results)))
    return table[table["metric"].isin([*METRICS, *measured_columns(results)])].reset_index(
        drop=True
    )


@compute_once
def compare_sides(results: Results) -> pd.DataFrame:
    """The variation compared with the baseline, mission by mission.

    Returns:
        A row per policy and metric (those of ``METRICS``, the way home where missions may end in
        the air, the cost if there are prices, what is ``measured_columns``, then those of
        ``MEASURES``): ``policy``, the means ``before`` and ``after``, and the columns of
        ``dess.analysis.compare``, with ``p_adjusted``
        (Holm) over the metrics of a policy. Every interval has its own level of 95 %; see
        ``stats.differences.compare_pairs``. Of what only one side measures, ``n`` is 0 and all else
        nan but the mean of this side.
    """
    missions = missions_of(results)
    of_paper = with_way_home(results, METRICS)
    metrics = [
        *of_paper,
        *(name for name in (COST,) if name in missions),
        *measured_columns(results),
        *(column_in_sheet_unit(name, missions) for name in MEASURES),
    ]
    # Without a quota, all missions last until their horizon.
    has_quota = any(space.quota for space in results.store.manifest.scenarios)
    fixed = [] if has_quota else [column_in_sheet_unit("slots", missions)]
    tables = []
    for policy, rows in missions.groupby("policy", sort=False):
        table = add_adjusted(_compare_with_baseline(rows, metrics, fixed), "holm")
        table = table.set_index("metric").reindex(metrics).rename_axis("metric").reset_index()
        table["n"] = table["n"].fillna(0).astype(int)
        sides = pd.DataFrame({m: by_replication(rows, m, "point").mean() for m in metrics})
        table.insert(0, "policy", policy)
        table["before"] = table["metric"].map(sides.loc[BASELINE])
        table["after"] = table["metric"].map(sides.loc[VARIATION])
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def _compare_with_baseline(
    rows: pd.DataFrame, metrics: Sequence[str], fixed: Sequence[str]
) -> pd.DataFrame:
    """The variation compared with the baseline by some metrics, as ``dess.analysis.compare``.

    Args:
        rows: The missions of a policy.
        metrics: The metrics.
        fixed: Those that no rare failure can change: their range does not count.
    """
    without_range = rows.drop(columns=in_either(MOST_SLOTS), errors="ignore")
    tables = [
        compare(missions, BASELINE, names, correction=None, of="point")
        for missions, names in (
            (rows, [name for name in metrics if name not in fixed]),
            (without_range, fixed),
        )
    ]
    return pd.concat([table for table in tables if len(table)], ignore_index=True)


def missions_needed(answer: Any) -> float:
    """The number of missions that would show a difference of the observed size.

    It is computed by the normal approximation from the observed difference and variance, which are
    estimates themselves. What the interval allows for rare failures falls with the number of
    missions, all else with its root.

    Returns:
        The number with which the interval excludes 0 with probability ``POWER``; infinite if there
        is no difference, or its variance is unknown.
    """
    if not answer.difference or not answer.low < answer.high or np.isnan(answer.student):
        return np.inf
    gap, half = abs(answer.difference), (answer.high - answer.low) / 2
    quantile, power = -ndtri((1 - LEVEL) / 2), ndtri(POWER)
    spread = answer.student / quantile * np.sqrt(answer.n)
    rare = np.sqrt(max((half * answer.n / quantile) ** 2 - answer.n * spread**2, 0))

    def shortfall(root: float) -> float:
        """How far the sum of so many differences is below what is needed."""
        needed = quantile * np.hypot(spread * root, rare) + power * spread * root
        return float(needed - gap * root**2)

    least = (quantile + power) * spread / gap
    most = least + np.sqrt(quantile * rare / gap)
    root = brentq(shortfall, 0.999 * least, 1.001 * most)
    return float(np.ceil(root**2))


def paired_differences(results: Results, policy: str, metric: str = PRODUCT) -> pd.Series:
    """Variation - baseline in a metric of a policy, by replication."""
    missions = results.missions_of(policy)
    sides = missions.pivot(index="replication", columns="point", values=metric)
    return sides[VARIATION] - sides[BASELINE]


def best_policy_of_side(results: Results, point: int) -> str:
    """The best policy on one side, by ``summary.best_policy``."""
    missions = results.missions
    return ranks.best_policy(missions[missions["point"] == point])
