"""Logs of a study: the longest of a replication; without any, checks are inconclusive."""

from analysis.results.tables import Results
from analysis.verification import balances, draws, measurements
from analysis.verification.measurements import Log


def test_without_logs_nothing_is_told(results: Results) -> None:
    checks = [
        *draws.communication_checks([], 7),
        balances.balance_check([]),
        balances.battery_check([]),
        balances.record_check([]),
    ]
    assert {check.error for check in checks} == {None}
    assert measurements.arrivals([], results.scenario()).shape == (0, len(results.scenario().nodes))


def test_of_every_replication_the_longest_log_is_taken(logs: list[Log]) -> None:
    kept = measurements.longest(logs)
    assert [log.replication for log in kept] == list(range(8))
    for log in kept:
        others = [o.mission["slots"] for o in logs if o.replication == log.replication]
        assert log.mission["slots"] == max(others)
