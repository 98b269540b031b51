"""The page of a question says what its missions say."""

from pathlib import Path
from typing import Any

import pytest

from analysis import load_results, numbers
from analysis.names import METRICS, PRODUCT
from analysis.questions import what_if
from tests.analysis.small import write_scenario
from tests.reports.small import said_by

NAME = "what-if"
ASKED: dict[str, Any] = {
    "settings": {"uavs": 5, "pads": 2},
    "baseline": {"uavs": 2, "quota": 50},
    "policies": ["random", "greedy"],
    "missions": 12,
    "seed": 3,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("asked")


@pytest.fixture(scope="module")
def text(folder: Path) -> str:
    """What the page says, its missions flown into ``results``."""
    scenario = str(write_scenario(folder))
    return said_by(NAME, results=str(folder / "results"), scenario=scenario, **ASKED)


@pytest.fixture(scope="module")
def results(folder: Path, text: str) -> Any:
    (made,) = (folder / "results" / NAME).iterdir()
    return load_results(made)


def test_the_page_says_what_the_missions_say(text: str, results: Any) -> None:
    assert "What if a mission had `uavs` = 5 instead of 2 and `pads` = 2 instead of 6?" in text
    assert "with `quota` 50 in both" in text
    for answer in what_if.answers(results).itertuples():
        if answer.metric in METRICS:
            ends = (answer.difference, answer.low, answer.high)
            assert numbers.points(*ends) in text or 0 < answer.high - answer.low < 0.01
            assert numbers.percent(answer.before) in text and numbers.percent(answer.after) in text
        if answer.metric == PRODUCT:
            says = {
                what_if.HIGHER: f"is higher with {answer.policy}",
                what_if.LOWER: f"is lower with {answer.policy}",
                what_if.INCONCLUSIVE: f"cannot be told to differ with {answer.policy}",
            }
            given = what_if.verdict(answer)
            assert says.pop(given) in text
            assert not any(other in text for other in says.values())
            assert (f"{answer.policy} is undecided" in text) == (given == what_if.INCONCLUSIVE)
    assert "model card" not in text  # nobody of these has learned
    assert what_if.command(results) in text


def test_the_missions_shown_can_be_flown_again(text: str, results: Any) -> None:
    policy = what_if.best_policy(results, what_if.VARIATION)
    for replication in (what_if.typical(results, policy), what_if.worst(results, policy)):
        for point in (what_if.BASELINE, what_if.VARIATION):
            assert results.replay(policy, point, replication) in text
