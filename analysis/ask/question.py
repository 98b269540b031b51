"""A question in a line: a study made of values, kept in a folder under a hash, and asked again.

    question = sweep_question({"uavs": (2, 3), "pads": (1, 2)}, policies=["greedy"])
    results = question.ask()  # simulates the missions that no question in the folder has

A sweep is a study of every combination of values; a what-if question is one of a scenario and
changes of it.
"""

import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, get_args

import numpy as np
import tomli_w
from pydantic import ValidationError

import dess
from dess import InputError
from dess.analysis.execution.effort import BASELINE as ANY_POLICY
from dess.analysis.execution.effort import Planned, check_run, plan_study, policies_for
from dess.analysis.execution.jobs import Progress
from dess.analysis.execution.runner import Round, run_shard, run_study
from dess.analysis.measured import refuse_neutral
from dess.analysis.metrics import AGE, ALIASES, LATE, LEAST, METRICS, OLDEST, column_in_sheet_unit
from dess.analysis.names import SWEEP, SWEEPS, field_in_words, value_of_field
from dess.analysis.results.chunks import MANIFEST, short_hash
from dess.analysis.results.provenance import engine_code, team_of
from dess.analysis.results.shards import Shard
from dess.analysis.results.tables import Results
from dess.analysis.sheet import scenario_notes
from dess.analysis.study.cheapest import Cheapest, Required
from dess.analysis.study.design import MAX_SIZE, GridDesign, TableDesign
from dess.analysis.study.fields import replications_of
from dess.analysis.study.prices import Costs
from dess.analysis.study.study import Study, study_from
from dess.base.commands import command_line
from dess.base.errors import shown, to_input_error, unknown_name
from dess.base.files.reading import paths_in
from dess.base.files.writing import is_read_only, toml_value, write_file
from dess.policies.registry import list_teams
from dess.scenario.fields import fields_of
from dess.scenario.scenario import ScenarioSpace, is_scenario_name, load_scenario
from dess.scenario.values import dotted

WHAT_IF = "what-if"
# Missions of every setting of a sweep, and of every side of a what-if question.
MISSIONS, MISSIONS_OF_SIDES = 300, 500
_LENGTHS = {"initial_data": 2, "zone": 4}  # of fields whose value is a list of numbers
LONGEST = 60  # largest number of characters for the fields in a name

# Missions in the search for the cheapest setting: at most, per setting on average and over all
# settings; and with how many of every setting it begins.
BUDGET, ALL, FIRST = 2_000, 1_000_000, 50
# For how many of a setting the choice of the policies leaves time. 20 settings of the scenario
# ``bay`` took 105 each, the 15 of the paper's sea in the README 120; those that just meet or just
# miss a requirement take more.
ROOM = 620
LITTLE = 0.01  # as a share of the prices: a saving that does not matter


