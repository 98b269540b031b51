"""Records agree with logs and with the other engine; whatever is changed in them is noticed."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.results.tables import Results
from analysis.verification import balances, draws, measurements
from analysis.verification.measurements import CrossCheck, Log
from tests.analysis.verification.changes import altered, with_records
from tests.analysis.verification.verdicts import fails


def test_what_the_simulator_leaves_passes(
    results: Results, logs: list[Log], again: CrossCheck
) -> None:
    seed = results.manifest["seed"]
    checks = [
        *draws.communication_checks(logs, seed),
        balances.conservation_check({"trial": results}),
        balances.balance_check(logs),
        balances.battery_check(logs),
        balances.record_check(logs),
        *balances.realisation_checks(results, logs),
        balances.engine_check(results, again),
    ]
    assert not any(map(fails, checks))
    assert all(check.n > 0 for check in checks)


def test_an_arrival_that_is_lost_is_noticed(results: Results, logs: list[Log]) -> None:
    longest = measurements.longest(logs)
    log = next(log for log in logs if log not in longest and log.arrivals.any())
    row = log.events.index[log.events["event"] == "arrival"][0]
    lossy = replace(log, events=log.events.drop(index=row))
    changed = [lossy if other is log else other for other in logs]
    assert fails(balances.balance_check(changed))
    assert fails(balances.record_check(changed))
    assert fails(balances.realisation_checks(results, changed)[1])


OF_MISSION = ["slots", "uav_slots", "arrived", "initial", "collected"]


@pytest.mark.parametrize("name", [*OF_MISSION, "quota", "battery", "slots_charging"])
def test_a_record_that_its_log_does_not_add_up_to_is_noticed(logs: list[Log], name: str) -> None:
    first, *rest = logs
    changed = replace(first, uavs=first.uavs.assign(**{name: first.uavs.get(name, 0) + 1}))
    if name in OF_MISSION:
        changed = replace(first, mission=first.mission.copy())
        changed.mission[name] += 1
    assert fails(balances.record_check([changed, *rest]))


@pytest.mark.parametrize("name", ["initial", "flying_time"])
def test_policies_that_meet_different_missions_are_noticed(
    results: Results, logs: list[Log], name: str
) -> None:
    parameters, arrivals = balances.realisation_checks(
        with_records(results, 0, **{name: lambda value: value + 1}), logs
    )
    assert fails(parameters) and not fails(arrivals)


def test_a_uav_that_starts_elsewhere_is_noticed(results: Results, logs: list[Log]) -> None:
    changed = altered(logs, "mission_start", 0, x=lambda x: x - 1)
    assert fails(balances.realisation_checks(results, changed)[1])


@pytest.mark.parametrize("name", ["collected", "reward", "residual"])
def test_a_record_that_is_off_by_its_last_bit_is_noticed(
    results: Results, again: CrossCheck, name: str
) -> None:
    changed = with_records(results, 0, **{name: lambda value: np.nextafter(value, np.inf)})
    check = balances.engine_check(changed, again)
    assert (check.n, check.error) == (6, 1)
    assert check.seen == "5 of 6 missions"


def test_a_uav_that_the_other_engine_does_not_leave_is_noticed(
    results: Results, again: CrossCheck
) -> None:
    uavs = results.uavs.copy()
    uavs.loc[0, "battery"] += 1
    assert balances.engine_check(replace(results, uavs=uavs), again).error == 1
