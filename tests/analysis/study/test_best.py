"""The best policy that a budget allows: dearer questions get a faster one, for the same reason."""

import pytest

from analysis.study import best
from analysis.study.best import BASELINE, SECONDS, policies_for
from dess import load_scenario
from policies.registry import names

ORDER = [*SECONDS]


def test_the_policies_exist_and_each_is_faster_than_the_one_before() -> None:
    assert set(ORDER) <= {*names()}
    assert [*SECONDS.values()] == sorted(SECONDS.values(), reverse=True)


def test_a_larger_question_never_has_a_slower_policy() -> None:
    space = load_scenario("bay")
    chosen = [policies_for([space], missions)[0] for missions in (1, 300, 3_000, 30_000, 10**8)]
    assert chosen[0] == ORDER[0]
    assert chosen[-1] == BASELINE
    assert [ORDER.index(name) for name in chosen] == sorted(ORDER.index(name) for name in chosen)
    twice = policies_for([space, space], 150)
    assert twice == policies_for([space], 300)  # settings count as missions do


def test_the_baseline_stands_beside_it_once() -> None:
    space = load_scenario("bay")
    assert policies_for([space], 1) == (ORDER[0], BASELINE)
    assert policies_for([space], 10**8) == (BASELINE,)


def test_without_its_library_a_learned_policy_gives_way(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(best, "SECONDS", {"any": 1e-9, BASELINE: 1e-9})
    space = load_scenario("bay")
    assert policies_for([space], 1) == ("any", BASELINE)
    monkeypatch.setattr(best, "missing", lambda extra, what: f"{what} needs {extra}")
    assert policies_for([space], 1) == (BASELINE,)
    assert "policy any needs learning; greedy answers" in caplog.text
