"""Questions asked in one line, ``analysis.sweep`` and ``analysis.what_if``, and their answers."""

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from dess import InputError
from dess.analysis.answers.fleet import tables as fleet_tables
from dess.analysis.answers.fleet import verdicts
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.fleet.costs import mean_cost_parts, price_facts, priced_settings
from dess.analysis.answers.fleet.risk import risk_facts
from dess.analysis.answers.settings.points import varied_values
from dess.analysis.answers.settings.ranking import (
    best_setting_facts,
    best_setting_headline,
    rank_settings,
    ranked_table,
    ranking_metric,
)
from dess.analysis.answers.sides import VARIATION, best_policy_of_side
from dess.analysis.answers.variation import Variation
from dess.analysis.ask import around
from dess.analysis.ask.around import one_more_facts
from dess.analysis.ask.assumptions import assumption_facts
from dess.analysis.ask.falls import fall_facts, setting_fall_facts
from dess.analysis.ask.limits import limit_facts
from dess.analysis.ask.question import Question, sweep_question, values_of, what_if_question
from dess.analysis.execution.jobs import Progress
from dess.analysis.execution.runner import Round
from dess.analysis.facts import Fact
from dess.analysis.metrics import PRODUCT, SUCCESS
from dess.analysis.results.tables import Results
from dess.analysis.sheet import scenario_notes
from dess.analysis.tables import Table
from dess.base.errors import unknown_name

if TYPE_CHECKING:  # figures need the extra reports
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Answer(ABC):
    """The answer to a question: a headline, facts, tables and a figure.

    Attributes:
        results: The results; ``results.missions`` is a tidy table of the missions.
        question: The study that was run and its folder; None if the results are those of another
            study.
    """

    results: Results
    question: Question | None = None

    @abstractmethod
    def headline(self) -> str:
        """The answer in a sentence."""

    @abstractmethod
    def own_facts(self) -> list[Fact]:
        """What was found, required and guaranteed."""

    def named_points(self) -> Iterable[int]:
        """The design points that the answer names: all, unless it names a best one."""
        return range(len(self.results.store.manifest.scenarios))

    @abstractmethod
    def table(self) -> pd.DataFrame:
        """The numbers of what was compared, a row for each."""

    @abstractmethod
    def shown_tables(self) -> list[Table]:
        """The answer in few tables, as pages and the terminal show them."""

    @abstractmethod
    def plot(self) -> "Figure":
        """The figure that shows the answer."""

    def facts(self) -> list[Fact]:
        """The facts of the answer, and with a data sheet which nodes no UAV can serve."""
        notes = scenario_notes(map(self.results.scenario, self.named_points()))
        return [*self.own_facts(), *(Fact("note", note) for note in notes)]

    @property
    def command(self) -> str:
        """The command that asks the question again; empty if the study is no question."""
        if self.question is None:
            return ""
        return self.question.command

    def assumptions(self) -> list[Fact]:
        """What the answer assumes, where the scenario has a data sheet."""
        return []

    def tables(self) -> dict[str, pd.DataFrame]:
        """The numbers of the answer by name."""
        return {"table": self.table()}

    def _repr_markdown_(self) -> str:
        """What Jupyter shows."""
        lines = [f"- {fact.line}" for fact in self.facts()]
        return "\n".join([f"**{self.headline()}**", "", *lines])


