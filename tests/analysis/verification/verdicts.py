"""Which of some checks fail."""

from dess.analysis.stats.verdict import HOLDS, REFUTED
from dess.analysis.verification.checks import Check, judge


def failing(checks: list[Check]) -> set[str]:
    """The tests that do not hold."""
    table = judge(checks)
    assert set(table["verdict"]) <= {HOLDS, REFUTED}
    return set(table.loc[table["verdict"] == REFUTED, "test"])


def fails(check: Check) -> bool:
    assert check.error is not None and check.p is None
    return check.error > check.bound
