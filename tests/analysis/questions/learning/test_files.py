"""Learning curves that anybody may have sent: read as tables, or refused in one line."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from analysis.questions.learning.files import CURVE, CURVES, read_curve, read_curves
from dess.errors import InputError
from policies.registry import TRAINED

Change = Callable[[pd.DataFrame], Any]


@pytest.mark.parametrize(
    ("path", "read", "columns"),
    [("curves.parquet", read_curves, CURVES), ("ddqn/training.parquet", read_curve, CURVE)],
)
def test_shipped_curves_are_read_as_they_are(path: str, read: Any, columns: Any) -> None:
    kept = pd.read_parquet(TRAINED / path)[columns.names]
    pd.testing.assert_frame_equal(read(TRAINED / path), kept, check_dtype=False)


# What a forger makes of sound curves, and what the line names.
FORGED: dict[str, Change] = {
    "has no sound column variant": lambda curves: curves.drop(columns="variant"),
    "has no sound column final_success": lambda curves: curves.drop(columns="final_success"),
    "has no sound column seed": lambda curves: curves.assign(seed="one"),
    "has no sound column evaluation_reward": lambda c: c.assign(evaluation_reward=float("inf")),
    "has no sound column uav_slots": lambda c: c.assign(uav_slots=c["tick"].where(c.index > 0)),
    "has no sound column phase": lambda curves: curves[:0],
    "updates: are there twice": lambda curves: curves.assign(updates=1),
    "variant: has no pair of trainings": lambda curves: curves[curves["variant"] == "quick"],
    "variant: has no pair": lambda c: c.assign(updates=c["updates"] + (c["variant"] == "quick")),
}


@pytest.mark.parametrize("problem", FORGED)
def test_forged_curves_are_a_line(problem: str, tmp_path: Path) -> None:
    path = tmp_path / "curves.parquet"
    FORGED[problem](pd.read_parquet(TRAINED / "curves.parquet")).to_parquet(path)
    with pytest.raises(InputError, match=f"^{path}: {problem}"):
        read_curves(path)


@pytest.mark.parametrize(
    "wrong", [{"is_best": False}, {"updates": lambda curve: curve["updates"].to_numpy()[::-1]}]
)
def test_a_forged_curve_is_a_line(wrong: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "training.parquet"
    pd.read_parquet(TRAINED / "ddqn" / "training.parquet").assign(**wrong).to_parquet(path)
    with pytest.raises(InputError, match=f"^{path}: {next(iter(wrong))}: .*; allowed: "):
        read_curve(path)
