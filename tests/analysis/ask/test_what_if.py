"""``analysis.what_if``: a question in one line, and what its answer offers."""

from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from analysis import what_if
from analysis.ask import what_if as answer
from analysis.ask.what_if import WhatIf
from dess import InputError
from tests.analysis.small import files_of, write_scenario

MISSIONS = 6
QUESTION: dict[str, Any] = {
    "settings": {"uavs": 6, "pads": 1},
    "baseline": {"uavs": 2},
    "policies": ["random", "greedy"],
    "missions": MISSIONS,
    "seed": 3,
}


def ask(folder: Path, **changes: Any) -> WhatIf:
    return what_if(scenario=write_scenario(folder), folder=folder / "results", **QUESTION | changes)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("asked")


@pytest.fixture(scope="module")
def asked(folder: Path) -> WhatIf:
    return ask(folder)


def test_the_answer_has_the_difference_of_every_policy(asked: WhatIf) -> None:
    table = asked.table()
    pd.testing.assert_frame_equal(table, answer.answers(asked.results))
    lines = asked.answer().splitlines()
    for line, policy in zip(lines, asked.results.policies, strict=False):
        assert line.startswith(f"- **{policy}**: product is")
    assert "in the variation" in lines[-1]
    assert asked._repr_markdown_() == asked.answer()  # what Jupyter shows


def test_examples_are_missions_of_the_best_policy_or_of_the_one_asked_for(
    folder: Path, asked: WhatIf
) -> None:
    assert asked.shown == answer.best_policy(asked.results, 1)
    shown = ask(folder, shown="random")
    typical = shown.typical()
    assert (typical.policy, typical.replication) == (
        "random",
        answer.typical(asked.results, "random"),
    )
    assert "**random**" in typical.effect() and len(typical.commands()) == 4
    before, after = typical.drawings()
    assert "Baseline (uavs 2, pads 6)" in before[2] and "Variation (uavs 6, pads 1)" in after[2]
    assert shown.worst().replication == answer.worst(asked.results, "random")


def test_another_variation_of_the_same_baseline_simulates_that_side_only(
    folder: Path, asked: WhatIf
) -> None:
    done: list[int] = []
    ask(folder, settings={"uavs": 3}, progress=done.append)
    of_a_side = 2 * MISSIONS  # two policies
    assert done[0] == of_a_side and sum(done) == 2 * of_a_side
    before = files_of(folder)
    done.clear()
    ask(folder, progress=done.append)
    assert done == [2 * of_a_side] and files_of(folder) == before


def test_a_policy_to_show_that_is_not_asked_about_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="shown: 'tour' is not asked about"):
        ask(tmp_path, shown="tour")
    assert [path.name for path in tmp_path.iterdir()] == ["small.toml"]


def test_a_question_that_would_take_too_much_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="4,000,000,000 missions to simulate .*--yes, or less"):
        ask(tmp_path, missions=10**9)
    assert "results" not in {path.name for path in tmp_path.iterdir()}
