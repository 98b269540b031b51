"""The best policy that a budget allows: dearer questions get a faster one, for the same reason."""

from itertools import count

import numpy as np
import pytest

from analysis.study import best
from analysis.study.best import (
    BASELINE,
    OF_LARGE_FLEETS,
    OF_SMALL_FLEETS,
    SECONDS,
    policies_for,
)
from dess import load_scenario
from policies.registry import names

FASTER = [*SECONDS]


def test_the_policies_exist_and_each_is_faster_than_the_one_before() -> None:
    assert set(FASTER) <= {*names()}
    assert [*SECONDS.values()] == sorted(SECONDS.values(), reverse=True)
    assert {*OF_SMALL_FLEETS} == {*OF_LARGE_FLEETS} == {*SECONDS}


@pytest.mark.parametrize("uavs", [1, 5])
def test_a_larger_question_never_has_a_slower_policy(uavs: int) -> None:
    space = load_scenario("bay", uavs=uavs)
    sizes = np.geomspace(1, 1e8, 60).astype(int)
    chosen = [policies_for([space], int(missions))[0] for missions in sizes]
    assert chosen[0] == FASTER[0]
    assert chosen[-1] == BASELINE
    places = [FASTER.index(name) for name in chosen]
    assert places == sorted(places)
    assert ("planner-short" in chosen) == (uavs == 1)  # any is better for large fleets
    assert "any" in chosen
    twice = policies_for([space, space], 150)
    assert twice == policies_for([space], 300)  # settings count as missions do


def test_the_baseline_stands_beside_it_once() -> None:
    space = load_scenario("bay")
    assert policies_for([space], 1) == (FASTER[0], BASELINE)
    assert policies_for([space], 10**8) == (BASELINE,)


def test_without_its_library_a_learned_policy_gives_way(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    space = load_scenario("bay", uavs=5)
    missions = next(n for n in count(1000, 1000) if policies_for([space], n)[0] == "any")
    monkeypatch.setattr(best, "missing", lambda extra, what: f"{what} needs {extra}")
    assert policies_for([space], missions) == ("planner-short", BASELINE)
    assert "policy any needs learning; planner-short answers" in caplog.text