@dataclass(frozen=True)
class Question:
    """A study that answers a question, and where it is kept.

    Attributes:
        study: The study.
        out: Its results folder, beside those of other questions of the same kind.
    """

    study: Study
    out: Path

    @cached_property
    def notes(self) -> list[str]:
        """Which nodes no UAV can serve, the highest collection ratio, and zones that are small."""
        return scenario_notes(self.study.scenarios)

    @property
    def file(self) -> Path:
        """The file of the study, which ``dess study run`` reads."""
        return self.out.parent / f"{self.out.name}.toml"

    @property
    def others(self) -> list[Path]:
        """The results folders of the other questions, whose missions are copied."""
        manifests = paths_in(self.out.parent, f"*/{MANIFEST}")
        return [path.parent for path in manifests if path.parent != self.out]

    def measured_column(self, metric: str, where: str = "metric") -> str:
        """The column of a metric of its missions, in the unit of a data sheet if possible.

        Args:
            metric: The metric, which may have a short name.
            where: What names it, for messages.

        Raises:
            InputError: If the missions do not measure it, or it ranks nothing.
        """
        measured = self.study.metrics
        column = column_in_sheet_unit(ALIASES.get(metric, metric), measured)
        if column not in measured:
            problem = f"{shown(metric)} is not measured"
            raise unknown_name(where, problem, metric, [*ALIASES, *measured])
        refuse_neutral(column, where)
        return column

    def plan(self, workers: int = 1) -> list[Planned]:
        """What ``ask`` would do, as ``plan_study`` says it; nothing is written."""
        return plan_study(self.study, self.out, workers, reuse=self.others)

    def ask(
        self,
        workers: int = 1,
        progress: Progress | None = None,
        announce: Callable[[Round], object] | None = None,
        yes: bool = False,
        scheduler: str | None = None,
    ) -> Results:
        """Write the file of the study, and simulate the missions that no question there has.

        Args:
            workers: Number of processes. Two or more take seconds to start; they help in long runs.
            progress: Called with the number of missions done since its last call.
            announce: Called before each round.
            yes: Whether a question of any length is allowed.
            scheduler: Address of a ``dask.distributed`` scheduler on which to run instead.

        Raises:
            InputError: Before anything is written, if a policy cannot act in the scenario, the
                question would take long, or another one has the same name; or if the folder cannot
                be written or is in use.
            ChunkError: If a chunk could not be computed; all others are complete.
        """
        reuse = self.others
        self._begin(workers, yes, reuse)
        return run_study(self.study, self.out, workers, scheduler, progress, announce, reuse=reuse)

    def ask_shard(
        self,
        shard: Shard,
        workers: int = 1,
        progress: Progress | None = None,
        announce: Callable[[Round], object] | None = None,
        yes: bool = False,
        scheduler: str | None = None,
    ) -> None:
        """Write the file of the study, and simulate a shard of it; nothing is copied.

        Args and errors are those of ``ask`` and ``run_shard``.
        """
        self._begin(workers, yes, shards=shard.total)
        run_shard(self.study, self.out, shard, workers, scheduler, progress, announce)

    def _begin(self, workers: int, yes: bool, reuse: Sequence[Path] = (), shards: int = 1) -> None:
        """Check that the question can be asked, and write the file of the study."""
        check_run(self.study, self.out, workers, reuse=reuse, yes=yes, shards=shards)
        data = self.study.model_dump(mode="json", exclude_unset=True)
        if not is_scenario_name(self.study.scenario):
            path = os.path.relpath(self.study.scenario, self.file.parent)
            data["scenario"] = Path(path).as_posix()
        if not (self.file.exists() and is_read_only(self.file.parent)):
            write_file(self.file, tomli_w.dumps(data))

    @property
    def command(self) -> str:
        """The command that asks the question again."""
        study = self.study
        design = self.study.design
        rule = self.study.selection
        if isinstance(design, TableDesign):
            asked = WHAT_IF
            before, after = design.rows
            sides = {"set": after, "baseline": study.set | before}
            options: dict[str, Any] = {
                side: _values_as_options({f: [value] for f, value in values.items()})
                for side, values in sides.items()
            }
            options["policy"] = list(study.policies)
        else:
            assert isinstance(design, GridDesign)
            asked = "sweep"
            fixed = {field: (value,) for field, value in study.set.items()}
            options = {"set": _values_as_options(fixed | design.values)}
            options["policy"] = ",".join(study.policies)
        replications = {"missions": study.missions}
        if study.years:
            replications = {"years": study.years}
        options |= replications | {"seed": study.seed}
        if study.scenario != "paper":
            options["scenario"] = Path(study.scenario).name
        if study.costs:
            options["price"] = study.costs.model_dump(exclude_unset=True)
        if isinstance(rule, Cheapest):
            options["require"] = rule.requirements
            if not study.years:
                options["missions"] = rule.check
        return command_line(asked, **options)


def _values_as_options(values: Mapping[str, Iterable[Any]]) -> dict[str, str]:
    """The values of every field in the syntax of ``--set``."""
    return {f: ",".join(map(toml_value, of_field)) for f, of_field in values.items()}


def _question_key(study: Study) -> str:
    """A hash of all that the records of a question depend on, without their number.

    So the same question with more missions adds to the same results folder.
    """
    of_selection = {"check"}
    if study.years:
        of_selection |= {"first", "budget"}
    of_number: Any = {"missions": True, "years": True, "selection": of_selection}
    data = study.model_dump(mode="json", exclude=of_number)
    about = {
        "version": dess.__version__,
        "engine": engine_code(),
        "teams": [
            team_of(policy, run_files=study.run_files).model_dump(mode="json")
            for policy in study.policies
        ],
        "base": load_scenario(study.scenario, **study.set).model_dump(mode="json"),
        "study": data | {"scenario": Path(study.scenario).name},
    }
    return short_hash(json.dumps(about, sort_keys=True).encode())


