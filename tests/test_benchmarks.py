"""The benchmarks name what is slower, against the floor of the same run, than recorded."""

from benchmarks.conftest import RATIOS, losses


def test_lost_speed_is_named_with_both_ratios():
    name, recorded = "test_batch_engine_free_policy", RATIOS["test_batch_engine_free_policy"]
    speeds = {"test_floor": 5e6, name: 5e6 / recorded}
    assert losses(speeds) == []
    [line] = losses(speeds | {name: 5e6 / (1.4 * recorded)})
    assert line.startswith(name)
    assert f"{1.4 * recorded:.2f} x the floor's time, recorded are {recorded:.2f} x" in line


def test_without_the_floor_nothing_is_compared():
    assert losses(dict.fromkeys(RATIOS, 1.0)) == []
