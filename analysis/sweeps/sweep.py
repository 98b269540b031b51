"""``analysis.sweep``: ask every combination of values of some fields, in one line.

results = sweep("my-sea.toml", policies=["greedy", "ddqn"], uavs=range(2, 6), pads=[1, 2, 3])
results.table()
results.plot("uavs", hue="pads")
results.best()
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from analysis.execution.jobs import Progress
from analysis.execution.runner import Round
from analysis.names import PRODUCT
from analysis.questions import costs, settings
from analysis.results.tables import Results
from analysis.study.study import Study
from analysis.sweeps.question import ask, command, folder_of, question
from analysis.sweeps.values import values_of
from dess import InputError

if TYPE_CHECKING:  # figures need the extra reports
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Sweep:
    """The answer of a sweep.

    Attributes:
        study: What was asked.
        path: The results folder.
        results: The missions, ``results.missions``, as a tidy table, and all else of the folder.
    """

    study: Study
    path: Path
    results: Results

    def table(self, metric: str = PRODUCT) -> pd.DataFrame:
        """The settings, a policy with values of the swept fields each, the best first.

        Args:
            metric: Ranks them; ``cost`` is one, if there are prices.

        Returns:
            Columns ``rank``, ``policy``, ``point``, ``n`` missions, the swept fields, every metric
            with the ends of its 95 % interval (``success``, ``success_low``, ``success_high``), and
            ``tied``: whether the setting may be as good as the best. With prices also the ``cost``
            with its interval, and with requirements the ``verdict`` (``met``, ``missed`` or
            ``open``), and whether the setting is ``selected`` as the cheapest of its policy under
            its condition.
        """
        table = settings.ranked(self.results, metric)
        if self.study.costs is None:
            return table
        priced = costs.judged(self.results) if self.study.selection else costs.priced(self.results)
        key = ["policy", "point"]
        more = [name for name in priced if name in key or name not in table]
        return table.merge(priced[more], on=key, how="left")

    def best(self, metric: str = PRODUCT) -> pd.DataFrame:
        """The best setting of every policy, the best policy first.

        With requirements: the cheapest settings that meet them, one for each policy under each
        condition (swept fields that no operator decides on, such as the arrival rate); none, where
        no setting is known to meet them.
        """
        table = self.table(metric)
        if self.study.selection:
            return table[table["selected"]].sort_values("point", kind="stable", ignore_index=True)
        return table.drop_duplicates("policy", ignore_index=True)

    def answers(self) -> list[str]:
        """With requirements: the cheapest fleets that meet them, and why no cheaper one does."""
        if not self.study.selection:
            return []
        lines = costs.answers(self.results, costs.judged(self.results))
        return [line.replace("**", "").replace("`", "") for line in lines]

    @property
    def fields(self) -> list[str]:
        """The swept fields."""
        return [*settings.varied(self.results)]

    @property
    def guarantee(self) -> str:
        """With requirements: what is promised of the selected settings, in words."""
        choices = (self.results.cheapest(policy) for policy in self.results.policies)
        return "; ".join(dict.fromkeys(choice.guarantee for choice in choices if choice))

    @property
    def command(self) -> str:
        """The command that asks the same."""
        return command(self.study)

    def plot(self, x: str | None = None, hue: str | None = None, metric: str = PRODUCT) -> "Figure":
        """Curves of a metric over a swept field, with 95 % intervals, for every policy.

        Args:
            x: The field; without one, the first that is swept, with the second one as ``hue``.
            hue: A field that has a curve for each of its values.
            metric: What is drawn.

        Raises:
            InputError: If a field is not swept, or there is no such metric.
        """
        from analysis.figures import settings as figures

        if x is None:
            if not self.fields:
                raise InputError("x: no field is swept; allowed: a sweep of one field or more")
            x, hue = self.fields[0], hue or next(iter(self.fields[1:]), None)
        return figures.plot(self.results, x, hue, metric)


def sweep(
    scenario: str | Path = "paper",
    policies: Iterable[str] = ("greedy",),
    missions: int = 300,
    seed: int = 0,
    folder: str | Path = "results",
    workers: int = 1,
    prices: Mapping[str, Any] | None = None,
    requirements: Mapping[str, float] | None = None,
    name: str | None = None,
    progress: bool | Progress = True,
    yes: bool = False,
    **fields: Any,
) -> Sweep:
    """Simulate every combination of values of fields, and keep it.

    Asked again, it answers at once; with more missions or other values, it simulates only what no
    sweep in the folder has. All settings meet the same replications (common random numbers).

    Args:
        scenario: A shipped scenario, or a TOML file.
        policies: Teams to compare: ``"P"`` or ``"P,P,..."``.
        missions: Of every policy and setting. With requirements: further ones, that check the
            selected settings.
        seed: Of the missions.
        folder: Where results are kept, in ``FOLDER/sweeps/NAME``, with ``NAME.toml`` beside it.
        workers: Processes. Two or more take seconds to start, and pay for long runs only.
        prices: Fields of ``analysis.study.costs.Costs``, such as ``{"uav": 20_000}``.
        requirements: Metric -> its least mean, such as ``{"success": 0.99}``. With them, as many
            missions are simulated as the search of the cheapest setting that meets them takes.
        name: Of the sweep; without one, it is made of the fields and a hash.
        progress: Whether to show a bar; or called with the number of missions done since its last
            call.
        yes: Whether it may take more than an hour.
        **fields: Fields of the scenario. One value is fixed; a list, range, tuple or array of
            several is swept. ``initial_data=[5, 20]`` is one range; see ``analysis.sweeps.values``.

    Raises:
        InputError: If a field, a value or a policy is not allowed, a policy cannot act in the
            scenario, or it would take long: before anything is written.
        ChunkError: If something could not be computed; after all that could.
    """
    values = {field: values_of(field, given) for field, given in fields.items()}
    study = question(values, scenario, policies, missions, seed, prices, requirements, name)
    if callable(progress):
        results = ask(study, folder, workers, progress, yes=yes)
    else:
        with _bar(progress) as (bar, announce):
            results = ask(study, folder, workers, bar, announce, yes)
    return Sweep(study, folder_of(study, folder), results)


@contextmanager
def _bar(shown: bool) -> Iterator[tuple[Progress, Callable[[Round], None]]]:
    """A bar that counts missions, once some are simulated; a rule may ask for more on the way."""
    from tqdm.auto import tqdm

    bars: list[tqdm] = []
    done = 0

    def begin(started: Round) -> None:
        if shown and not bars and started.present < started.missions:
            bars.append(tqdm(unit="mission", initial=done, delay=1))
        for bar in bars:
            bar.total = started.missions

    def count(missions: int) -> None:
        nonlocal done
        done += missions
        for bar in bars:
            bar.update(missions)

    try:
        yield count, begin
    finally:
        for bar in bars:
            bar.close()
