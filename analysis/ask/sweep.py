"""A sweep in one line: a study made of values, kept in a folder, asked again."""

import json
import os
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import tomli_w

import dess
from analysis.answers import costs, settings
from analysis.execution.effort import BASELINE, check_run, policies_for
from analysis.execution.jobs import Progress
from analysis.execution.runner import Round, run_study
from analysis.metrics import ALIASES, METRICS, PRODUCT
from analysis.names import SWEEP, SWEEPS
from analysis.results.chunks import MANIFEST, short_hash
from analysis.results.provenance import engine_code, team_of
from analysis.results.tables import Results
from analysis.study.cheapest import Cheapest, Costs
from analysis.study.design import MAX_SIZE, Grid
from analysis.study.study import Study, study_from
from dess import InputError
from dess.errors import one_of
from dess.files.reading import paths_in
from dess.files.writing import write_file
from dess.scenario import is_scenario_name, load_scenario
from policies.registry import typed

_LENGTHS = {"initial_data": 2, "zone": 4}  # of fields whose value is a list of numbers


def values_of(field: str, given: Any) -> tuple[Any, ...]:
    """The values of a field, as a tuple.

    Args:
        field: The field.
        given: A value, or a list, tuple, range or array of values.

    Raises:
        InputError: If there is none, or there are too many.
    """
    if _is_value(field, given):
        return (_plain(given),)
    return listed(field, given)


def listed(field: str, given: Sequence[Any] | np.ndarray) -> tuple[Any, ...]:
    """One or several values of a field, in the types of TOML.

    Raises:
        InputError: If there is none, or there are too many.
    """
    count = _count(given)
    if not 0 < count <= MAX_SIZE:
        counted = f"{count:,}" if count else "no"
        raise InputError(f"{field}: has {counted} values; allowed: 1 to {MAX_SIZE:,}")
    return tuple(_plain(value) for value in given)


