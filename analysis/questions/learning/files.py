"""The files of learning curves, which may come from anybody: read with what the questions ask of.

curves = read_curves(Path("policies/trained/curves.parquet"))
curve = read_curve(Path("policies/trained/ddqn/training.parquet"))
"""

from pathlib import Path

import pandas as pd
import pyarrow as pa

from analysis.names import METRICS
from analysis.questions.learning.ablation import BASELINE
from analysis.questions.learning.curves import PAIRS, PRODUCT, REWARD, last_phase, pairs_in
from dess.errors import InputError
from dess.files.tables import read_table

_COURSE = {"phase": pa.string(), "updates": pa.int64(), "uav_slots": pa.float64()}
_COURSE |= dict.fromkeys((REWARD, PRODUCT), pa.float64())
_EVALUATED = {f"evaluation_{metric}": pa.float64() for metric in METRICS}
_FINAL = {f"final_{metric}": pa.float64() for metric in METRICS}
_OF_TRAINING = {"tick": pa.int64(), "seconds": pa.float64(), "is_best": pa.bool_()}
CURVE = pa.schema(_COURSE | _OF_TRAINING | _EVALUATED)
CURVES = pa.schema(_COURSE | {"variant": pa.string(), "seed": pa.int64()} | _FINAL)


def read_curve(path: Path) -> pd.DataFrame:
    """The curve of a training, a row per evaluation.

    Raises:
        InputError: If the file is missing or damaged, or holds no such curve.
    """
    curve = read_table(path, CURVE).to_pandas()
    if not curve["updates"].is_monotonic_increasing or curve["updates"].iloc[0] < 1:
        raise InputError(f"{path}: updates: do not grow; allowed: the training step of each row")
    if not curve["is_best"].any():
        raise InputError(f"{path}: is_best: is never true; allowed: the selected weights")
    return curve


def read_curves(path: Path) -> pd.DataFrame:
    """The curves of trainings of several variants, with the metrics of the weights they selected.

    Raises:
        InputError: If the file is missing or damaged, or holds no such curves.
    """
    curves = read_table(path, CURVES).to_pandas()
    if curves.duplicated(["variant", "seed", "phase", "updates"]).any():
        raise InputError(f"{path}: updates: are there twice; allowed: once in a phase")
    averages, pairs = curves.assign(value=0.0), pairs_in(curves).values()
    ends = [{*last_phase(averages, a).index} & {*last_phase(averages, b).index} for a, b in pairs]
    if BASELINE not in {*curves["variant"]} or not ends or not all(ends):
        known = " and ".join(next(iter(PAIRS.values())))
        raise InputError(f"{path}: variant: has no pair of trainings; allowed: {known}")
    return curves
