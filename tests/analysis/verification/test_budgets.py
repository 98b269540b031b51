"""Data and batteries of logs and records balance; whatever is changed in them is noticed."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given

from analysis.results.tables import Results
from analysis.verification import balances
from analysis.verification.measurements import Log
from dess.mission import simulate
from dess.scenario import ScenarioSpace
from dess.state import sample_scenario
from tests.analysis.verification.changes import altered, with_records
from tests.analysis.verification.verdicts import fails
from tests.drawn import extended_spaces, policies, replications, seeds


@pytest.mark.parametrize("by", [1, -1])
def test_a_battery_that_is_off_by_one_is_noticed(logs: list[Log], by: int) -> None:
    assert fails(balances.battery_check(altered(logs, "move", 3, value=lambda value: value + by)))


@given(extended_spaces(), policies, seeds, replications)
def test_the_batteries_of_every_scenario_follow_the_rules(
    space: ScenarioSpace, policy: object, seed: int, replication: int
) -> None:
    """With wind, fleets, shared power and failures; a battery that is off by one is noticed."""
    record = simulate(space, policy, seed, replication, events=True)
    assert record.events is not None
    events = pd.DataFrame(record.events.columns())
    log = Log("", sample_scenario(space, seed, replication), pd.Series(), pd.DataFrame(), events)
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
    assert fails(balances.conservation_check({"trial": changed}))
    assert fails(balances.conservation_check({"sound": results, "trial": changed}))
    assert not fails(balances.conservation_check({"sound": results}))


def test_rounding_of_a_single_sum_is_not_taken_for_a_loss(results: Results) -> None:
    changed = with_records(results, 3, collected=lambda value: np.nextafter(value, 2 * value))
    assert not fails(balances.conservation_check({"trial": changed}))
