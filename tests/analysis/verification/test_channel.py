"""Communications of logs agree with the formula; changed ones do not."""

import pandas as pd

from analysis.verification import balances, draws
from analysis.verification.measurements import Log
from tests.analysis.verification.changes import altered
from tests.analysis.verification.verdicts import fails


def test_the_logs_have_what_is_audited(logs: list[Log]) -> None:
    table = pd.concat([draws.communications(log, 7) for log in logs])
    assert (table["known"] == table["residual"]).any()  # nodes that were emptied
    assert (table["known"] < table["residual"]).any()
    assert any(log.uav_slots["charging"].any() for log in logs)
    assert any(log.uav_slots["waiting"].any() for log in logs)


def test_another_seed_has_other_shadowing(logs: list[Log]) -> None:
    assert all(map(fails, draws.communication_checks(logs, 8)))


def test_data_that_are_a_trifle_off_are_noticed(logs: list[Log]) -> None:
    changed = altered(logs, "communication", 5, value=lambda value: value * (1 + 1e-9))
    choice, amount = draws.communication_checks(changed, 7)
    assert fails(amount) and not fails(choice)
    assert fails(balances.balance_check(changed))


def test_another_node_is_noticed(logs: list[Log]) -> None:
    changed = altered(logs, "communication", 5, node=lambda node: (node + 1) % 3)
    choice, _ = draws.communication_checks(changed, 7)
    assert fails(choice)
    assert fails(balances.balance_check(changed))


def test_another_place_is_noticed(logs: list[Log]) -> None:
    changed = altered(logs, "communication", 0, x=lambda x: x + 1 / 6)
    assert any(map(fails, draws.communication_checks(changed, 7)))
