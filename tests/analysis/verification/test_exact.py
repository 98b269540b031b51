"""Records and logs of both engines pass the audits; whatever is changed in them is noticed."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from analysis import load_results, run_study
from analysis.results.tables import Results
from analysis.verification import exact
from analysis.verification.checks import Check
from analysis.verification.exact import Log
from tests.analysis.small import small_study

# Two groups of communication slots, a queue for one pad, all nodes emptied now and then.
CHANGES: dict[str, Any] = {"communication_slots": 6, "pads": 1, "initial_data": [0, 2], "quota": 90}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    folder = tmp_path_factory.mktemp("results")
    return run_study(small_study(folder, logged=8, set=CHANGES), folder / "out")


@pytest.fixture(scope="module")
def logs(results: Results) -> list[Log]:
    return exact.logs_of(results)


def fails(check: Check) -> bool:
    assert check.error is not None and check.p is None
    return check.error > check.bound


def altered(logs: list[Log], event: str, which: int = 0, **columns: Any) -> list[Log]:
    """The logs with one event of the first changed; of a function, what it makes of the value."""
    events = logs[0].events.copy()
    row = events.index[events["event"] == event][which]
    for name, value in columns.items():
        events.loc[row, name] = value(events.loc[row, name]) if callable(value) else value
    return [replace(logs[0], events=events), *logs[1:]]


def with_records(results: Results, row: int, **values: Any) -> Results:
    """The results with one record changed."""
    missions = results.missions.copy()
    for name, value in values.items():
        missions.loc[row, name] = value(missions.loc[row, name])
    return replace(results, missions=missions)


def test_what_the_simulator_leaves_passes(results: Results, logs: list[Log]) -> None:
    seed = results.manifest["seed"]
    checks = [
        *exact.channel_checks(logs, seed),
        exact.conservation_check({"trial": results}),
        exact.balance_check(logs),
        exact.battery_check(logs),
        exact.record_check(logs),
        *exact.sea_checks(results, logs),
        exact.engine_check(results, 4),
    ]
    assert not any(map(fails, checks))
    assert all(check.n > 0 for check in checks)


def test_the_logs_have_what_is_audited(logs: list[Log]) -> None:
    table = pd.concat([exact.communications(log, 7) for log in logs])
    assert (table["known"] == table["residual"]).any()  # nodes that were emptied
    assert (table["known"] < table["residual"]).any()
    assert any(log.uav_slots["charging"].any() for log in logs)
    assert any(log.uav_slots["waiting"].any() for log in logs)


def test_another_seed_has_other_shadowing(logs: list[Log]) -> None:
    assert all(map(fails, exact.channel_checks(logs, 8)))


def test_data_that_are_a_trifle_off_are_noticed(logs: list[Log]) -> None:
    changed = altered(logs, "communication", 5, value=lambda value: value * (1 + 1e-9))
    choice, amount = exact.channel_checks(changed, 7)
    assert fails(amount) and not fails(choice)
    assert fails(exact.balance_check(changed))


def test_another_node_is_noticed(logs: list[Log]) -> None:
    changed = altered(logs, "communication", 5, node=lambda node: (node + 1) % 3)
    choice, _ = exact.channel_checks(changed, 7)
    assert fails(choice)
    assert fails(exact.balance_check(changed))


def test_another_place_is_noticed(logs: list[Log]) -> None:
    changed = altered(logs, "communication", 0, x=lambda x: x + 1 / 6)
    assert any(map(fails, exact.channel_checks(changed, 7)))


def test_an_arrival_that_is_lost_is_noticed(results: Results, logs: list[Log]) -> None:
    longest = exact.longest(logs)
    log = next(log for log in logs if log not in longest and log.arrivals.any())
    row = log.events.index[log.events["event"] == "arrival"][0]
    lossy = replace(log, events=log.events.drop(index=row))
    changed = [lossy if each is log else each for each in logs]
    assert fails(exact.balance_check(changed))
    assert fails(exact.record_check(changed))
    assert fails(exact.sea_checks(results, changed)[1])


@pytest.mark.parametrize("by", [1, -1])
def test_a_battery_that_is_off_by_one_is_noticed(logs: list[Log], by: int) -> None:
    assert fails(exact.battery_check(altered(logs, "move", 3, value=lambda value: value + by)))


def charging(logs: list[Log]) -> list[Log]:
    """The logs of missions with whole charging sessions, first."""
    return sorted(logs, key=lambda log: -(log.events["event"] == "charge_end").sum())


def test_charging_that_begins_too_early_is_noticed(logs: list[Log]) -> None:
    first, *rest = charging(logs)
    early = replace(first, scenario=first.scenario.model_copy(update={"charge_start": 0}))
    assert not fails(exact.battery_check([first, *rest]))
    assert fails(exact.battery_check([early, *rest]))


def test_charging_outside_the_zone_is_noticed(logs: list[Log]) -> None:
    first, *rest = charging(logs)
    elsewhere = replace(first, scenario=first.scenario.model_copy(update={"zone": (0, 6, 2, 2)}))
    assert fails(exact.battery_check([elsewhere, *rest]))


def test_charging_that_ends_too_early_is_noticed(logs: list[Log]) -> None:
    first, *rest = charging(logs)
    fuller = first.scenario.charge_complete + 1
    longer = replace(first, scenario=first.scenario.model_copy(update={"charge_complete": fuller}))
    assert fails(exact.battery_check([longer, *rest]))


@pytest.mark.parametrize("name", ["slots", "uav_slots", "arrived", "initial", "collected"])
def test_a_record_that_its_log_does_not_add_up_to_is_noticed(logs: list[Log], name: str) -> None:
    mission = logs[0].mission.copy()
    mission[name] += 1
    assert fails(exact.record_check([replace(logs[0], mission=mission), *logs[1:]]))


@pytest.mark.parametrize("name", ["quota", "battery", "slots_charging", "collected"])
def test_a_uav_that_its_log_does_not_add_up_to_is_noticed(logs: list[Log], name: str) -> None:
    uavs = logs[0].uavs.assign(**{name: logs[0].uavs[name] + 1})
    assert fails(exact.record_check([replace(logs[0], uavs=uavs), *logs[1:]]))


@pytest.mark.parametrize("name", ["collected", "residual", "initial", "arrived"])
def test_data_that_come_from_nowhere_are_noticed(results: Results, name: str) -> None:
    changed = with_records(results, 3, **{name: lambda value: value + 1e-9})
    assert fails(exact.conservation_check({"trial": changed}))
    assert fails(exact.conservation_check({"sound": results, "trial": changed}))
    assert not fails(exact.conservation_check({"sound": results}))


def test_rounding_of_a_single_sum_is_not_taken_for_a_loss(results: Results) -> None:
    changed = with_records(results, 3, collected=lambda value: np.nextafter(value, 2 * value))
    assert not fails(exact.conservation_check({"trial": changed}))


@pytest.mark.parametrize("name", ["initial", "flying_time"])
def test_policies_that_meet_different_missions_are_noticed(
    results: Results, logs: list[Log], name: str
) -> None:
    parameters, arrivals = exact.sea_checks(
        with_records(results, 0, **{name: lambda value: value + 1}), logs
    )
    assert fails(parameters) and not fails(arrivals)


def test_a_uav_that_starts_elsewhere_is_noticed(results: Results, logs: list[Log]) -> None:
    changed = altered(logs, "mission_start", 0, x=lambda x: x - 1)
    assert fails(exact.sea_checks(results, changed)[1])


def test_a_single_policy_has_no_sea_to_share(results: Results, tmp_path: Path) -> None:
    alone = run_study(small_study(tmp_path, policies=["greedy"], missions=3), tmp_path / "out")
    assert not exact.sea_checks(alone, [])


@pytest.mark.parametrize("name", ["collected", "reward", "residual"])
def test_a_record_that_is_off_by_its_last_bit_is_noticed(results: Results, name: str) -> None:
    changed = with_records(results, 0, **{name: lambda value: np.nextafter(value, np.inf)})
    check = exact.engine_check(changed, 3)
    assert (check.n, check.error) == (6, 1)
    assert check.seen == "5 of 6 missions"


def test_a_uav_that_the_other_engine_does_not_leave_is_noticed(results: Results) -> None:
    uavs = results.uavs.copy()
    uavs.loc[0, "battery"] += 1
    assert exact.engine_check(replace(results, uavs=uavs), 3).error == 1


def test_more_missions_than_there_are_are_flown_once(results: Results) -> None:
    assert exact.engine_check(results, 100).n == len(results.missions)


def test_without_logs_nothing_is_told(results: Results) -> None:
    checks = [
        *exact.channel_checks([], 7),
        exact.balance_check([]),
        exact.battery_check([]),
        exact.record_check([]),
    ]
    assert {check.error for check in checks} == {None}
    assert exact.arrivals([], results.scenario()).shape == (0, len(results.scenario().nodes))


def test_of_every_replication_the_longest_log_is_taken(logs: list[Log]) -> None:
    kept = exact.longest(logs)
    assert [log.replication for log in kept] == list(range(8))
    for log in kept:
        others = [o.mission["slots"] for o in logs if o.replication == log.replication]
        assert log.mission["slots"] == max(others)


def test_studies_in_a_folder_are_found_and_the_broken_ones_named(
    results: Results, tmp_path: Path
) -> None:
    for name in ("one", "two", "broken"):
        (tmp_path / name).mkdir()
        for entry in results.store.folder.iterdir():
            (tmp_path / name / entry.name).symlink_to(entry)
    (tmp_path / "broken" / "missions").unlink()
    (tmp_path / "no study").mkdir()
    found, damaged = exact.studies_in(tmp_path, but="two")
    assert ([*found], damaged) == (["one"], ["broken"])
    assert found["one"].missions.equals(load_results(results.store.folder).missions)