@dataclass(frozen=True, eq=False)
class SweepAnswer(Answer):
    """The settings of a sweep, the best first. A setting is a policy with values of swept fields.

    Attributes:
        metric: The metric that ranks the settings; None for that of ``ranking_metric``.
    """

    metric: str | None = None

    @property
    def _ranking_metric(self) -> str:
        return ranking_metric(self.results, self.metric)

    def headline(self) -> str:
        """The best setting and its mean."""
        return best_setting_headline(self.results, self._ranked(), self._ranking_metric)

    def own_facts(self) -> list[Fact]:
        """The best setting, how the others compare, where more collect less, and the prices."""
        facts = best_setting_facts(self.results, self._ranked(), self._ranking_metric)
        facts += setting_fall_facts(self.results)
        if self.results.study.costs:
            facts += price_facts(self.results)
        return facts

    def named_points(self) -> Iterable[int]:
        """The design point of the best setting."""
        return [self._ranked()["point"].iloc[0]]

    def assumptions(self) -> list[Fact]:
        """What the answer assumes, where the scenario has a data sheet."""
        if not self._has_sheets:
            return []
        return assumption_facts(self.results, self._ranking_metric)

    @property
    def _has_sheets(self) -> bool:
        return all(space.units for space in self.results.store.manifest.scenarios)

    def _ranked(self, metric: str | None = None) -> pd.DataFrame:
        return rank_settings(self.results, metric or self._ranking_metric)

    def table(self, metric: str | None = None) -> pd.DataFrame:
        """The settings, the best first.

        Args:
            metric: The metric that ranks them, ``cost`` included if there are prices. By default
                that of the answer.

        Returns:
            A row per setting with ``rank``, ``policy``, ``point``, ``n`` missions, the swept
            fields, every metric with the ends of its 95 % interval (``success``, ``success_low``,
            ``success_high``), ``standing``: how the setting compares with the others, and ``tied``:
            whether it may be as good as the best one by what was seen.
            With prices also ``cost`` with its interval, and its parts where costs are those of a
            year. With requirements also the ``verdict`` (``met``, ``missed`` or ``open``), and
            ``selected``: whether the setting is the selected one of its policy under its condition.
        """
        table = self._ranked(metric)
        costs = self.results.study.costs
        if costs is None:
            return table
        priced = [self._priced_settings()]
        if costs.years is not None:
            priced.append(mean_cost_parts(self.results).drop(columns="stranded"))
        key = ["policy", "point"]
        for columns in priced:
            more = [name for name in columns if name in key or name not in table]
            table = table.merge(columns[more], on=key, how="left")
        return table

    def _priced_settings(self) -> pd.DataFrame:
        return priced_settings(self.results)

    def best(self, metric: str | None = None) -> pd.DataFrame:
        """The best setting of every policy, the best policy first.

        Args:
            metric: As in ``table``.
        """
        return self.table(metric).drop_duplicates("policy", ignore_index=True)

    def shown_tables(self) -> list[Table]:
        """The first settings of the ranking."""
        return [ranked_table(self.results, self.table(), self._ranking_metric)]

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


@dataclass(frozen=True, eq=False)
class FleetAnswer(SweepAnswer):
    """The cheapest fleet that meets requirements.

    ``metric`` is one that is shown beside those of the requirements.
    """

    def headline(self) -> str:
        """What to buy, and what it costs."""
        return search_of(self.results).headline()

    def own_facts(self) -> list[Fact]:
        """The fleet by its requirements, the next cheaper, other policies, and what may go wrong.

        With a data sheet also what breaks the fleet first, and what one more UAV brings.
        """
        results = self.results
        facts = search_of(results).facts()
        if self._has_sheets:
            best = search_of(results).best
            facts += risk_facts(results, best.policy, best.points)
            facts += [*limit_facts(results), *one_more_facts(results), *fall_facts(results)]
        return [*facts, *price_facts(results)]

    def named_points(self) -> Iterable[int]:
        """The design points of the cheapest fleet; all if none is found."""
        return search_of(self.results).best.points or Answer.named_points(self)

    def fleets(self) -> pd.DataFrame:
        """The fleets that the answer was chosen from, the cheapest first.

        Returns:
            A row per policy and fleet, as ``answers.fleet.tables.fleet_rows`` returns it.
        """
        return fleet_tables.fleet_rows(self.results)

    def _priced_settings(self) -> pd.DataFrame:
        return verdicts.judge_settings(self.results)

    def best(self, metric: str | None = None) -> pd.DataFrame:
        """The cheapest settings that meet the requirements.

        There is one for each policy and condition (the values of swept fields that no operator
        decides on, such as the arrival rate), and none where no setting is known to meet them.

        Args:
            metric: As in ``table``.
        """
        table = self.table(metric)
        return table[table["selected"]].sort_values("point", kind="stable", ignore_index=True)

    def tables(self) -> dict[str, pd.DataFrame]:
        """The settings as ``table``, and the ``fleets``."""
        return {**super().tables(), "fleets": self.fleets()}

    def shown_tables(self) -> list[Table]:
        """The fleets by cost, and what a change of the cheapest brings."""
        tables = [fleet_tables.fleet_table(self.results, self.metric or SUCCESS)]
        if around.is_known(self.results):
            tables.append(around.table_around(self.results))
        return tables

    @property
    def guarantee(self) -> str:
        """What is guaranteed about the selected settings, in words."""
        return "; ".join(search_of(self.results).guarantees())


