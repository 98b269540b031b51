"""Tests of the table of prices."""

import pytest
from pydantic import ValidationError

from analysis import load_study
from analysis.results.manifest import Manifest
from analysis.study.costs import Costs


@pytest.mark.parametrize("field", ["uav", "pad", "charge", "hour", "lost_uav"])
def test_prices_below_zero_are_refused(field: str) -> None:
    with pytest.raises(ValidationError, match=field):
        Costs(**{field: -1.0, "slot_seconds": 60})


def test_hours_need_the_length_of_a_slot() -> None:
    with pytest.raises(ValidationError, match="slot_seconds"):
        Costs(hour=100)
    assert Costs(hour=100, slot_seconds=60).hour == 100


def test_prices_change_no_key_of_a_mission() -> None:
    free = Manifest.of(load_study("table4", missions=2, policies=["greedy"]))
    study = load_study("table4", missions=2, policies=["greedy"], costs={"uav": 20_000})
    assert Manifest.of(study).cells == free.cells


def test_a_manifest_without_prices_is_read() -> None:
    data = Manifest.of(load_study("table4", missions=2, policies=["greedy"])).data
    del data["study"]["costs"]
    assert Manifest.model_validate(data).study["costs"] is None
