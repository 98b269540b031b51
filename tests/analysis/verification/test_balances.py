"""Records agree with logs and with the other engine; whatever is changed in them is noticed."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given

from dess.analysis.results.tables import Results
from dess.analysis.verification import balances, draws, measurements
from dess.analysis.verification.measurements import CrossCheck, Log
from dess.mission import simulate
from dess.scenario import ScenarioSpace
from dess.state import sample_scenario
from tests.analysis.verification.changes import altered, with_records
from tests.analysis.verification.verdicts import fails
from tests.drawn import extended_spaces, policies, replications, seeds


@given(extended_spaces(), policies, seeds, replications)
def test_the_batteries_of_every_scenario_follow_the_rules(
    space: ScenarioSpace, policy: object, seed: int, replication: int
) -> None:
    """With wind, fleets, shared power and failures; a battery that is off by one is noticed."""
    record = simulate(space, policy, seed, replication, events=True)
    assert record.events is not None
    events = pd.DataFrame(record.events.columns())
    log = Log("", sample_scenario(space, seed, replication), None, pd.DataFrame(), events)
    assert not balances.battery_errors(log).any()
    (changed,) = altered([log], "move", -1, value=lambda value: value + 1)
    assert balances.battery_errors(changed).any()


def charging(logs: list[Log]) -> list[Log]:
    """The logs of missions with whole charging sessions, first."""
    return sorted(logs, key=lambda log: -(log.events["event"] == "charge_end").sum())


@pytest.mark.parametrize(
    ("field", "value"),
    [("charge_start", 0), ("zone", (0, 6, 2, 2)), ("charge_complete", 100)],
    ids=["begins too early", "outside the zone", "ends too early"],
)
def test_charging_that_breaks_a_rule_is_noticed(logs: list[Log], field: str, value: object) -> None:
    first, *rest = charging(logs)
    changed = replace(first, scenario=first.scenario.model_copy(update={field: value}))
    assert not fails(balances.battery_check([first, *rest]))
    assert fails(balances.battery_check([changed, *rest]))


def test_data_that_are_recorded_as_lost_are_no_imbalance(results: Results) -> None:
    lost = results.missions["collected"].where(results.missions.index == 3, 0.0) / 2
    missions = results.missions.assign(lost=lost)
    missions["collected"] -= lost
    assert not fails(balances.conservation_check({"trial": replace(results, missions=missions)}))
    missions["lost"] = 0.0
    assert fails(balances.conservation_check({"trial": replace(results, missions=missions)}))


@pytest.mark.parametrize("name", ["collected", "residual", "initial", "arrived"])
def test_data_that_come_from_nowhere_are_noticed(results: Results, name: str) -> None:
    changed = with_records(results, 3, **{name: lambda value: value + 1e-9})
    assert fails(balances.conservation_check({"sound": results, "trial": changed}))


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
        changed = replace(first, record=first.record.copy())
        changed.record[name] += 1
    assert fails(balances.record_check([changed, *rest]))


def test_policies_that_meet_different_missions_are_noticed(
    results: Results, logs: list[Log]
) -> None:
    elsewhere = altered(logs, "mission_start", 0, x=lambda x: x - 1)
    for changed, of_logs in (
        (with_records(results, 0, initial=lambda value: value + 1), logs),
        (with_records(results, 0, flying_time=lambda value: value + 1), logs),
        (results, elsewhere),
    ):
        parameters, arrivals = balances.realisation_checks(changed, of_logs)
        assert (fails(parameters), fails(arrivals)) == (of_logs is logs, of_logs is elsewhere)


def test_a_record_that_the_other_engine_does_not_leave_is_noticed(results: Results) -> None:
    """A mission is off by its last bit, and a UAV of another one by a percent of battery."""
    changed = with_records(results, 0, reward=lambda value: np.nextafter(value, np.inf))
    row = results.uavs.index[results.uavs["replication"] == results.missions["replication"].max()]
    uavs = results.uavs.copy()
    uavs.loc[row[0], "battery"] += 1
    again = measurements.simulate_missions(replace(changed, uavs=uavs), 3)
    check = balances.engine_check(changed, again)
    assert (check.n, check.error) == (6, 2)
    assert check.seen == "4 of 6 missions"
