"""The answer to a sweep asked in one line: ``analysis.sweep``."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from dess import InputError
from dess.analysis.answers.fleet import cheapest
from dess.analysis.answers.fleet.costs import priced_settings, prices_in_words
from dess.analysis.answers.settings.points import varied_values
from dess.analysis.answers.settings.ranking import (
    best_settings_sentences,
    rank_settings,
)
from dess.analysis.ask.question import Question, strip_markdown, sweep_question, values_of
from dess.analysis.execution.jobs import Progress
from dess.analysis.execution.runner import Round
from dess.analysis.metrics import PRODUCT
from dess.analysis.results.tables import Results

if TYPE_CHECKING:  # figures need the extra reports
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Sweep:
    """The answer to a sweep.

    Attributes:
        question: The study that was run, its folder and its command.
        results: The results; ``results.missions`` is a tidy table of the missions.
    """

    question: Question
    results: Results

    def table(self, metric: str = PRODUCT) -> pd.DataFrame:
        """The settings, the best first; a setting is a policy with a value of every swept field.

        Args:
            metric: The metric that ranks the settings, ``cost`` included if there are prices.

        Returns:
            A row per setting with ``rank``, ``policy``, ``point``, ``n`` missions, the swept
            fields, every metric with the ends of its 95 % interval (``success``, ``success_low``,
            ``success_high``), and ``tied``: whether the setting may be as good as the best one.
            With prices also ``cost`` with its interval. With requirements also the ``verdict``
            (``met``, ``missed`` or ``open``), and ``selected``: whether the setting is the selected
            one of its policy under its condition.
        """
        table = rank_settings(self.results, metric)
        study = self.question.study
        if study.costs is None:
            return table
        if study.selection:
            priced = cheapest.judge_settings(self.results)
        else:
            priced = priced_settings(self.results)
        key = ["policy", "point"]
        more = [name for name in priced if name in key or name not in table]
        return table.merge(priced[more], on=key, how="left")

    def fleets(self) -> pd.DataFrame:
        """With requirements: the fleets that the answer was chosen from, the cheapest first.

        Returns:
            A row per policy and fleet, as ``answers.fleet.cheapest.fleet_rows`` returns it.
        """
        return cheapest.fleet_rows(self.results)

    def best(self, metric: str = PRODUCT) -> pd.DataFrame:
        """The best setting of every policy, the best policy first.

        With requirements, the cheapest settings that meet them: one for each policy and condition
        (the values of swept fields that no operator decides on, such as the arrival rate). There is
        none where no setting is known to meet the requirements.
        """
        table = self.table(metric)
        if self.question.study.selection:
            return table[table["selected"]].sort_values("point", kind="stable", ignore_index=True)
        return table.drop_duplicates("policy", ignore_index=True)

    def answers(self, metric: str = PRODUCT) -> list[str]:
        """The best setting and what other policies would have said, in sentences.

        With requirements: the cheapest fleet of all policies first, the prices, how sure the answer
        is, and then the fleets of each other policy and condition.

        Args:
            metric: The metric that ranks the settings, where there are no requirements.
        """
        if self.question.study.selection:
            return [*map(strip_markdown, cheapest.cheapest_sentences(self.results))]
        ranked = rank_settings(self.results, metric)
        lines = best_settings_sentences(self.results, ranked, metric)
        if self.question.study.costs:
            lines.append(prices_in_words(self.results))
        return lines

    @property
    def guarantee(self) -> str:
        """With requirements: what is guaranteed about the selected settings, in words."""
        return "; ".join(cheapest.guarantee_sentences(self.results))

    def plot(self, x: str | None = None, hue: str | None = None, metric: str = PRODUCT) -> "Figure":
        """Curves of a metric over a swept field, with 95 % intervals, for every policy.

        Args:
            x: The field on the horizontal axis. By default the first swept field, with the second
                one as ``hue``.
            hue: A field; there is a curve for each of its values.
            metric: The metric on the vertical axis.

        Raises:
            InputError: If a field is not swept, or there is no such metric.
        """
        from dess.analysis.answers.settings.figures import draw_curves

        if x is None:
            if not (fields := [*varied_values(self.results)]):
                raise InputError("x", "no field is swept", "a sweep of one field or more")
            x = fields[0]
            hue = hue or next(iter(fields[1:]), None)
        return draw_curves(self.results, x, hue, metric).figure


def sweep(
    scenario: str | Path = "paper",
    policies: Iterable[str] | None = None,
    missions: int = 300,
    seed: int = 0,
    folder: str | Path = "results",
    workers: int = 1,
    *,
    prices: Mapping[str, Any] | None = None,
    requirements: Mapping[str, float | str] | None = None,
    name: str | None = None,
    progress: bool | Progress = True,
    yes: bool = False,
    **fields: Any,
) -> Sweep:
    """Simulate every combination of values of fields, and store the missions.

    The same sweep is answered at once the next time. With more missions or other values, only the
    missions that no sweep in the folder has are simulated. All settings use the same replications
    (common random numbers).

    Args:
        scenario: The name of a shipped scenario, or a TOML file.
        policies: Teams to compare: ``"P"`` or ``"P,P,..."``. Without any, the best policy that
            five minutes allow, and ``greedy``.
        missions: Number of missions of every setting. With requirements, the number of additional
            missions that check each selected setting.
        seed: Seed of the missions.
        folder: Results are stored in ``FOLDER/sweeps/NAME``, with ``NAME.toml`` beside it.
        workers: Number of processes. Two or more take seconds to start; they help in long runs.
        prices: Fields of ``dess.analysis.study.prices.Costs``, such as ``{"uav": 20_000}``.
        requirements: For each required metric its lowest acceptable mean, such as ``{"success":
            0.99}``; for ``age`` its highest, such as ``{"age": "6 h"}`` with a data sheet. With
            requirements, as many missions are simulated as the search for the cheapest setting
            that meets them needs.
        name: Name of the sweep. Without one, it is made of the fields and a hash.
        progress: Whether to show a progress bar, or a function that is called with the number of
            missions done since its last call.
        yes: Whether the sweep may take more than an hour.
        **fields: Fields of the scenario. A single value is fixed; a list, range, tuple or array of
            values is swept. ``initial_data=[5, 20]`` is one range; see ``values_of``.

    Raises:
        InputError: Before anything is written, if a field, a value or a policy is not allowed, a
            policy cannot act in the scenario, or the sweep would take long.
        ChunkError: If a chunk could not be computed. It is raised after all other chunks are done.
    """
    values = {field: values_of(field, asked) for field, asked in fields.items()}
    question = sweep_question(
        values, scenario, policies, missions, seed, prices, requirements, name, folder=folder
    )
    if progress is True:
        with _progress_bar() as (bar, announce):
            return Sweep(question, question.ask(workers, bar, announce, yes))
    return Sweep(question, question.ask(workers, progress or None, yes=yes))


@contextmanager
def _progress_bar() -> Iterator[tuple[Progress, Callable[[Round], None]]]:
    """A progress bar in missions, shown if they take a second; its total may grow by a rule."""
    from tqdm.auto import tqdm

    with tqdm(unit="mission", delay=1) as bar:

        def begin(started: Round) -> None:
            bar.total = started.missions
            if not bar.disable:
                bar.initial += started.present  # took no time

        yield bar.update, begin
