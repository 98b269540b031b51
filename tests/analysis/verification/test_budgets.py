"""Data and batteries of logs and records balance; whatever is changed in them is noticed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis import load_results
from analysis.results.tables import Results
from analysis.verification import budgets
from analysis.verification.logs import Log
from tests.analysis.verification.changes import altered, with_records
from tests.analysis.verification.verdicts import fails


@pytest.mark.parametrize("by", [1, -1])
def test_a_battery_that_is_off_by_one_is_noticed(logs: list[Log], by: int) -> None:
    assert fails(budgets.battery_check(altered(logs, "move", 3, value=lambda value: value + by)))


def charging(logs: list[Log]) -> list[Log]:
    """The logs of missions with whole charging sessions, first."""
    return sorted(logs, key=lambda log: -(log.events["event"] == "charge_end").sum())


def test_charging_that_begins_too_early_is_noticed(logs: list[Log]) -> None:
    first, *rest = charging(logs)
    early = replace(first, scenario=first.scenario.model_copy(update={"charge_start": 0}))
    assert not fails(budgets.battery_check([first, *rest]))
    assert fails(budgets.battery_check([early, *rest]))


def test_charging_outside_the_zone_is_noticed(logs: list[Log]) -> None:
    first, *rest = charging(logs)
    elsewhere = replace(first, scenario=first.scenario.model_copy(update={"zone": (0, 6, 2, 2)}))
    assert fails(budgets.battery_check([elsewhere, *rest]))


def test_charging_that_ends_too_early_is_noticed(logs: list[Log]) -> None:
    first, *rest = charging(logs)
    fuller = first.scenario.charge_complete + 1
    longer = replace(first, scenario=first.scenario.model_copy(update={"charge_complete": fuller}))
    assert fails(budgets.battery_check([longer, *rest]))


@pytest.mark.parametrize("name", ["collected", "residual", "initial", "arrived"])
def test_data_that_come_from_nowhere_are_noticed(results: Results, name: str) -> None:
    changed = with_records(results, 3, **{name: lambda value: value + 1e-9})
    assert fails(budgets.conservation_check({"trial": changed}))
    assert fails(budgets.conservation_check({"sound": results, "trial": changed}))
    assert not fails(budgets.conservation_check({"sound": results}))


def test_rounding_of_a_single_sum_is_not_taken_for_a_loss(results: Results) -> None:
    changed = with_records(results, 3, collected=lambda value: np.nextafter(value, 2 * value))
    assert not fails(budgets.conservation_check({"trial": changed}))


def test_studies_in_a_folder_are_found_and_the_broken_ones_named(
    results: Results, tmp_path: Path
) -> None:
    for name in ("one", "two", "broken"):
        (tmp_path / name).mkdir()
        for entry in results.store.folder.iterdir():
            (tmp_path / name / entry.name).symlink_to(entry)
    (tmp_path / "broken" / "missions").unlink()
    (tmp_path / "no study").mkdir()
    found, damaged = budgets.studies_in(tmp_path, but="two")
    assert ([*found], damaged) == (["one"], ["broken"])
    assert found["one"].missions.equals(load_results(results.store.folder).missions)
