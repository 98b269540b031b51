from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from dess.analysis import run_study
from dess.analysis.answers.decided import reached_precisions
from dess.analysis.metric_ranges import metric_for_length
from dess.analysis.metrics import LEAST, METRICS, OLDEST, metric_group, metric_of
from dess.analysis.stats.groups import summary
from dess.analysis.stats.intervals import interval_of, share_interval
from dess.analysis.stats.worst_node import worst_of_nodes
from dess.analysis.study.stopping import Precision, running_interval, running_interval_of_worst
from tests.analysis.small import SHEET, small_study


def rule(**fields):
    return Precision.model_validate({"first": 2, "look_ahead": 0} | fields)


def finished(rule, data):
    """The samples with which the rule is content, from one that begins with ``first`` missions."""
    count = rule.first
    while True:
        samples = [{metric: values[:count] for metric, values in data.items()}]
        (wanted,) = rule.wanted(samples)
        if wanted == count:
            return samples
        count = wanted


def reached(rule, **data):
    """The only row, and the number of missions."""
    samples = finished(rule, {metric: np.array(values) for metric, values in data.items()})
    (row,) = rule.reached(samples)
    return row


def slow_stop(rule, data):
    """The definition of the stopping point, word for word."""

    def holds(n):
        for metric, target in rule.targets.items():
            values = data[metric][:n]
            share = metric_of(metric).is_outcome
            interval = share_interval(values.sum(), n) if share else interval_of(metric, values)
            half = (interval.high - interval.low) / 2
            if n == 1 and not share:
                return False
            relative = target.relative is not None and half <= target.relative * abs(interval.mean)
            if not relative and (target.absolute is None or half > target.absolute):
                return False
        return True

    held = [holds(n) for n in range(1, rule.budget + 1)]
    for n in range(rule.first, rule.budget - rule.look_ahead + 1):
        if all(held[n - 1 : n + rule.look_ahead]):
            return n
    return None


def test_missions_that_measure_nothing_are_left_out_of_running_intervals():
    values = np.array([np.nan, 3.0, np.nan, 5.0, 4.0])
    means, widths = running_interval("waiting", values)
    own_means, own_widths = running_interval("waiting", values[[1, 3, 4]])
    assert means[[1, 2, 3, 4]].tolist() == own_means[[0, 0, 1, 2]].tolist()
    assert widths.tolist() == [np.inf, *own_widths[[0, 0, 1, 2]]]


@pytest.mark.parametrize("column", [LEAST, OLDEST])
def test_running_intervals_of_the_worst_node_are_those_of_the_statistics(column):
    """The worst node, and the one with the worst end, change from one number to the next."""
    metric = replace(metric_for_length(column, 400, None), among=6)
    spread = np.linspace(0.5, 8, 6)
    values = np.random.default_rng(6).beta(spread, spread, (300, 6)) * metric.range[1]
    means, widths = running_interval_of_worst(metric, values)
    own = values.argmax(axis=1) if metric.less_is_better else values.argmin(axis=1)
    assert len({*own}) == 6
    for n in (1, 2, 3, 10, 40, 300):
        found = interval_of(metric, worst_of_nodes(values[:n], metric))
        half = (found.high - found.low) / 2 if metric.is_bounded or n > 1 else np.inf
        assert (means[n - 1], widths[n - 1]) == pytest.approx((found.mean, half), rel=1e-9)


def test_a_target_of_the_worst_node_is_met_at_the_interval_that_is_printed(tmp_path):
    rule = {"first": 5, "look_ahead": 3, "budget": 400, "targets": {"least": {"absolute": 0.06}}}
    study = small_study(tmp_path, precision=rule, policies=["greedy"], set={**SHEET, "uavs": 2})
    results = run_study(study, tmp_path / "out")
    (row,) = reached_precisions(results).itertuples()
    (printed,) = summary(results.missions).query("metric == 'least'").itertuples()
    assert row.met and row.stop + 3 == row.missions == len(results.missions) < 400
    assert row.mean == pytest.approx(printed.mean)
    assert row.half_width == pytest.approx((printed.high - printed.low) / 2)
    assert 0.03 < row.half_width <= row.target == 0.06


