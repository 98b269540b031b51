"""Logs of a study: the longest of a replication; without any, checks are inconclusive."""

from analysis.results.tables import Results
from analysis.verification import budgets, channel, records
from analysis.verification import logs as event_logs
from analysis.verification.logs import Log


def test_without_logs_nothing_is_told(results: Results) -> None:
    checks = [
        *channel.communication_checks([], 7),
        budgets.balance_check([]),
        budgets.battery_check([]),
        records.record_check([]),
    ]
    assert {check.error for check in checks} == {None}
    assert event_logs.arrivals([], results.scenario()).shape == (0, len(results.scenario().nodes))


def test_of_every_replication_the_longest_log_is_taken(logs: list[Log]) -> None:
    kept = event_logs.longest(logs)
    assert [log.replication for log in kept] == list(range(8))
    for log in kept:
        others = [o.mission["slots"] for o in logs if o.replication == log.replication]
        assert log.mission["slots"] == max(others)
