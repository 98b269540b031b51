"""Intervals of blocks hold the mean as often as they should, if missions are independent."""

import numpy as np

from analysis.stats.intervals import mean_interval, wilson
from analysis.verification import draws
from tests.analysis.verification.verdicts import failing


def test_blocks_have_the_intervals_of_their_missions() -> None:
    values = np.random.default_rng(12).uniform(size=45)
    table = draws.blocks(values, 10, share=False)
    assert len(table) == 4
    assert tuple(table.loc[1, ["mean", "low", "high"]]) == mean_interval(values[10:20])
    held = [low <= values[:40].mean() <= high for low, high in table[["low", "high"]].to_numpy()]
    assert table["holds"].tolist() == held
    successes = (values > 0.3).astype(int)
    ends = tuple(draws.blocks(successes, 10, share=True).loc[0, ["mean", "low", "high"]])
    assert ends == wilson(successes[:10].sum(), 10)


def covered(values: np.ndarray, share: bool) -> set[str]:
    return failing([draws.coverage_check("metric", values, 100, share)])


def test_intervals_of_independent_missions_cover_as_often_as_they_promise() -> None:
    generator = np.random.default_rng(13)
    assert not covered(generator.beta(8, 2, 20_000), share=False)
    for p in (0.6, 0.97, 0.9995):  # here Wilson covers more or less often than 95 %
        assert not covered((generator.random(20_000) < p).astype(int), share=True)


def test_missions_that_depend_on_each_other_are_covered_too_rarely() -> None:
    generator = np.random.default_rng(14)
    shifts = np.repeat(generator.normal(size=200), 100)
    assert covered(shifts + generator.normal(size=20_000), share=False)
    assert covered((generator.random(20_000) < np.where(shifts > 0, 0.9, 0.7)).astype(int), True)


def test_nothing_to_cover_tells_nothing() -> None:
    for values in (np.ones(20_000), np.random.default_rng(17).uniform(size=150)):
        check = draws.coverage_check("metric", values, 100, share=False)
        assert check.p is None and check.error is None
