"""Whether trainings with transfer learning overtake those without it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers.training.curves import (
    LEARNED_PRODUCT,
    LEARNED_REWARD,
    SHOWN,
    last_phase,
    pairs_in,
    plot_trainings,
    smooth_curves,
)
from dess.analysis.answers.training.variants import difference_of_trainings
from dess.analysis.figures import Drawing
from dess.analysis.stats.intervals import Interval
from dess.analysis.stats.verdict import INCONCLUSIVE, judge_parts, verdict_above

_SIDES = ("with transfer", "without")
# Level of the intervals of the paper's Fig. 3.
BAND_LEVEL = 0.99


@dataclass(frozen=True)
class Transfer:
    """How trainings with transfer learning compare with those without it.

    Attributes:
        verdict: Of ``verdicts``, whether the mean curve with transfer ends above, by the interval
            of the last difference; ``INCONCLUSIVE`` if the trainings are too short.
        since: The training step from which on the mean curve stays above; None if it ends below.
        throughout: Whether that is the first step that both have.
        last: Difference of the curves at the last step, with its interval.
        length: The last step that both reach.
        trainings: Numbers of trainings with and without transfer.
    """

    verdict: str
    since: int | None
    throughout: bool
    last: Interval
    length: int
    trainings: tuple[int, int]

    @property
    def course(self) -> str:
        """Where the mean curve with transfer is above, in words."""
        if self.since is None:
            return "ends below, or level"
        if self.throughout:
            where = "in all of phase II"
        else:
            where = f"from step {self.since:,} on"
        return f"is above {where}"


def transfer_drawings(curves: pd.DataFrame) -> list[Drawing]:
    """Trainings with transfer learning and without it, as in Fig. 3: the first and the last pair.

    Args:
        curves: Rows of ``read_curves``.
    """
    pairs = pairs_in(curves)
    return [
        Drawing(
            plot_trainings(curves, metric, dict(zip(pairs[name], _SIDES, strict=True))),
            f"{SHOWN[metric]} against training step, {name}, with and without transfer",
            f"Trainings with {name}.",
            smooth_curves(curves[curves["variant"].isin(pairs[name])], metric),
        )
        for name in dict.fromkeys([[*pairs][0], [*pairs][-1]])
        for metric in SHOWN
    ]


def compare_transfer(averages: pd.DataFrame, using: str, without: str, shortest: int) -> Transfer:
    """Whether a variant with transfer learning overtakes the one without it and ends higher.

    They are compared in the last phase of both, in which both train in missions with battery
    decrease.

    Args:
        averages: Rows of ``smooth_curves``.
        using: The variant with transfer learning.
        without: The variant without it.
        shortest: Trainings of fewer steps are inconclusive.
    """
    a, b = (last_phase(averages, variant) for variant in (using, without))
    steps = a.index.intersection(b.index)
    lead = a.loc[steps].mean(axis=1) - b.loc[steps].mean(axis=1)
    behind = np.flatnonzero(lead <= 0)
    first = behind[-1] + 1 if len(behind) else 0
    since = None
    if first < len(steps):
        since = int(steps[first])
    last = difference_of_trainings(
        a.loc[steps[-1]].to_numpy(), b.loc[steps[-1]].to_numpy(), BAND_LEVEL
    )[0]
    length = int(steps[-1])
    if length >= shortest:
        verdict = judge_parts(verdict_above(last))
    else:
        verdict = INCONCLUSIVE
    return Transfer(verdict, since, not len(behind), last, length, (a.shape[1], b.shape[1]))


def compare_all_transfers(
    curves: pd.DataFrame, metrics: Iterable[str], shortest: int
) -> dict[tuple[str, str], Transfer]:
    """``compare_transfer`` of all pairs of variants, by the name of the pair and the metric."""
    averages = {metric: smooth_curves(curves, metric) for metric in metrics}
    return {
        (name, metric): compare_transfer(averages[metric], *pair, shortest)
        for name, pair in pairs_in(curves).items()
        for metric in averages
    }


def transfer_table(
    transfers: Mapping[tuple[str, str], Transfer], verdicts: Mapping[tuple[str, str], str]
) -> pd.DataFrame:
    """Trainings with transfer learning compared with those without, as a table of text.

    Args:
        transfers: The result of ``compare_all_transfers``, by the name of the pair and the metric.
        verdicts: The verdict on each.
    """
    rows = []
    for (name, metric), compared in transfers.items():
        last = compared.last
        if metric == LEARNED_REWARD:
            named = "Reward"
        else:
            named = "Product"
        if metric == LEARNED_PRODUCT:
            difference_at_end = numbers.format_points(*last)
        else:
            difference_at_end = _format_rewards(*last)
        if last.low == last.high:
            difference_at_end = f"{difference_at_end.split()[0]}, the same in all trainings"
        n = "{} and {}".format(*compared.trainings)
        cells = named, verdicts[name, metric], compared.course, difference_at_end
        rows.append((name[0].upper() + name[1:], n, *cells))
    head = ["Trainings with", "n", "Metric", "Verdict", "With transfer, the mean curve"]
    return pd.DataFrame(rows, columns=[*head, "Difference at the end"])


def _format_rewards(*ends: float) -> str:
    return numbers.with_ends(lambda value: numbers.format_signed(value, "+.0f"), *ends)
