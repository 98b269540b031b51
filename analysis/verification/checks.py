"""Checks: what was seen beside what is known, and the verdict on all of them together.

A check of chance has a p-value, an exact one an error and the bound that it must keep.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from analysis.stats.correction import adjust
from analysis.stats.verdict import HOLDS, INCONCLUSIVE, REFUTED

# The chance that any check of chance fails although all that is known holds.
ALPHA = 0.01


class Check(NamedTuple):
    """Something known, and what was seen of it; without ``p`` and ``error`` it cannot be told.

    Attributes:
        topic: What part of the simulator it is about.
        test: What was compared, and how.
        known: The closed form.
        seen: The estimate that stands beside it.
        n: Number of observations.
        p: Chance of a deviation as large as that seen, if the closed form holds.
        error: Deviation where there must be none.
        bound: The largest error that is none.
    """

    topic: str
    test: str
    known: str
    seen: str
    n: int
    p: float | None = None
    error: float | None = None
    bound: float = 0.0


def judge(checks: Sequence[Check], alpha: float = ALPHA) -> pd.DataFrame:
    """The verdicts: by Holm over all checks of chance, by their bounds of the exact ones.

    Args:
        checks: The checks of a page; p-values of all of them are corrected together.
        alpha: Chance that any of them is refused although all hold.

    Returns:
        A row per check: its fields, ``p_adjusted`` and ``verdict``, one of ``effects.HOLDS``,
        ``REFUTED`` and ``INCONCLUSIVE``.
    """
    table = pd.DataFrame(checks, columns=Check._fields).astype({"p": float, "error": float})
    chance = table["p"].notna()
    table.loc[chance, "p_adjusted"] = adjust(table.loc[chance, "p"].to_numpy(), "holm")
    fails = (table["p_adjusted"] <= alpha) | (table["error"] > table["bound"])
    told = chance | table["error"].notna()
    verdicts = np.select([fails, told], [REFUTED, HOLDS], INCONCLUSIVE)
    return table.assign(verdict=verdicts)