@dataclass(frozen=True, eq=False)
class VariationAnswer(Answer):
    """What changes in a variation of a baseline.

    Attributes:
        shown: The policy whose missions are drawn; without one, the best one in the variation.
    """

    shown: str | None = None

    @property
    def variation(self) -> Variation:
        """The variation compared with its baseline."""
        return Variation(self.results, self.shown or best_policy_of_side(self.results, VARIATION))

    def headline(self) -> str:
        """What is changed, and what that changes."""
        return self.variation.headline()

    def own_facts(self) -> list[Fact]:
        """What the variation changes for every policy, and whether more collect less."""
        return [*self.variation.facts(), *setting_fall_facts(self.results)]

    def table(self) -> pd.DataFrame:
        """The differences, a row per policy and metric, as ``answers.sides.compare_sides``."""
        return self.variation.table()

    def shown_tables(self) -> list[Table]:
        """What was measured on both sides, a table for each policy."""
        return [self.variation.measures_table(policy) for policy in self.results.policies]

    def plot(self) -> "Figure":
        """The paired differences of the metrics, with intervals."""
        return self.variation.plot()


def settings_answer(
    results: Results, question: Question | None = None, metric: str | None = None
) -> SweepAnswer:
    """The answer of a sweep or of any study: the cheapest fleet if it searches for one.

    Args:
        results: The study.
        question: The question, if it is one.
        metric: The metric that ranks the settings, or is shown beside the required ones.
    """
    if results.study.is_search:
        return FleetAnswer(results, question, metric)
    return SweepAnswer(results, question, metric)


def sweep(
    scenario: str | Path = "paper",
    policies: Iterable[str] | None = None,
    missions: int | None = None,
    seed: int = 0,
    folder: str | Path = "results",
    workers: int = 1,
    *,
    prices: Mapping[str, Any] | None = None,
    requirements: Mapping[str, float | str] | None = None,
    name: str | None = None,
    years: int | None = None,
    progress: bool | Progress = True,
    yes: bool = False,
    scheduler: str | None = None,
    **fields: Any,
) -> SweepAnswer:
    """Simulate every combination of values of fields, and store the missions.

    The same sweep is answered at once the next time. With more missions or other values, only the
    missions that no sweep in the folder has are simulated. All settings use the same replications
    (common random numbers).

    Args:
        scenario: The name of a shipped scenario, or a TOML file.
        policies: Teams to compare: ``"P"`` or ``"P,P,..."``. Without any, the best policy that
            five minutes allow, and ``greedy``.
        missions: Number of missions of every setting, 300 by default. With requirements, the
            number of additional missions that check each selected setting.
        seed: Seed of the missions.
        folder: Results are stored in ``FOLDER/sweeps/NAME``, with ``NAME.toml`` beside it.
        workers: Number of processes. Two or more take seconds to start; they help in long runs.
        prices: Fields of ``dess.analysis.study.prices.Costs``, such as ``{"uav": 20_000}``.
        requirements: For each required metric its lowest acceptable mean, such as ``{"success":
            0.99}``; for ``age`` its highest, such as ``{"age": "6 h"}`` with a data sheet. With
            requirements, as many missions are simulated as the search for the cheapest setting
            that meets them needs.
        name: Name of the sweep. Without one, it is made of the fields and a hash.
        years: Years of weather, in place of missions; 10 by default where a scenario has weather.
        progress: Whether to show a progress bar, or a function that is called with the number of
            missions done since its last call.
        yes: Whether the sweep may take more than an hour.
        scheduler: Address of a ``dask.distributed`` scheduler on which to run instead.
        **fields: Fields of the scenario. A single value is fixed; a list, range, tuple or array of
            values is swept. ``initial_data=[5, 20]`` is one range; see ``values_of``.

    Raises:
        InputError: Before anything is written, if a field, a value or a policy is not allowed, a
            policy cannot act in the scenario, or the sweep would take long.
        ChunkError: If a chunk could not be computed. It is raised after all other chunks are done.
    """
    values = {field: values_of(field, asked) for field, asked in fields.items()}
    question = sweep_question(
        values,
        scenario,
        policies,
        missions,
        seed,
        prices,
        requirements,
        name,
        folder=folder,
        years=years,
    )
    return settings_answer(_ask(question, workers, progress, yes, scheduler), question)


