"""A study: the missions that are to be simulated, and what is asked of them."""

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cached_property, lru_cache
from itertools import product
from pathlib import Path
from typing import Any, Self

from pydantic import (
    PrivateAttr,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from dess import InputError
from dess.analysis.bound import check_scenario
from dess.analysis.measured import metrics_of_scenario, refuse_neutral, told_metrics
from dess.analysis.metrics import BOUND, COST, GAP, metric_of
from dess.analysis.study.cheapest import Cheapest
from dess.analysis.study.design import DesignPoint, Saltelli, Sampled
from dess.analysis.study.fields import MOST_CHARACTERS, YEARS, Engine, StudyData
from dess.analysis.study.selection import Selection
from dess.base.commands import command_line
from dess.base.errors import cut, listed, to_input_error
from dess.model.batch import check_slotted
from dess.policies.registry import load_team
from dess.scenario.scenario import (
    SEA,
    ScenarioSpace,
    changed,
    load_scenario,
    scenario_at,
    validated,
)

# The name or the path of a study that a user has typed, and the fields that replace those there.
Origin = tuple[str, dict[str, Any]]


def engine_of(
    spaces: Sequence[ScenarioSpace], asked: Engine | None = None, processes: Sequence[str] = ()
) -> Engine:
    """The engine for missions of some scenarios: the one that was asked for, or the fastest.

    Args:
        spaces: The scenarios.
        asked: The engine that was asked for, if any.
        processes: The processes of the user in every mission.

    Raises:
        InputError: If the batch engine was asked for, and one of the scenarios or a process needs
            the other.
    """
    if asked is None:
        if processes or any(space.needs_events for space in spaces):
            return "events"
        return "batch"
    if asked == "batch":
        check_slotted(spaces)
        if processes:
            raise InputError("engine", "batch runs no processes", "events")
    return asked


class Study(StudyData):
    """A study: every policy at every design point, in a number of replications.

    All policies and all design points use the same replications (common random numbers). The number
    of replications of a design point is ``missions``, or is decided during the run by ``precision``
    or ``selection``. ``load_study`` reads a study from a file and reports errors in one line.

    Raises:
        pydantic.ValidationError: If a field, a policy or a design point's scenario is not valid.
    """

    _origin: Origin = PrivateAttr(("", {}))
    _run_files: bool = PrivateAttr(False)
    _processes: tuple[str, ...] = PrivateAttr(())

    @property
    def run_files(self) -> bool:
        """Whether Python files may be run as its policies, since a user has typed them."""
        return self._run_files

    @property
    def processes(self) -> tuple[str, ...]:
        """Processes of Python files in every mission; a user has typed them, no data names any."""
        return self._processes

    def model_post_init(self, context: Any) -> None:
        """Keep what a user has typed: processes, and whether files of policies may be run."""
        self._run_files = _may_run_files(context)
        self._processes = tuple(context["processes"]) if context else ()
        self._origin = context["origin"] if context else ("", {})

    @field_validator("policies")
    @classmethod
    def _are_known(cls, teams: tuple[str, ...], info: ValidationInfo) -> tuple[str, ...]:
        teams = tuple(",".join(name.strip() for name in team.split(",")) for team in teams)
        for team in teams:
            load_team(team, run_files=_may_run_files(info.context))
            if teams.count(team) > 1:
                raise InputError("", f"{team} is listed twice", "distinct teams")
        return teams

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        self._count_years()
        self._check_rule()
        self._check_points()
        self._check_metrics()
        self._choose_engine()
        if self.logged > self.first:
            raise InputError(
                "logged", f"{self.logged} is more than the missions", f"0..{self.first}"
            )
        self._check_budget()
        self._check_teams()
        if self.bounds:
            if self.processes:
                raise InputError("bounds", "are of missions without processes", "either")
            for space in self.scenarios:
                check_scenario(space)
        return self

    @property
    def metrics(self) -> list[str]:
        """The metrics that missions have at one design point or more."""
        measured = {name for space in self.scenarios for name in metrics_of_scenario(space)}
        if all(space.units for space in self.scenarios):
            measured |= {metric_of(name).in_units.column for name in measured}
        if self.bounds:
            measured |= {BOUND, GAP}
        if self.costs:
            measured |= {COST}
        return told_metrics(measured)

    def _choose_engine(self) -> None:
        """Take the SimPy engine if the study does not say which and a design point needs it."""
        asked = None
        if "engine" in self.model_fields_set:
            asked = self.engine
        # The model is frozen, and this is a part of its making.
        engine = engine_of(self.scenarios, asked, self.processes)
        object.__setattr__(self, "engine", engine)

    def _count_years(self) -> None:
        """Count replications in years where scenarios have weather: a selection has all of them."""
        has_weather = {space.weather.is_on for space in self.scenarios}
        if has_weather != {True}:
            if len(has_weather) > 1:
                raise InputError("design", "only some design points have weather", "all, or none")
            if self.years is not None:
                raise InputError("years", "are of scenarios with weather", "missions")
            return
        for name in ("missions", "precision"):
            if name in self.model_fields_set:
                raise InputError(name, "with weather, replications are years", "years")
        if self.bounds or self.logged:
            name = "bounds" if self.bounds else "logged"
            raise InputError(name, "are of single missions", "without them, with weather")
        years = self.years or YEARS
        object.__setattr__(self, "years", years)
        if isinstance(self.selection, Selection):
            raise InputError("selection", "needs missions", "procedure = cheapest, with weather")
        if self.selection:
            rule = self.selection.of_years(years, self.size)
            object.__setattr__(self, "selection", rule)

    def _check_rule(self) -> None:
        if self.precision and self.selection:
            raise InputError("precision", "selection is also given", "either")
        if self.rule and "missions" in self.model_fields_set:
            if self.precision:
                rule = "precision"
            else:
                rule = "selection"
            raise InputError("missions", f"are decided by {rule}", "either")
        if self.is_search and not self.costs:
            raise InputError(
                "costs", "are missing", "a table of prices, for the selection of the cheapest"
            )
        if self.costs:
            self.costs.check(self.scenarios)
        if isinstance(self.design, Saltelli) and (self.rule or self.missions != 1):
            raise InputError(
                "missions", "every point of a saltelli design is one mission", "missions = 1"
            )

    def _check_metrics(self) -> None:
        """Check that every design point measures what the rule decides by."""
        if self.precision:
            key = "precision.targets"
            asked = {*self.precision.targets}
        elif isinstance(self.selection, Selection):
            key = "selection.metric"
            asked = {self.selection.metric}
            refuse_neutral(self.selection.metric, key)
        elif isinstance(self.selection, Cheapest):
            self.selection.check_requirements(self.scenarios)
            return
        else:
            return
        for space in self.scenarios:
            measured = metrics_of_scenario(space)
            if absent := sorted(asked - {*measured}):
                raise InputError(
                    key, f"{absent[0]} is not measured at every design point", listed(measured)
                )

    def _check_budget(self) -> None:
        """Check that the budget of a selection is enough for its first round."""
        least = self.first * self.size
        if self.selection and least > self.selection.budget:
            raise InputError(
                "selection.budget",
                f"{self.selection.budget} is less than the first missions of all design points",
                f"{least} or more",
            )

    def _check_teams(self) -> None:
        """No policy of a team may be without a UAV at every design point."""
        fleet = max(space.uavs[1] for space in self.scenarios)
        for team in self.policies:
            if team.count(",") >= fleet:
                raise InputError(
                    "policies",
                    f"{team} has more policies than the largest fleet has UAVs",
                    f"{fleet} at most",
                )

    def command(self, out: Path) -> str:
        """The command that runs the study in a folder, if it was read by ``load_study``."""
        name, changes = self._origin
        given = {"policy": changes.get("policies"), "missions": changes.get("missions")}
        given["process"] = self.processes
        return command_line("study", "run", name or self.name, **given, out=out)

    @cached_property
    def _base(self) -> ScenarioSpace:
        """The scenario that the design points change."""
        return load_scenario(self.scenario, **self.set)

    @cached_property
    def _fields(self) -> str:
        """The fields of ``_base``: its file is read once, and not for every design point."""
        return json.dumps(self._base.model_dump(mode="json"))

    @property
    def points(self) -> tuple[DesignPoint, ...]:
        """The design points in the order of the design.

        Raises:
            InputError: If there are too many.
        """
        if self.design:
            return self.design.points
        return (DesignPoint({}),)

    @cached_property
    def scenarios(self) -> tuple[ScenarioSpace, ...]:
        """The scenario of every design point.

        Raises:
            InputError: If a design point has no valid scenario.
        """
        return tuple(self._scenario_at(point.values) for point in self.points)

    def _check_points(self) -> None:
        """Check that every design point has a scenario, and is listed once."""
        for point in self.points:
            if both := sorted(self.set.keys() & point.values.keys()):
                raise InputError("design", f"{both[0]} is also in set", "either")
        checked = set()
        for point, space in zip(self.points, self.scenarios, strict=True):
            # As the scenario has the values, which is the same for 1 and 1.0.
            key = frozenset((f, v if f == SEA else space.value(f)) for f, v in point.values.items())
            if key in checked and not isinstance(self.design, Sampled):  # equal integers by chance
                shown = _values_in_words(point.values)
                raise InputError("design", f"{shown} is listed twice", "once")
            checked.add(key)

    def _scenario_at(self, values: dict[str, Any]) -> ScenarioSpace:
        if not values.keys() & {SEA, "grid", "rows", "cell_size"}:  # these move nodes of a file
            # An error is raised below, in the words of the scenario's file.
            with suppress(InputError, TypeError, ValueError):
                return change_scenario(self._fields, json.dumps(values))
        try:
            space = scenario_at(self.scenario, values, **self.set)
            for field, cells in product(("grid", "rows", "cell_size"), ("nodes", "no_fly")):
                moves = getattr(space, cells) != getattr(self._base, cells)
                if values.keys() & {field, cells, SEA} == {field} and moves:
                    raise InputError("", f"{field} moves the {cells} of a file", "cells")
            return space
        except InputError as error:
            if values:
                raise error.within(f"at {_values_in_words(values)}") from None
            raise


@lru_cache(maxsize=2**15)
def change_scenario(scenario: str, values: str) -> ScenarioSpace:
    """A scenario with other values, both as JSON: a study and its manifests ask for it many times.

    Raises:
        InputError: If it is not valid.
    """
    fields = changed(json.loads(scenario), json.loads(values), "scenario")
    return validated(ScenarioSpace, fields, "scenario")


def _may_run_files(context: dict[str, Any] | None) -> bool:
    """Whether what validates a study says that Python files may be run."""
    return bool(context and context["run_files"])


def study_from(
    data: Mapping[str, Any],
    what: str,
    *,
    run_files: bool = False,
    processes: Sequence[str] = (),
    origin: Origin = ("", {}),
) -> Study:
    """The study with these fields.

    Args:
        data: The fields.
        what: What the fields are of, for messages.
        run_files: Whether Python files may be run as policies, since a user has typed them.
        processes: Processes of Python files, which a user has typed.
        origin: Where the fields are from, for ``command``.

    Raises:
        InputError: If they are not valid; ``what`` is named before the reason.
    """
    try:
        context = {"run_files": run_files, "processes": processes, "origin": origin}
        return Study.model_validate(data, context=context)
    except ValidationError as error:
        raise to_input_error(error, what, Study) from None


def _values_in_words(values: dict[str, Any]) -> str:
    text = ", ".join(f"{key}={value}" for key, value in values.items())
    return cut(text, MOST_CHARACTERS) or "the scenario as it is"
