"""The page on learning shows the shipped curves, and judges by those that it is given."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import t

from analysis.names import PRODUCT
from analysis.paper import values
from analysis.stats.verdict import HOLDS, INCONCLUSIVE
from policies.registry import TRAINED
from tests.reports.small import said_by


def test_the_table_of_variants_is_that_of_the_curves() -> None:
    """Means with Student's interval over trainings, computed anew from the parquet file."""
    curves = pd.read_parquet(TRAINED / "curves.parquet")
    ends = curves.sort_values("updates").groupby(["variant", "seed"])[f"final_{PRODUCT}"].last()
    text = said_by("learning")
    equal = curves.groupby("variant")["updates"].transform("max") == 12_000
    ends = ends[ends.index.get_level_values("variant").isin(curves[equal]["variant"])]
    for variant, shares in ends.groupby("variant"):
        n, mean = len(shares), 100 * shares.mean()
        half = t.ppf(0.975, n - 1) * 100 * shares.std(ddof=1) / np.sqrt(n) if n > 1 else 0
        interval = f" [{mean - half:.1f}, {mean + half:.1f}]" if half else ""
        assert f"{variant} {n} {mean:.1f} %{interval}" in text


@pytest.mark.parametrize(("length", "verdict"), [(values.CROSSING, HOLDS), (12_000, INCONCLUSIVE)])
def test_the_learning_page_judges_by_the_curves_it_is_given(
    tmp_path: Path, length: int, verdict: str
) -> None:
    """Transfer learning wins clearly; trainings shorter than the paper's are inconclusive."""
    same = {"phase": "battery", "uav_slots": 1e6, "final_success": 1, "final_collection_ratio": 1}
    rows = [
        {
            "variant": variant,
            "seed": seed,
            "updates": length * step // 4,
            "evaluation_reward": top * step + seed / 1000,
            f"evaluation_{PRODUCT}": top * step / 4 + seed / 1000,
            f"final_{PRODUCT}": top + seed / 1000,
        }
        | same
        for variant, top in (("quick", 0.8), ("no transfer", 0.4))
        for seed in (1, 2, 3)
        for step in (1, 2, 3, 4)
    ]
    pd.DataFrame(rows).to_parquet(tmp_path / "curves.parquet")
    for name in ("ddqn", "ddqn-2"):
        (tmp_path / name).symlink_to(TRAINED / name)
    text = said_by("learning", trained=str(tmp_path))
    assert text.count(f"{verdict} is above in all of phase II") == 2
    assert f"The longest of these pairs have {length:,} steps;" in text
    # The mean of three trainings, the prediction interval of one more, and the difference.
    new = r"\[39\.[5-9], 40\.[5-9]\]"
    assert re.search(
        rf"no transfer 3 40\.2 % \[40\.0, 40\.4\] {new} −40\.0 \[−40\.2, −39\.8\] ▼", text
    )
