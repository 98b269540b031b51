"""Which interval a metric has is decided once: all estimates follow another kind."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from dess.analysis.metric_ranges import metric_for_length
from dess.analysis.metrics import LEAST, PRODUCT, REWARD, SUCCESS, metric_of
from dess.analysis.stats import kinds
from dess.analysis.stats.groups import summary
from dess.analysis.stats.intervals import (
    Moments,
    column_intervals,
    interval_of,
    share_interval,
    stratified_interval,
)
from dess.analysis.stats.kinds import Skewed, StudentWithRare, Wilson, kind_of
from dess.analysis.study.stopping import running_interval

OUTCOMES = np.array([1.0] * 33 + [0.0] * 7)


class Percentiles:
    """The bootstrap of a share, of which the resampled successes are known to be binomial."""

    counts_missions = True

    def ends(self, sample, level):
        tails = (1 - level) / 2, (1 + level) / 2
        return tuple(stats.binom.ppf(tail, sample.n, sample.mean) / sample.n for tail in tails)


def intervals_of_outcomes() -> dict[str, list[float]]:
    """The ends of the same share by every path to an interval."""
    column = pd.DataFrame({"a": OUTCOMES})
    missions = pd.DataFrame({"uavs": 1, "replication": range(40), SUCCESS: OUTCOMES})
    missions = missions.assign(reward=0.0, **{"collection_ratio": 0.5, PRODUCT: 0.5})
    of_groups = summary(missions, by=[]).set_index("metric").loc[SUCCESS]
    halves = [Moments.of(OUTCOMES[:9]), Moments.of(OUTCOMES[9:])]
    means, widths = running_interval(SUCCESS, OUTCOMES)
    return {
        "values": [*interval_of(SUCCESS, OUTCOMES)[1:]],
        "moments": [*halves[0].with_others(halves[1]).interval(SUCCESS)[1:]],
        "columns": column_intervals(column, SUCCESS).loc["a", ["low", "high"]].tolist(),
        "points": [*stratified_interval(OUTCOMES[:, None], SUCCESS)[1:]],
        "groups": of_groups[["low", "high"]].tolist(),
        "running": [widths[-1]],
    }


def test_another_kind_for_a_metric_is_followed_by_all_paths(monkeypatch):
    before = intervals_of_outcomes()
    chosen = kinds.kind_of

    def kind(metric, mean=0.0, is_of_outcomes=False):
        if metric.column == SUCCESS and is_of_outcomes:
            return Percentiles()
        return chosen(metric, mean, is_of_outcomes)

    monkeypatch.setattr(kinds, "kind_of", kind)
    low, high = 28 / 40, 37 / 40
    assert stats.binom.ppf([0.025, 0.975], 40, 33 / 40).tolist() == [28, 37]
    for path, ends in intervals_of_outcomes().items():
        expected = [(high - low) / 2] if path == "running" else [low, high]
        assert ends == pytest.approx(expected), path
        assert ends != pytest.approx(before[path]), path


def test_all_paths_agree_on_a_share():
    _, low, high = share_interval(33, 40)
    for path, ends in intervals_of_outcomes().items():
        expected = [(high - low) / 2] if path == "running" else [low, high]
        assert ends == pytest.approx(expected, abs=1e-12), path


@pytest.mark.parametrize(
    ("metric", "is_of_outcomes", "kind"),
    [
        (metric_of(SUCCESS), True, Wilson),
        (metric_of(SUCCESS), False, StudentWithRare),
        (metric_of(PRODUCT), True, StudentWithRare),
        (metric_of(REWARD), False, StudentWithRare),
        (metric_of("age"), False, Skewed),
        (metric_for_length("age", 400, None), False, StudentWithRare),
        (replace(metric_of(LEAST), among=9), False, StudentWithRare),
    ],
)
def test_the_kind_follows_from_what_is_known_of_a_metric(metric, is_of_outcomes, kind):
    assert isinstance(kind_of(metric, 0.5, is_of_outcomes), kind)
