"""The numbers that the paper prints, and its choice of the number of UAVs."""

import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers import summary
from dess.analysis.metrics import METRICS, PRODUCT, RATIO, SUCCESS
from dess.analysis.names import field_named, value_text
from dess.analysis.results.tables import Results
from dess.analysis.stats.intervals import Interval, share_interval

# Table IV: means over TABLE_IV_MISSIONS random missions of the scenario space of Table II.
TABLE_IV_MISSIONS = 1000
TABLE_IV = {SUCCESS: 0.901, RATIO: 0.798, PRODUCT: 0.719}

# Fig. 4 (a), (b), (c) by number of UAVs: C_S 30, C_C 80, 12.5 data units per node, flying time 80.
# The paper does not say over how many missions, and does not print the product.
FIG_4 = {
    1: {SUCCESS: 0.996, RATIO: 0.634},
    2: {SUCCESS: 0.996, RATIO: 0.894},
    3: {SUCCESS: 0.990, RATIO: 0.938},
}

# Section V-D: means over SWEET_SPOT_MISSIONS missions with every parameter at its best value.
SWEET_SPOT_MISSIONS = 300
SWEET_SPOT = {SUCCESS: 0.99, RATIO: 0.936, PRODUCT: 0.93}

# The printed means, by the name of the shipped study that does the same.
PRINTED = {"table4": TABLE_IV, "sweet-spot": SWEET_SPOT}

# The best number of UAVs (Section V-D).
BEST_UAVS = 3

# Training steps at which the curve with transfer learning overtakes the one without it, and from
# which on the curve without it stays level (Fig. 3b, Section V-B).
CROSSING, LEVEL_FROM = 800_000, 500_000


def interval_of_share(share: float, missions: int) -> Interval:
    """A printed share of missions with its Wilson interval, which the paper does not print."""
    return Interval(share, *share_interval(round(share * missions), missions)[1:])


def setting_in_symbols(results: Results, point: int) -> dict[str, str]:
    """The values of a design point in words, by the short names of its parameters."""
    values = results.store.manifest.points[point].values
    return {field_named(field).short: value_text(value) for field, value in values.items()}


def best_settings_table(results: Results) -> pd.DataFrame:
    """A table with a row for the paper and a row per policy: its best setting and its check."""
    checks = {(row.policy, row.metric): row for row in summary.means_of_check(results).itertuples()}
    printed = {name: numbers.format_percent(SWEET_SPOT[metric]) for metric, name in METRICS.items()}
    rows = [{"Policy": "paper", **dict.fromkeys(setting_in_symbols(results, 0), ""), **printed}]
    for row in summary.selected_settings(results).itertuples():
        means = {
            name: summary.format_with_mark(checks[row.policy, metric], SWEET_SPOT[metric])
            for metric, name in METRICS.items()
            if checks
        }
        effort = {"Missions": f"{row.missions:,}", "Settings left": str(row.left)}
        effort["Guarantee"] = row.guarantee
        rows.append(
            {"Policy": row.policy, **setting_in_symbols(results, row.point), **means, **effort}
        )
    return pd.DataFrame(rows)
