"""The numbers that the paper prints, their intervals, and its choice of the number of UAVs."""

from collections.abc import Mapping

import pandas as pd
from scipy.special import stdtrit

from dess.analysis.answers import decided, summary
from dess.analysis.answers.policies import performance, ranks
from dess.analysis.metrics import METRICS, PRODUCT, RATIO, SUCCESS
from dess.analysis.names import field_named, value_text
from dess.analysis.results.tables import Results
from dess.analysis.stats.intervals import Interval, share_interval
from dess.analysis.stats.kinds import LEVEL

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

# The printed means, and over how many missions, by the name of the study that does the same.
PRINTED = {"table4": TABLE_IV, "sweet-spot": SWEET_SPOT}
MISSIONS = {"table4": TABLE_IV_MISSIONS, "sweet-spot": SWEET_SPOT_MISSIONS}

# What is to be said where a collection ratio is compared with the paper's. The weight of the scale
# is what ``dess what-if --baseline edge_snr=-25 --policy ddqn --missions 600`` says with
# ``--set edge_snr=-30`` and with ``--set edge_snr=-20``.
SNR_IN_WORDS = (
    "The paper prints neither transmit power nor noise. The scale of the SNR here, −25 dB at half "
    "the diagonal of the grid, is that of the public code of its reference 12, whose model it "
    "extends. It matters: 5 dB less lower the collection ratio of ddqn by 4 points, and 5 dB more "
    "raise it by 3."
)

# The best number of UAVs (Section V-D).
BEST_UAVS = 3

# Training steps at which the curve with transfer learning overtakes the one without it, and from
# which on the curve without it stays level (Fig. 3b, Section V-B).
CROSSING, LEVEL_FROM = 800_000, 500_000


def interval_of_share(share: float, missions: int) -> Interval:
    """A printed share of missions with its Wilson interval, which the paper does not print."""
    return Interval(share, *share_interval(round(share * missions), missions)[1:])


def printed_intervals(results: Results, name: str) -> dict[str, Interval]:
    """The paper's means with intervals, which it does not print.

    They follow from its numbers of missions and from our spread: the standard deviation of the
    collection ratio of our best policy over the missions of the same study, or over those that
    check its selection. A mission that fails counts 0 in the product. With success s and a ratio of
    mean m and variance v, whatever the outcome, its variance is s (v + m^2) - (s m)^2.

    Args:
        results: The study that does the same.
        name: Its name in ``PRINTED``.

    Returns:
        The interval of every printed metric.
    """
    printed = PRINTED[name]
    missions = results.missions
    if results.study.selection is not None:
        missions = results.checks
    if missions.empty:
        return exact(printed)
    best = ranks.best_policy(missions)
    variance = float(missions.loc[missions["policy"] == best, RATIO].var())
    return intervals_of_means(printed, MISSIONS[name], variance)


def exact(printed: Mapping[str, float]) -> dict[str, Interval]:
    """Printed numbers without intervals: the paper does not say over how many missions they are."""
    return {metric: Interval(mean, mean, mean) for metric, mean in printed.items()}


def intervals_of_means(
    printed: Mapping[str, float], missions: int, variance: float
) -> dict[str, Interval]:
    """Printed means with the intervals that so many missions give, see ``printed_intervals``.

    Args:
        printed: The success, the collection ratio and the product.
        missions: The number of missions.
        variance: The variance of the collection ratio over missions; nan if it is not known.
    """
    success = printed[SUCCESS]
    ratio = printed[RATIO]
    of_product = success * (variance + ratio**2) - (success * ratio) ** 2
    quantile = -float(stdtrit(missions - 1, (1 - LEVEL) / 2))
    intervals = exact(printed)
    intervals[SUCCESS] = interval_of_share(success, missions)
    for metric, spread in ((RATIO, variance), (PRODUCT, of_product)):
        half = quantile * (spread / missions) ** 0.5
        if half > 0:
            intervals[metric] = Interval(
                printed[metric], printed[metric] - half, printed[metric] + half
            )
    return intervals


def setting_in_symbols(results: Results, point: int) -> dict[str, str]:
    """The values of a design point in words, by the short names of its parameters."""
    values = results.store.manifest.points[point].values
    return {field_named(field).short: value_text(value) for field, value in values.items()}


def best_settings_table(results: Results) -> pd.DataFrame:
    """A table with a row for the paper and a row per policy: its best setting and its check."""
    checks = {(row.policy, row.metric): row for row in summary.means_of_check(results).itertuples()}
    paper = printed_intervals(results, "sweet-spot")
    printed = {name: performance.format_printed(paper[metric]) for metric, name in METRICS.items()}
    rows = [{"Policy": "paper", **dict.fromkeys(setting_in_symbols(results, 0), ""), **printed}]
    for row in decided.selected_settings(results).itertuples():
        means = {
            name: performance.format_with_mark(checks[row.policy, metric], paper[metric])
            for metric, name in METRICS.items()
            if checks
        }
        effort = {"Missions": f"{row.missions:,}", "Settings left": str(row.left)}
        effort["Guarantee"] = row.guarantee
        rows.append(
            {"Policy": row.policy, **setting_in_symbols(results, row.point), **means, **effort}
        )
    return pd.DataFrame(rows)
