"""The files of learning curves, which may come from anybody: read with what the questions ask of.

curves = read_curves(Path("policies/trained/curves.parquet"))
curve = read_curve(Path("policies/trained/ddqn/training.parquet"))
"""

from pathlib import Path

import pandas as pd

from analysis.names import METRICS
from analysis.questions.learning.ablation import BASELINE
from analysis.questions.learning.curves import PAIRS, PRODUCT, REWARD, last_phase, pairs_in
from dess.errors import InputError
from dess.files.tables import read_table

COURSE: dict[str, type] = {"phase": str, "updates": int, "uav_slots": float}
COURSE |= {REWARD: float, PRODUCT: float}
CURVE = COURSE | {"tick": int, "seconds": float, "is_best": bool}
CURVE |= {f"evaluation_{metric}": float for metric in METRICS}
CURVES = COURSE | {"variant": str, "seed": int} | {f"final_{m}": float for m in METRICS}


def read_curve(path: Path) -> pd.DataFrame:
    """The curve of a training, a row per evaluation.

    Raises:
        InputError: If the file is missing or damaged, or holds no such curve.
    """
    curve = read_table(path, CURVE).to_pandas()
    _check_steps(curve, path)
    if not curve["is_best"].any():
        raise InputError(f"{path}: is_best is never true; allowed: the selected weights")
    return curve


def read_curves(path: Path) -> pd.DataFrame:
    """The curves of trainings of several variants, with the metrics of the weights they selected.

    Raises:
        InputError: If the file is missing or damaged, or holds no such curves.
    """
    curves = read_table(path, CURVES).to_pandas()
    for _, of_variant in curves.groupby("variant"):
        steps = [part[["phase", "updates"]] for _, part in of_variant.groupby("seed")]
        if any(part.to_numpy().tolist() != steps[0].to_numpy().tolist() for part in steps):
            raise InputError(f"{path}: seed has other updates; allowed: those of the variant")
        _check_steps(steps[0], path)
    pairs = pairs_in(curves)
    if BASELINE not in {*curves["variant"]} or not pairs:
        known = " and ".join(PAIRS[next(iter(PAIRS))])
        raise InputError(f"{path}: variant has no pair of trainings; allowed: {known}")
    averages = curves.assign(value=0.0)
    for pair in pairs.values():
        a, b = (last_phase(averages, variant).index for variant in pair)
        if not len(a.intersection(b)):
            raise InputError(f"{path}: updates of {' and '.join(pair)} have nothing in common")
    return curves


def _check_steps(curve: pd.DataFrame, path: Path) -> None:
    """Refuse a curve whose training steps do not grow."""
    steps = curve["updates"]
    if steps.iloc[0] < 1 or not (steps.diff().iloc[1:] > 0).all():
        raise InputError(f"{path}: updates do not grow; allowed: the training step of each row")
