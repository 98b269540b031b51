"""``analysis.what_if``: simulate what a variation of a scenario changes, in one line.

asked = what_if({"uavs": 5}, baseline={"uavs": 3})
asked.answer()             # in words, with intervals
asked.table()              # the same as a tidy table
asked.plot()               # as a figure
asked.typical().drawings()  # a mission in the baseline and in the variation
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from analysis.execution.jobs import Progress
from analysis.names import PRODUCT
from analysis.questions.what_if import answer, question
from analysis.questions.what_if.question import BASELINE, VARIATION
from analysis.results.resimulate import resimulate
from analysis.results.tables import Results

if TYPE_CHECKING:  # figures need the extra reports
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Example:
    """A replication of a policy in the baseline and in the variation.

    Attributes:
        results: The results of the question.
        policy: The policy.
        replication: The replication.
    """

    results: Results
    policy: str
    replication: int

    def effect(self) -> str:
        """By how much the variation changes the mission, in a sentence of Markdown."""
        return answer.effect(self.results, self.policy, self.replication)

    def commands(self) -> list[str]:
        """The commands that simulate both missions again."""
        return answer.commands(self.results, self.policy, self.replication)

    def drawings(self) -> "list[tuple[Figure, str, str]]":
        """The two missions, simulated again: a figure, its alternative text and caption each."""
        return [self._drawing(point) for point in (BASELINE, VARIATION)]

    def _drawing(self, point: int) -> "tuple[Figure, str, str]":
        from analysis.figures.missions import mission_figure

        mission = resimulate(self.results, self.policy, point, self.replication)
        figure = mission_figure(mission.events, mission.scenario)
        outcome = answer.outcome(self.results, self.policy, point, self.replication)
        alt = "Map of the mission; battery, residual data and charging"
        return figure, alt, f"{outcome} n = 1."


@dataclass(frozen=True, eq=False)
class WhatIf:
    """A what-if question and its answer.

    Attributes:
        results: The results of the question; ``results.missions`` is a tidy table of the missions.
        shown: The policy of ``typical`` and ``worst``.
    """

    results: Results
    shown: str

    def answer(self) -> str:
        """The paired differences in product, in words (Markdown)."""
        before, after = (answer.best_of_side(self.results, p) for p in (BASELINE, VARIATION))
        return (
            f"{answer.conclusions(self.table())}\n\n"
            f"The highest mean: in the baseline {before}; in the variation {after}."
        )

    def sentence(self) -> str:
        """What the variation changes, in a sentence."""
        return answer.sentence(self.results, self.table())

    def _repr_markdown_(self) -> str:
        return self.answer()

    def table(self) -> pd.DataFrame:
        """The paired differences, with a row per policy and metric, as ``answer.answers``."""
        return answer.answers(self.results)

    def plot(self) -> "Figure":
        """The paired differences of the metrics, with intervals."""
        from analysis.figures import comparison as figures

        return figures.gains(self.table())

    def plot_means(self, metric: str = PRODUCT) -> "Figure":
        """A metric of every policy in the baseline and in the variation, with intervals.

        Args:
            metric: One of the paper's metrics, or of what the missions measured.
        """
        from analysis.figures import comparison as figures

        sides = question.settings_of(self.results)
        return figures.means(answer.means(self.results), metric, sides)

    def plot_spread(self) -> "Figure":
        """The distribution of the paired differences in product."""
        from analysis.figures import comparison as figures

        return figures.spread(answer.all_differences(self.results))

    def typical(self) -> Example:
        """The replication that has the median of the differences."""
        replication = answer.typical(self.results, self.shown)
        return Example(self.results, self.shown, replication)

    def worst(self) -> Example:
        """The replication with the worst mission of the variation."""
        return Example(self.results, self.shown, answer.worst(self.results, self.shown))


def what_if(
    settings: Mapping[str, Any],
    baseline: Mapping[str, Any] | None = None,
    scenario: str | Path = "paper",
    policies: Sequence[str] | None = None,
    missions: int = 500,
    seed: int = 0,
    folder: str | Path = "results",
    workers: int = 1,
    shown: str | None = None,
    progress: Progress | None = None,
    yes: bool = False,
) -> WhatIf:
    """Simulate a baseline and a variation of it with common random numbers, and compare them.

    The missions are stored in ``FOLDER/what-if``. The same question is answered at once the next
    time; with more missions, only those that are missing are simulated.

    Args:
        settings: Fields of the scenario that the variation sets.
        baseline: Fields of the scenario that are set in both; in the variation, ``settings`` comes
            first.
        scenario: The name of a shipped scenario, or a TOML file.
        policies: Teams, each compared with itself: ``"P"`` or ``"P,P,..."``. Without any, the best
            policy that five minutes allow, and ``greedy``.
        missions: Number of missions of each policy on each side, at least 2.
        seed: Seed of the missions.
        folder: Folder in which results are stored.
        workers: Number of processes. Two or more take seconds to start; they help in long runs.
        shown: The policy of ``typical`` and ``worst``. By default the best one in the variation.
        progress: Called with the number of missions done since its last call.
        yes: Whether the question may take more than an hour.

    Raises:
        InputError: Before anything is written, if a field, a value or a policy is unknown or not
            allowed, a policy cannot act in the scenario, or the question would take long.
    """
    study = question.question(settings, baseline, scenario, policies, missions, seed)
    question.check_policy(study, shown or study.policies[0])
    results = question.ask(study, folder, workers, progress, yes)
    return WhatIf(results, shown or answer.best_policy(results, VARIATION))
