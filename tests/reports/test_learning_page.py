"""The page on learning tells the shipped curves, and judges by those that it is given."""

import re
from pathlib import Path

import pandas as pd
import pytest

from analysis import numbers
from analysis.names import PRODUCT
from analysis.questions import learning as curves
from analysis.replication import paper
from analysis.stats.verdict import HOLDS, INCONCLUSIVE
from policies.registry import TRAINED
from tests.reports.small import said_by


def test_the_learning_page_tells_the_ablation() -> None:
    last = curves.finals(pd.read_parquet(TRAINED / "curves.parquet"))
    table = curves.ablation(last, f"final_{PRODUCT}", "quick")
    text = said_by("learning")
    for row in table.itertuples():
        shown = numbers.percent(row.mean)
        if row.low < row.high:
            shown = numbers.interval(row.mean, row.low, row.high)
        assert re.search(rf"{re.escape(row.variant)} {row.n} {re.escape(shown)}", text)


@pytest.mark.parametrize(("length", "verdict"), [(paper.CROSSING, HOLDS), (12_000, INCONCLUSIVE)])
def test_the_learning_page_judges_by_the_curves_it_is_given(
    tmp_path: Path, length: int, verdict: str
) -> None:
    """Transfer learning surely wins; trainings shorter than the paper's do not tell."""
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
    assert f"By these rules the claim {verdict} in 2 of 2 comparisons." in text
    assert text.count(f"{verdict}: is above in all of phase II") == 2
    short = f"its crossing at {paper.CROSSING:,}: by the rules they are too short to tell"
    assert (short in text) == (verdict == INCONCLUSIVE)
    assert "ddqn and ddqn-2, n = 2 trainings that differ in their seed alone." in text
    assert "worse: no transfer" in text