def what_if(
    settings: Mapping[str, Any],
    baseline: Mapping[str, Any] | None = None,
    scenario: str | Path = "paper",
    policies: Sequence[str] | None = None,
    missions: int | None = None,
    seed: int = 0,
    folder: str | Path = "results",
    workers: int = 1,
    *,
    prices: Mapping[str, Any] | None = None,
    shown: str | None = None,
    years: int | None = None,
    progress: Progress | None = None,
    yes: bool = False,
    scheduler: str | None = None,
) -> VariationAnswer:
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
        missions: Number of missions of each policy on each side, at least 2; 500 by default.
        seed: Seed of the missions.
        folder: Folder in which results are stored.
        workers: Number of processes. Two or more take seconds to start; they help in long runs.
        prices: Prices, as for ``sweep``: then costs are compared as well.
        shown: The policy of ``typical`` and ``worst``. By default the best one in the variation.
        years: Years of weather, in place of missions; 10 by default where a scenario has weather.
        progress: Called with the number of missions done since its last call.
        yes: Whether the question may take more than an hour.
        scheduler: Address of a ``dask.distributed`` scheduler on which to run instead.

    Raises:
        InputError: Before anything is written, if a field, a value, a policy or a price is unknown
            or not allowed, a policy cannot act in the scenario, or the question would take long.
    """
    question = what_if_question(
        settings,
        baseline,
        scenario,
        policies,
        missions,
        seed,
        folder,
        prices=prices,
        years=years,
    )
    check_shown(question, shown)
    return VariationAnswer(_ask(question, workers, progress, yes, scheduler), question, shown)


def check_shown(question: Question, policy: str | None) -> None:
    """Refuse a policy to show that the question does not ask about.

    Raises:
        InputError: If there is one.
    """
    asked = question.study.policies
    if policy is not None and policy not in asked:
        raise unknown_name("shown", f"{policy!r} is not asked about", policy, asked)


def _ask(
    question: Question,
    workers: int,
    progress: bool | Progress | None,
    yes: bool,
    scheduler: str | None,
) -> Results:
    """Ask a question, with a progress bar if ``progress`` is True."""
    if progress is True:
        with _progress_bar() as (bar, announce):
            return question.ask(workers, bar, announce, yes, scheduler)
    return question.ask(workers, progress or None, yes=yes, scheduler=scheduler)


@contextmanager
def _progress_bar() -> Iterator[tuple[Progress, Callable[[Round], None]]]:
    """A progress bar in missions, shown if they take a second; its total may grow by a rule."""
    from tqdm.auto import tqdm

    # The bar of notebooks does not read this variable, with which pages are made.
    is_disabled = os.environ.get("TQDM_DISABLE", "0") != "0"
    with tqdm(unit="mission", delay=1, disable=is_disabled) as bar:

        def begin(started: Round) -> None:
            bar.total = started.missions
            if not bar.disable:
                bar.initial += started.present  # took no time

        yield bar.update, begin