def sweep_question(
    values: Mapping[str, Sequence[Any]],
    scenario: str | Path = "paper",
    policies: Iterable[str] | None = None,
    missions: int | None = None,
    seed: int = 0,
    prices: Mapping[str, Any] | None = None,
    requirements: Mapping[str, float | str] | None = None,
    name: str | None = None,
    *,
    folder: str | Path = "results",
    years: int | None = None,
) -> Question:
    """Which combination of values is the best, or the cheapest that meets requirements?

    The arguments are those of ``analysis.sweep``, but each of the fields ``values`` has a list of
    values; one with a single value is fixed. It is kept in ``FOLDER/sweeps/NAME``.

    Raises:
        InputError: If a field, a value, a policy, a price or a requirement is not allowed.
    """
    _check_prices(prices)
    space = load_scenario(scenario, **{field: of_field[0] for field, of_field in values.items()})
    replications = replications_of(space, missions, years, MISSIONS)
    asked = replications.get("missions", MISSIONS)
    swept = {field: of_field for field, of_field in values.items() if len(of_field) > 1}
    fixed: dict[str, Any] = {field: values[field][0] for field in values if field not in swept}
    if AGE in (requirements or ()):
        fixed["age.measured"] = True
    if (
        requirements and space.units and "charging.measured" not in values
    ):  # for the rule of thumb beside the answer
        fixed["charging.measured"] = True
    if isinstance(policies, str):
        policies = [policies]
    data: dict[str, Any] = {
        "name": "sweep" if name is None else name,
        "description": SWEEP,
        "scenario": str(scenario),
        "set": fixed,
        "design": {"kind": "grid", "values": swept},
        "seed": seed,
    }
    if prices:
        data["costs"] = dict(prices)
    if requirements and space.weather.is_on:
        study = _validated_study(data | replications, "sweep", policies, 1)
        rule = _cheapest_rule(requirements, 0, study).of_years(study.first, study.size)
        study = study.model_copy(update={"selection": rule})
    elif requirements:
        study = _validated_study(data, "sweep", policies, max(ROOM, asked))
        rule = _cheapest_rule(requirements, asked, study)
        study = study.model_copy(update={"selection": rule})
    else:
        study = _validated_study(data | replications, "sweep", policies, asked)
    if name is None:
        name = f"{'-'.join(swept)[:LONGEST] or 'sweep'}-{_question_key(study)}"
        study = study.model_copy(update={"name": name})
    return Question(study, Path(folder) / SWEEPS / name)


def _check_prices(prices: Mapping[str, Any] | None) -> None:
    """Refuse a price that there is none of."""
    if unknown := [key for key in prices or () if key not in Costs.model_fields]:
        raise unknown_name("prices", f"{unknown[0]!r} is unknown", unknown[0], Costs.model_fields)


def _validated_study(
    data: Mapping[str, Any], what: str, policies: Iterable[str] | None, missions: int
) -> Study:
    """The study of a question, whose policies a user has typed.

    Args:
        data: The fields of the study without its policies.
        what: What they are of, for messages.
        policies: Its policies. Without any, the best policy that five minutes allow, and
            ``greedy``.
        missions: For how many missions of a design point this choice leaves time.
    """
    typed = list_teams([ANY_POLICY] if policies is None else policies)
    study = study_from({**data, "policies": typed}, what, run_files=True)
    if policies is None:
        return study.model_copy(update={"policies": policies_for(study.scenarios, missions)})
    return study


def _cheapest_rule(requirements: object, missions: int, study: Study) -> Cheapest:
    """The rule that searches for the cheapest setting that meets the requirements."""
    prices = study.costs
    if not prices:
        raise InputError("requirements", "need prices", "prices, such as uav=20000")
    if not isinstance(requirements, Mapping):
        allowed = "metrics and what is required of them, such as success=0.99"
        raise InputError("requirements", f"{shown(requirements)} is no table", allowed)
    least = {}
    for metric, share in requirements.items():
        full = ALIASES.get(metric, metric)
        if full not in get_args(Required):
            names = [*METRICS, *ALIASES, AGE, LEAST, OLDEST, LATE]
            raise unknown_name("requirements", f"{metric!r} is unknown", metric, names)
        least[full] = share
    spaces = study.scenarios
    most_uavs = max(space.uavs[1] for space in spaces)
    most_pads = max(space.charging_pads for space in spaces)
    price_of_uavs = max(prices.price_of_uavs(space, most_uavs) for space in spaces)
    fleet = prices.purchase_of(price_of_uavs, most_pads)
    worn = prices.pack / prices.pack_cycles
    running = prices.paid_missions * (prices.charge + prices.hour + (prices.lost_uav or 0.0) + worn)
    if not fleet and not running:
        raise InputError("prices", "all are 0", "one or more above 0")
    rule = {
        "procedure": "cheapest",
        "requirements": least,
        "indifference": LITTLE * (fleet or running),
        "budget": min(BUDGET * study.size, max(ALL, FIRST * study.size)),
        "first": FIRST,
        "check": missions,
    }
    try:
        cheapest_rule = Cheapest.model_validate(rule)
        cheapest_rule.check_requirements(spaces)
        return cheapest_rule
    except ValidationError as error:
        raise to_input_error(error, "sweep: selection: cheapest", Cheapest) from None