@pytest.mark.parametrize("metric", metric_group("paper", "reward"))
def test_running_intervals_are_those_of_the_statistics(metric):
    generator = np.random.default_rng(1)
    share = metric_of(metric).is_outcome
    values = generator.integers(0, 2, 300) if share else 1e6 + generator.normal(size=300)
    values = generator.beta(8, 2, 300) if metric_of(metric).kind == "share" else values
    means, widths = running_interval(metric, values)
    for n in (1, 2, 3, 10, 300):
        sample = values[:n]
        interval = interval_of(metric, sample)
        half = (interval.high - interval.low) / 2 if metric in METRICS or n > 1 else np.inf
        assert (means[n - 1], widths[n - 1]) == pytest.approx((interval.mean, half), rel=1e-9)


def test_a_negative_mean_is_as_hard_as_its_mirror_image():
    # half-width / mean would be negative, and "met" from the start
    values = np.random.default_rng(2).normal(100.0, 40.0, 2000)
    relative = rule(first=3, targets={"reward": {"relative": 0.05}})
    up, down = reached(relative, reward=values), reached(relative, reward=-values)
    assert down.stop == up.stop > 100
    assert 0 < down.half_width <= down.target == pytest.approx(0.05 * abs(down.mean))


def test_a_mean_of_zero_meets_no_relative_target():
    relative = rule(budget=400, targets={"reward": {"relative": 0.5}})
    row = reached(relative, reward=[1.0, -1.0] * 300)
    assert (row.missions, row.stop, row.met, row.target) == (400, None, False, 0.0)
    # Certain, as far as it shows.
    relative = rule(budget=400, targets={"queue": {"relative": 0.5}})
    assert reached(relative, queue=[0.0] * 300).missions == 2


def test_where_the_budget_ends_it_says_what_was_missed():
    generator = np.random.default_rng(5)
    data = {"success": generator.random(900) < 0.5, "reward": generator.normal(size=900)}
    targets = {"success": {"absolute": 0.01}, "reward": {"absolute": 8.0}}
    narrow = rule(first=30, look_ahead=10, budget=200, targets=targets)
    success, reward = narrow.reached(finished(narrow, data))
    assert success.missions == reward.missions == narrow.budget
    assert success.stop is reward.stop is None
    assert (success.met, reward.met) == (False, True)
    assert success.half_width > success.target


@pytest.mark.parametrize("seed", range(8))
def test_the_stopping_point_is_the_one_of_the_definition(seed):
    generator = np.random.default_rng(seed)
    look_ahead = int(generator.integers(0, 20))
    data = {"reward": generator.exponential(size=300), "success": generator.random(300) < 0.8}
    targets = {"reward": {"relative": 0.25, "absolute": 0.2}, "success": {"absolute": 0.08}}
    cautious = rule(first=5, look_ahead=look_ahead, budget=300, targets=targets)
    samples = finished(cautious, data)
    stop = cautious.reached(samples)[0].stop
    assert stop == slow_stop(cautious, data)
    assert len(samples[0]["reward"]) == (300 if stop is None else stop + look_ahead)


@pytest.mark.parametrize(
    "fields, complaint",
    [
        ({"targets": {"speed": {"absolute": 1.0}}}, "'speed' is unknown"),
        ({"targets": {"reward": {}}}, "allowed: absolute, relative, or both"),
        ({"targets": {"reward": {"relative": float("inf")}}}, "finite"),
        (
            {"targets": {"reward": {"absolute": 1.0}}, "first": 30, "look_ahead": 50, "budget": 79},
            "allowed: 80 or more",
        ),
    ],
)
def test_what_makes_no_sense_is_refused(fields, complaint):
    with pytest.raises(ValidationError, match=complaint):
        Precision.model_validate(fields)
