"""The page on performance shows numbers that are computed here anew, from the parquet files."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analysis.stats.intervals import interval_of, post_stratified
from tests.by_hand import Z, bounded
from tests.reports.small import POLICIES, run_small_studies, said_by

# Table IV of the paper.
PRINTED = {
    "success": 0.901,
    "collection_ratio": 0.798,
    "collection_ratio_and_communication": 0.719,
}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run_small_studies(tmp_path_factory.mktemp("results"), "table4", "fig4")


@pytest.fixture(scope="module")
def text(results: Path) -> str:
    return said_by("performance", results=str(results))


def by_hand(values: np.ndarray, is_share: bool) -> tuple[float, float, float]:
    """Mean with Wilson's interval of a share, or the interval of bounded values."""
    n, mean = len(values), values.mean()
    if is_share:
        centre, scale = mean + Z**2 / (2 * n), 1 + Z**2 / n
        half = Z * np.sqrt(mean * (1 - mean) / n + Z**2 / (4 * n**2))
        return mean, (centre - half) / scale, (centre + half) / scale
    return bounded(values)


def in_percent(mean: float, low: float, high: float) -> str:
    return f"{100 * mean:.1f} % [{100 * low:.1f}, {100 * high:.1f}]".replace("-", "−")


def test_the_table_beside_the_paper_s(results: Path, text: str) -> None:
    missions = pd.read_parquet(results / "table4" / "missions")
    for policy in POLICIES:
        cells = []
        for metric, printed in PRINTED.items():
            of_policy = missions[missions["policy"] == policy]
            values = of_policy[metric].to_numpy(float)
            values = post_stratified(values, of_policy["uavs"].to_numpy())
            mean, low, high = interval_of(metric, values)
            mark = "▲" if low > printed else "▼" if high < printed else "≈"
            gap = f"{100 * (mean - printed):+.1f}".replace("-", "−")
            cells.append(f"{in_percent(mean, low, high)} {gap} {mark}")
        assert f"{policy} {' '.join(cells)}" in text


def test_the_table_by_number_of_uavs(results: Path, text: str) -> None:
    missions = pd.read_parquet(results / "table4" / "missions")
    for (policy, uavs), part in missions.groupby(["policy", "uavs"], observed=True):
        intervals = [by_hand(part[m].to_numpy(float), m == "success") for m in PRINTED]
        cells = " ".join(in_percent(*interval) for interval in intervals)
        assert f"{policy} {uavs} {len(part)} {cells}" in text