def what_if_question(
    settings: Mapping[str, Any],
    baseline: Mapping[str, Any] | None = None,
    scenario: str | Path = "paper",
    policies: Sequence[str] | None = None,
    missions: int | None = None,
    seed: int = 0,
    folder: str | Path = "results",
    *,
    prices: Mapping[str, Any] | None = None,
    years: int | None = None,
) -> Question:
    """What if the baseline had these settings? The arguments are those of ``analysis.what_if``.

    Where fields of a section are set, both sides measure what the section can measure. It is kept
    in ``FOLDER/what-if/HASH``.

    Raises:
        InputError: If a field, a value, a policy or a price is unknown or not allowed, or if
            ``settings`` changes nothing.
    """
    _check_prices(prices)
    for name, values in (("settings", settings), ("baseline", baseline or {})):
        if not isinstance(values, Mapping):
            raise InputError(name, repr(values), "fields and values, such as {uavs=5}")
    fixed = dotted(dict(baseline or {}))
    changed = dotted(dict(settings))
    measuring = {field for field in changed if field.endswith(".measured")}
    if changed.keys() - measuring:  # what changes is something else, which both sides measure
        fixed |= {field: changed.pop(field) for field in sorted(measuring)}
    fixed = _fields_to_measure(fixed | changed) | fixed
    base = load_scenario(scenario, **fixed)
    _check_changes(base, load_scenario(scenario, **fixed | changed), changed)
    replications = replications_of(base, missions, years, MISSIONS_OF_SIDES)
    for name, number in replications.items():
        if isinstance(number, int) and number < 2:
            raise InputError(name, f"{number} is too few", "2 or more")
    before = {field: fixed[field] for field in changed if field in fixed}
    data = {
        "name": WHAT_IF,
        "description": "a variation compared with its baseline, on the same missions",
        "scenario": str(scenario),
        "set": {field: value for field, value in fixed.items() if field not in changed},
        "design": {"kind": "table", "rows": [before, changed]},
        **replications,
        "seed": seed,
    }
    if prices:
        data["costs"] = dict(prices)
    asked = replications.get("missions", 1)
    study = _validated_study(data, "question", policies, asked)
    return Question(study, Path(folder) / WHAT_IF / _question_key(study))


def _check_changes(before: ScenarioSpace, after: ScenarioSpace, changed: Iterable[str]) -> None:
    """Refuse a variation that changes nothing, or sets a field to its value in the baseline."""
    for field in changed:
        if value_of_field(before, field) == value_of_field(after, field):
            raise InputError(
                "settings",
                f"{field} is {field_in_words(before, field)} in the baseline already",
                "another value",
            )
    if not changed:
        allowed = ", ".join(fields_of(ScenarioSpace))
        raise InputError("settings", "none is given", f"one or more of {allowed}")


def _fields_to_measure(values: Iterable[str]) -> dict[str, bool]:
    """The fields that measure what belongs to the sections of these fields, without those given."""
    sections = {section for section, dot, _ in (field.partition(".") for field in values) if dot}
    measuring = fields_of(ScenarioSpace).keys() & {f"{section}.measured" for section in sections}
    return dict.fromkeys(sorted(measuring - {*values}), True)


def values_of(field: str, given: Any) -> tuple[Any, ...]:
    """The values of a field, as a tuple.

    Args:
        field: The field.
        given: A value, or a list, tuple, range or array of values.

    Raises:
        InputError: If there is none, or there are too many.
    """
    if _is_value(field, given):
        return (_as_toml_value(given),)
    return list_values(field, given)


def list_values(field: str, given: Sequence[Any] | np.ndarray) -> tuple[Any, ...]:
    """One or several values of a field, in the types of TOML.

    Raises:
        InputError: If there is none, or there are too many.
    """
    if isinstance(given, range):  # ``len`` fails for more than 2^63
        count = max(0, -((given.start - given.stop) // given.step))
    else:
        count = len(given)
    if not 0 < count <= MAX_SIZE:
        counted = f"{count:,}" if count else "no"
        raise InputError(field, f"has {counted} values", f"1 to {MAX_SIZE:,}")
    return tuple(map(_as_toml_value, given))


def _is_value(field: str, given: Any) -> bool:
    """Whether ``given`` is one value of the field, and not several values."""
    if hasattr(given, "ndim"):  # an array of numpy or a column of pandas
        return given.ndim == 0
    if not isinstance(given, Sequence) or isinstance(given, str):
        return True
    if isinstance(given, range):
        return False
    if field == "nodes":
        return all(_are_numbers(cell, 2) for cell in given) and len(given) > 0
    return _are_numbers(given, _LENGTHS.get(field))


def _are_numbers(given: Any, length: int | None) -> bool:
    """Whether ``given`` is a list of so many numbers."""
    is_list = isinstance(given, list | tuple) and len(given) == length
    return is_list and all(isinstance(item, int | float | np.number) for item in given)


def _as_toml_value(value: Any) -> Any:
    """A value in the types of TOML, without numpy types and tuples."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_as_toml_value(item) for item in value]
    return value
