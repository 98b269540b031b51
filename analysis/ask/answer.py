"""Questions asked in one line, ``analysis.sweep`` and ``analysis.what_if``, and their answer."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from dess import InputError
from dess.analysis.answers.fleet import tables as fleet_tables
from dess.analysis.answers.fleet import verdicts
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.fleet.costs import mean_cost_parts, priced_settings, prices_in_words
from dess.analysis.answers.settings.points import varied_values
from dess.analysis.answers.settings.ranking import (
    best_settings_sentences,
    rank_settings,
    ranked_table,
)
from dess.analysis.answers.variation import VARIATION, Variation, best_policy_of_side
from dess.analysis.ask import around
from dess.analysis.ask.assumptions import assumption_sentences
from dess.analysis.ask.brief import brief_sentences
from dess.analysis.ask.question import (
    Question,
    strip_markdown,
    sweep_question,
    values_of,
    what_if_question,
)
from dess.analysis.execution.jobs import Progress
from dess.analysis.execution.runner import Round
from dess.analysis.metrics import PRODUCT, SUCCESS
from dess.analysis.results.tables import Results
from dess.analysis.sheet import as_sentences
from dess.analysis.tables import Table
from dess.base.errors import unknown_name

if TYPE_CHECKING:  # figures need the extra reports
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Answer:
    """The answer to a question.

    A sweep asks for the best setting, or with requirements for the cheapest fleet; a what-if
    question asks what changes in a variation of a baseline.

    Attributes:
        question: The study that was run, its folder and its command.
        results: The results; ``results.missions`` is a tidy table of the missions.
        shown: Of a what-if question, the policy whose missions are drawn; without one, the best
            one in the variation.
    """

    question: Question
    results: Results
    shown: str | None = None

    @property
    def variation(self) -> Variation:
        """Of a what-if question: the variation compared with its baseline."""
        return Variation(self.results, self.shown or best_policy_of_side(self.results, VARIATION))

    def table(self, metric: str | None = None) -> pd.DataFrame:
        """What was compared: the settings, the best first; of a what-if question, the differences.

        A setting is a policy with a value of every swept field.

        Args:
            metric: The metric that ranks the settings, ``cost`` included if there are prices. By
                default the product.

        Returns:
            A row per setting with ``rank``, ``policy``, ``point``, ``n`` missions, the swept
            fields, every metric with the ends of its 95 % interval (``success``, ``success_low``,
            ``success_high``), ``standing``: how the setting compares with the others, and ``tied``:
            whether it may be as good as the best one by what was seen.
            With prices also ``cost`` with its interval, and its parts where costs are those of a
            year. With requirements also the ``verdict`` (``met``, ``missed`` or ``open``), and
            ``selected``: whether the setting is the selected one of its policy under its condition.
            Of a what-if question, a row per policy and metric, as
            ``answers.variation.compare_sides`` returns it.
        """
        if self.question.is_comparison:
            return self.variation.table()
        table = rank_settings(self.results, metric or PRODUCT)
        study = self.question.study
        if study.costs is None:
            return table
        if study.selection:
            priced = [verdicts.judge_settings(self.results)]
        else:
            priced = [priced_settings(self.results)]
        if study.costs.years is not None:
            priced.append(mean_cost_parts(self.results).drop(columns="stranded"))
        key = ["policy", "point"]
        for columns in priced:
            more = [name for name in columns if name in key or name not in table]
            table = table.merge(columns[more], on=key, how="left")
        return table

    def fleets(self) -> pd.DataFrame:
        """With requirements: the fleets that the answer was chosen from, the cheapest first.

        Returns:
            A row per policy and fleet, as ``answers.fleet.tables.fleet_rows`` returns it.
        """
        return fleet_tables.fleet_rows(self.results)

    def best(self, metric: str | None = None) -> pd.DataFrame:
        """The best setting of every policy, the best policy first.

        With requirements, the cheapest settings that meet them: one for each policy and condition
        (the values of swept fields that no operator decides on, such as the arrival rate). There is
        none where no setting is known to meet the requirements.
        """
        table = self.table(metric)
        if self.question.study.selection:
            return table[table["selected"]].sort_values("point", kind="stable", ignore_index=True)
        return table.drop_duplicates("policy", ignore_index=True)

    def answers(self, metric: str | None = None) -> list[str]:
        """The answer in sentences, and with a data sheet which nodes no UAV can serve.

        They tell the best setting, and what other policies would have said. With requirements, the
        cheapest fleet of all policies first, the prices, how sure the answer is, and then the
        fleets of each other policy and condition. Of a what-if question, what the variation
        changes, and the conclusion on every policy.

        Args:
            metric: The metric that ranks the settings, where there are no requirements. By default
                the product.
        """
        notes = as_sentences(self.question.notes)
        if self.question.is_comparison:
            return [*map(strip_markdown, self.variation.sentences()), *notes]
        if self.question.study.selection:
            first, *others = search_of(self.results).sentences()
            sentences = (first, *brief_sentences(self.results), *others)
            return [*map(strip_markdown, sentences), *notes]
        ranking = metric or PRODUCT
        ranked = rank_settings(self.results, ranking)
        lines = best_settings_sentences(self.results, ranked, ranking)
        if self.question.study.costs:
            lines.append(prices_in_words(self.results))
        return [*lines, *notes]

    def assumptions(self, metric: str | None = None) -> list[str]:
        """What the answer to a sweep of a scenario with a data sheet assumes; otherwise nothing.

        Args:
            metric: The metric that ranks the settings, where there are no requirements. By default
                the product.
        """
        has_sheets = all(space.units for space in self.results.store.manifest.scenarios)
        if self.question.is_comparison or not has_sheets:
            return []
        return assumption_sentences(self.results, metric or PRODUCT)

    def tables(self, metric: str | None = None) -> dict[str, pd.DataFrame]:
        """The numbers of the answer by name: ``table``, and with requirements ``fleets``."""
        frames = {"table": self.table(metric)}
        if self.question.study.selection:
            frames["fleets"] = self.fleets()
        return frames

    def brief_tables(self, metric: str | None = None) -> list[Table]:
        """The answer in few tables, as the terminal prints them, with what is said below each.

        They have the first settings of the ranking; with requirements, the fleets by cost, and what
        a change of the cheapest brings; of a what-if question, what was measured on both sides.

        Args:
            metric: The metric that ranks the settings; with requirements, one that is shown beside
                those of the requirements.
        """
        if self.question.is_comparison:
            return [self.variation.measures_table(policy) for policy in self.results.policies]
        if not self.question.study.selection:
            return [ranked_table(self.results, self.table(metric), metric or PRODUCT)]
        tables = [fleet_tables.brief_fleet_table(self.results, metric or SUCCESS)]
        if around.is_known(self.results):
            tables.append(around.table_around(self.results)._replace(caption=""))
        return tables

    def question_around(self) -> Question | None:
        """What to ask about changes around the cheapest fleet, if the answer is one."""
        if not self.question.study.selection:
            return None
        return around.question_around(self.results, self.question.study.scenario)

    @property
    def guarantee(self) -> str:
        """With requirements: what is guaranteed about the selected settings, in words."""
        return "; ".join(search_of(self.results).guarantee_sentences())

    def plot(self, x: str | None = None, hue: str | None = None, metric: str = PRODUCT) -> "Figure":
        """Curves of a metric over a swept field, with 95 % intervals, for every policy.

        Of a what-if question, the paired differences of the metrics, with intervals.

        Args:
            x: The field on the horizontal axis. By default the first swept field, with the second
                one as ``hue``.
            hue: A field; there is a curve for each of its values.
            metric: The metric on the vertical axis.

        Raises:
            InputError: If a field is not swept, or there is no such metric.
        """
        if self.question.is_comparison:
            return self.variation.plot()
        from dess.analysis.answers.settings.figures import draw_curves

        if x is None:
            if not (fields := [*varied_values(self.results)]):
                raise InputError("x", "no field is swept", "a sweep of one field or more")
            x = fields[0]
            hue = hue or next(iter(fields[1:]), None)
        return draw_curves(self.results, x, hue, metric).figure

    def _repr_markdown_(self) -> str:
        """What Jupyter shows."""
        if self.question.is_comparison:
            return self.variation.answer()
        return "\n\n".join(self.answers())


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
) -> Answer:
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
    return _ask(question, workers, progress, yes)


def what_if(
    settings: Mapping[str, Any],
    baseline: Mapping[str, Any] | None = None,
    scenario: str | Path = "paper",
    policies: Sequence[str] | None = None,
    missions: int = 500,
    seed: int = 0,
    folder: str | Path = "results",
    workers: int = 1,
    *,
    shown: str | None = None,
    progress: Progress | None = None,
    yes: bool = False,
) -> Answer:
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
    question = what_if_question(settings, baseline, scenario, policies, missions, seed, folder)
    check_shown(question, shown)
    return replace(_ask(question, workers, progress, yes), shown=shown)


def check_shown(question: Question, policy: str | None) -> None:
    """Refuse a policy to show that the question does not ask about.

    Raises:
        InputError: If there is one.
    """
    asked = question.study.policies
    if policy is not None and policy not in asked:
        raise unknown_name("shown", f"{policy!r} is not asked about", policy, asked)


def _ask(question: Question, workers: int, progress: bool | Progress | None, yes: bool) -> Answer:
    """Ask a question, with a progress bar if ``progress`` is True."""
    if progress is True:
        with _progress_bar() as (bar, announce):
            return Answer(question, question.ask(workers, bar, announce, yes))
    return Answer(question, question.ask(workers, progress or None, yes=yes))


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