def _count(given: Sequence[Any] | np.ndarray) -> int:
    """The number of values; ``len`` fails for ranges of more than 2^63."""
    if isinstance(given, range):
        return max(0, -((given.start - given.stop) // given.step))
    return len(given)


def _is_value(field: str, given: Any) -> bool:
    """Whether ``given`` is one value of the field, and not several values."""
    if isinstance(given, np.ndarray):
        return given.ndim == 0
    if not isinstance(given, Sequence) or isinstance(given, str):
        return True
    if isinstance(given, range):
        return False
    if field == "nodes":
        return all(map(_is_cell, given)) and len(given) > 0
    return len(given) == _LENGTHS.get(field) and all(map(_is_number, given))


def _is_cell(item: Any) -> bool:
    return isinstance(item, list | tuple) and len(item) == 2 and all(map(_is_number, item))


def _is_number(item: Any) -> bool:
    return isinstance(item, int | float | np.number)


def _plain(value: Any) -> Any:
    """A value in the types of TOML, without numpy types and tuples."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    return [_plain(item) for item in value] if isinstance(value, list | tuple) else value


LONGEST = 60  # largest number of characters for the fields in a name

# Missions in the search for the cheapest setting: at most, per setting on average and over all
# settings; and with how many of every setting it begins.
BUDGET, ALL, FIRST = 2_000, 1_000_000, 20
# How many a setting takes on average, with those that check the answer: 20 settings of the scenario
# ``bay`` with a success of 99 % took 620 each.
USUAL = 620
LITTLE = 0.01  # as a share of the prices: a saving that does not matter


def question(
    values: Mapping[str, Sequence[Any]],
    scenario: str | Path = "paper",
    policies: Iterable[str] | None = None,
    missions: int = 300,
    seed: int = 0,
    prices: Mapping[str, Any] | None = None,
    requirements: Mapping[str, float] | None = None,
    name: str | None = None,
) -> Study:
    """The study of a sweep.

    Args:
        values: For each field of the scenario its values. A field with one value is fixed.
        scenario: The name of a shipped scenario, or a TOML file.
        policies: Teams: ``"P"`` or ``"P,P,..."``. Without any, the best policy that five minutes
            allow, and ``greedy``.
        missions: Number of missions of every setting. With requirements, the number of additional
            missions that check each selected setting.
        seed: Seed of the missions.
        prices: Fields of ``Costs``.
        requirements: For each required metric its lowest acceptable mean. With requirements the
            study searches for the cheapest setting that meets them, and needs prices.
        name: Name of the study. Without one, the name is made of the fields and a hash.

    Raises:
        InputError: If a field, a value, a policy, a price or a requirement is not allowed.
    """
    if unknown := [key for key in prices or () if key not in Costs.model_fields]:
        raise InputError(
            f"prices: {unknown[0]!r} is unknown{one_of(unknown[0], Costs.model_fields)}"
        )
    fixed = {field: of_field[0] for field, of_field in values.items() if len(of_field) == 1}
    swept = {field: of_field for field, of_field in values.items() if len(of_field) > 1}
    load_scenario(scenario, **{field: of_field[0] for field, of_field in values.items()})
    data = {
        "name": "sweep" if name is None else name,
        "description": SWEEP,
        "scenario": str(scenario),
        "set": fixed,
        "design": {"kind": "grid", "values": swept},
        "policies": typed([policies] if isinstance(policies, str) else policies or [BASELINE]),
        "seed": seed,
        **({"costs": dict(prices)} if prices else {}),
        **({} if requirements else {"missions": missions}),
    }
    if requirements:
        data["selection"] = _cheapest(requirements, missions, study_from(data, "sweep"))
    if policies is None:
        spaces = study_from(data, "sweep").scenarios
        each = max(USUAL, missions) if requirements else missions
        data["policies"] = policies_for(spaces, each)
    study = study_from(data, "sweep")
    return study if name is not None else study.model_copy(update={"name": _name_of(study, swept)})


def folder_of(study: Study, folder: str | Path) -> Path:
    """The results folder of a sweep."""
    return Path(folder) / SWEEPS / study.name


def file_of(study: Study, folder: str | Path) -> Path:
    """The file of the study of a sweep."""
    return Path(folder) / SWEEPS / f"{study.name}.toml"


def command(study: Study) -> str:
    """The command that runs the same sweep."""
    assert isinstance(study.design, Grid)
    fixed = {field: [value] for field, value in study.set.items()}
    values = {**fixed, **study.design.values}
    words = [w for f, of_f in values.items() for w in ("--set", f"{f}={_listed(of_f)}")]
    about = {"policy": study.policies, "missions": [study.missions], "seed": [study.seed]}
    if study.scenario != "paper":
        about["scenario"] = [Path(study.scenario).name]
    words += [
        w for name, of_name in about.items() for w in (f"--{name}", ",".join(map(str, of_name)))
    ]
    prices = study.costs.model_dump(exclude_unset=True) if study.costs else {}
    words += [w for key, amount in prices.items() for w in ("--price", f"{key}={amount}")]
    rule = study.selection
    if isinstance(rule, Cheapest):
        words[words.index("--missions") + 1] = str(rule.check)
        words += [w for m, q in rule.requirements.items() for w in ("--require", f"{m}={q}")]
    return shlex.join(["dess", "sweep", *words])


def _listed(values: Iterable[Any]) -> str:
    return json.dumps([*values])[1:-1].replace(" ", "")


def ask(
    study: Study,
    folder: str | Path,
    workers: int = 1,
    progress: Progress | None = None,
    announce: Callable[[Round], object] | None = None,
    yes: bool = False,
) -> Results:
    """Write the file of a sweep, and simulate the missions that no sweep in the folder has.

    Args:
        study: The study made by ``question``.
        folder: Folder in which results are stored.
        workers: Number of processes.
        progress: As for ``run_study``.
        announce: As for ``run_study``.
        yes: Whether a sweep of any length is allowed.

    Raises:
        InputError: Before anything is written, if a policy cannot act in the scenario, the sweep
            would take long, or another question has the same name; or if the folder cannot be
            written.
        ChunkError: As for ``run_study``.
    """
    out = folder_of(study, folder)
    reuse = others(out)
    check_run(study, out, workers, reuse=reuse, yes=yes)
    write(study, folder)
    return run_study(study, out, workers, None, progress, announce, reuse=reuse)


def others(out: Path) -> list[Path]:
    """The results folders of the other sweeps beside one, whose missions are copied."""
    return [path.parent for path in paths_in(out.parent, f"*/{MANIFEST}") if path.parent != out]


def write(study: Study, folder: str | Path) -> Path:
    """Write the file of the study, which ``dess study run`` reads, and return its path."""
    path = file_of(study, folder)
    data = study.model_dump(mode="json", exclude_unset=True)
    if not is_scenario_name(study.scenario):
        data["scenario"] = Path(os.path.relpath(study.scenario, path.parent)).as_posix()
    write_file(path, tomli_w.dumps(data))
    return path


def _cheapest(requirements: Mapping[str, float], missions: int, study: Study) -> dict[str, Any]:
    """The rule that searches for the cheapest setting that meets the requirements."""
    prices = study.costs
    if not prices:
        raise InputError("requirements: need prices; allowed: prices, such as uav=20000")
    least = {}
    for metric, share in requirements.items():
        full = ALIASES.get(metric, metric)
        if full not in METRICS:
            allowed = one_of(metric, [*METRICS, *ALIASES])
            raise InputError(f"requirements: {metric!r} is unknown{allowed}")
        least[full] = share
    spaces = study.scenarios
    fleet = prices.uav * max(space.uavs[1] for space in spaces)
    fleet += prices.pad * max(space.charging_pads for space in spaces)
    running = prices.missions * (prices.charge + prices.hour + prices.lost_uav)
    if not fleet and not running:
        raise InputError("prices: all are 0; allowed: one or more above 0")
    return {
        "procedure": "cheapest",
        "requirements": least,
        "indifference": LITTLE * (fleet or running),
        "budget": min(BUDGET * study.size, max(ALL, FIRST * study.size)),
        "first": FIRST,
        "check": missions,
    }


def _name_of(study: Study, fields: Iterable[str]) -> str:
    """A name made of the swept fields, and of a hash of all that the records depend on."""
    data = study.model_dump(mode="json", exclude={"missions": True, "selection": {"check"}})
    about = {
        "version": dess.__version__,
        "engine": engine_code(),
        "teams": [team_of(policy).model_dump(mode="json") for policy in study.policies],
        "base": load_scenario(study.scenario, **study.set).model_dump(mode="json"),
        "study": data | {"scenario": Path(study.scenario).name},
    }
    key = short_hash(json.dumps(about, sort_keys=True).encode())
    return f"{'-'.join(fields)[:LONGEST] or 'sweep'}-{key}"


if TYPE_CHECKING:  # figures need the extra reports
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Sweep:
    """The results of a sweep.

    Attributes:
        study: The study that was run.
        path: The results folder.
        results: The content of the folder; ``results.missions`` is a tidy table of the missions.
    """

    study: Study
    path: Path
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
        table = settings.ranked(self.results, metric)
        if self.study.costs is None:
            return table
        priced = costs.judged(self.results) if self.study.selection else costs.priced(self.results)
        key = ["policy", "point"]
        more = [name for name in priced if name in key or name not in table]
        return table.merge(priced[more], on=key, how="left")

    def best(self, metric: str = PRODUCT) -> pd.DataFrame:
        """The best setting of every policy, the best policy first.

        With requirements, the cheapest settings that meet them: one for each policy and condition
        (the values of swept fields that no operator decides on, such as the arrival rate). There is
        none where no setting is known to meet the requirements.
        """
        table = self.table(metric)
        if self.study.selection:
            return table[table["selected"]].sort_values("point", kind="stable", ignore_index=True)
        return table.drop_duplicates("policy", ignore_index=True)

    def answers(self) -> list[str]:
        """The best setting and what other policies would have said, in sentences.

        With requirements: the cheapest fleet of all policies first, then those of each policy and
        condition, and why cheaper ones do not meet them.
        """
        if not self.study.selection:
            ranked, words = self.table(), settings.in_words(self.results)
            point, others = ranked["point"][0], settings.dependence(self.results, ranked, PRODUCT)
            edge = settings.edge(self.results, point, settings.ends(self.results, point))
            best = f"The best setting is {ranked['policy'][0]} with {words[point]}.{edge}"
            return [best, *others] if others or edge else []
        lines = costs.sentences(self.results)
        return [line.replace("**", "").replace("`", "") for line in lines]

    def cheapest(self) -> str:
        """With requirements: the cheapest fleet of all policies for all conditions."""
        return costs.cheapest_fleet(self.results) if self.study.selection else ""

    @property
    def fields(self) -> list[str]:
        """The swept fields."""
        return [*settings.varied(self.results)]

    @property
    def guarantee(self) -> str:
        """With requirements: what is guaranteed about the selected settings, in words."""
        choices = (self.results.cheapest(policy) for policy in self.results.policies)
        return "; ".join(dict.fromkeys(choice.guarantee for choice in choices if choice))

    @property
    def command(self) -> str:
        """The command that runs the same sweep."""
        return command(self.study)

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
        from analysis.figures import settings as figures

        if x is None:
            if not self.fields:
                raise InputError("x: no field is swept; allowed: a sweep of one field or more")
            x, hue = self.fields[0], hue or next(iter(self.fields[1:]), None)
        return figures.plot(self.results, x, hue, metric).figure


def sweep(
    scenario: str | Path = "paper",
    policies: Iterable[str] | None = None,
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
        prices: Fields of ``analysis.study.cheapest.Costs``, such as ``{"uav": 20_000}``.
        requirements: For each required metric its lowest acceptable mean, such as ``{"success":
            0.99}``. With requirements, as many missions are simulated as the search for the
            cheapest setting that meets them needs.
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
    values = {field: values_of(field, given) for field, given in fields.items()}
    study = question(values, scenario, policies, missions, seed, prices, requirements, name)
    if progress is True:
        with _bar() as (bar, announce):
            results = ask(study, folder, workers, bar, announce, yes)
    else:
        results = ask(study, folder, workers, progress or None, yes=yes)
    return Sweep(study, folder_of(study, folder), results)


@contextmanager
def _bar() -> Iterator[tuple[Progress, Callable[[Round], None]]]:
    """A progress bar in missions, shown if they take a second; its total may grow by a rule."""
    from tqdm.auto import tqdm

    with tqdm(unit="mission", delay=1) as bar:

        def begin(started: Round) -> None:
            bar.total = started.missions
            if not bar.disable:
                bar.initial += started.present  # took no time

        yield bar.update, begin
