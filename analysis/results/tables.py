"""The results of a study as tables."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, wraps
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar

import numpy as np
import pandas as pd

from dess import InputError
from dess.analysis.bound import Bound
from dess.analysis.metrics import BOUND, GAP, PRODUCT, metric_group
from dess.analysis.names import SWEEP, SWEEPS
from dess.analysis.results import commands
from dess.analysis.results.manifest import Cell, Manifest
from dess.analysis.results.store import Store
from dess.analysis.study.cheapest import Cheapest, CheapestChoice
from dess.analysis.study.fields import StudyData
from dess.analysis.study.prices import Costs
from dess.analysis.study.selection import Choice, Selection
from dess.base.errors import unknown_name
from dess.model.record import MISSION_RECORD
from dess.scenario.scenario import ScenarioSpace

Given = ParamSpec("Given")
Found = TypeVar("Found")


def compute_once(
    ask: Callable[Concatenate["Results", Given], Found],
) -> Callable[Concatenate["Results", Given], Found]:
    """Let a function of results compute its answer once for the same results and arguments.

    A table is returned as a copy, which the caller may change.
    """

    @wraps(ask)
    def known(results: "Results", *args: Given.args, **named: Given.kwargs) -> Found:
        key = ask, repr(args), repr(named)
        if key not in results.answers:
            results.answers[key] = ask(results, *args, **named)
        answer = results.answers[key]
        if isinstance(answer, pd.DataFrame):
            return answer.copy()
        return answer

    return known


@dataclass(frozen=True, eq=False)
class Results:
    """The results of a study.

    Attributes:
        store: The results folder.
        missions: One row per mission: ``policy``, ``point`` (number of the design point), the
            fields that the design sets and that are not in the record, and the fields of
            ``MISSION_RECORD``, then those of ``OPERATIONS`` that were measured, with nan where a
            mission lacks one. Rows are in the order of the policies in the study, then of point
            and replication. ``most_slots`` is the longest that each may last, and ``most_waiting``
            the longest that a UAV may wait for a pad in it; ``idle`` is how long nodes were idle
            before it, if any were. If the study has prices, ``cost`` comes next, with
            ``least_cost`` and ``most_cost``, between which each mission lies; with a data sheet,
            times and data follow in units, such as ``age_h``. If it has bounds, the last columns
            are ``upper_bound``, and ``optimality_gap``: the bound minus the product.
        uavs: One row per UAV of each mission: ``policy``, ``point``, ``replication``, ``uav`` and
            the fields of ``UAV_RECORD``, with ``end`` as a name.
        checks: Further missions, in rows as above, of the design points that were selected; the
            selection was not based on them. Empty if the study selects nothing.
        bounds: The upper bound of every mission by design point and replication, the same for all
            policies. Empty if the study has no bounds.
        answers: What functions of these results have computed, see ``compute_once``.
    """

    store: Store
    missions: pd.DataFrame
    uavs: pd.DataFrame
    checks: pd.DataFrame
    bounds: dict[tuple[int, int], Bound]
    answers: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)

    @property
    def manifest(self) -> dict[str, Any]:
        """The manifest of the results, as plain data."""
        return self.store.manifest.data

    @property
    def study(self) -> StudyData:
        """The study, with the name of its scenario in place of a path."""
        return self.store.manifest.study

    @property
    def replications_head(self) -> str:
        """The head of a column with numbers of missions or years."""
        return f"{self.study.replication_name.capitalize()}s"

    @property
    def prices(self) -> Costs:
        """The prices of the study.

        Raises:
            InputError: If it has none.
        """
        prices = self.study.costs
        if prices is None:
            raise InputError(
                self.store.folder, "the study has no prices", "one with a table [costs]"
            )
        return prices

    @cached_property
    def policies(self) -> list[str]:
        """The teams, as the study names them."""
        return [team.policy for team in self.store.manifest.policies]

    @property
    def design(self) -> str:
        """The kind of the design; the scenario alone is a grid."""
        if self.study.design:
            return self.study.design.kind
        return "grid"

    def scenario(self, point: int = 0) -> ScenarioSpace:
        """The scenario of a design point."""
        return self.store.manifest.scenarios[point]

    def given_values(self, point: int = 0) -> dict[str, Any]:
        """The fields of the study's scenario that a design point sets, as they were given."""
        return dict(self.study.set) | dict(self.store.manifest.points[point].values)

    def events(self, policy: str, point: int = 0, replication: int = 0) -> pd.DataFrame:
        """The event log of a mission, with the columns of ``dess.model.events.EventLog``.

        Raises:
            InputError: If it has not been stored.
        """
        cell = self.cell(policy, point)
        logged = self.study.logged
        log = None
        if replication in range(logged):
            log = self.store.contents.load_log(cell, replication)
        if log is None:
            raise InputError(
                self.store.folder,
                f"no event log of {policy}, point {point}, replication {replication}",
                f"0..logged - 1, logged = {logged}",
            )
        return log.to_pandas()

    @property
    def usual_folder(self) -> str:
        """The folder that ``dess study run`` or ``dess sweep`` keeps the study in, for pages.

        Pages name no other one, so that they do not depend on where the results are.
        """
        within = ""
        if self.study.description == SWEEP:
            within = f"{SWEEPS}/"
        return f"results/{within}{self.study.name}"

    def command(
        self, policy: str, point: int, replication: int, folder: str | Path | None = None
    ) -> str:
        """The command that simulates a mission of the study again.

        Args:
            policy: The team.
            point: The number of its design point.
            replication: Of the mission.
            folder: The results folder that the command reads the scenario from. Without it, the
                command is longer and sets the fields of the scenario itself.
        """
        cell = self.cell(policy, point)
        manifest = self.store.manifest
        if folder is None:
            return commands.of_fields(manifest, policy, manifest.points[point].values, replication)
        return commands.of_folder(folder, manifest, cell, replication)

    def choice(self, policy: str) -> Choice | None:
        """The design point that was selected as the best for a policy, with its guarantee."""
        return self._chosen(policy, Selection)

    def cheapest(self, policy: str) -> CheapestChoice | None:
        """The cheapest settings of a policy that meet the requirements of the study."""
        return self._chosen(policy, Cheapest)

    @compute_once
    def _chosen(self, policy: str, kind: type) -> Any:
        """What a rule of this kind has selected for a policy; None if the study has another."""
        self.check_policy(policy)
        manifest = self.store.manifest
        rule = self.study.selection
        if not rule or not isinstance(rule, kind):
            return None
        parts = manifest.parts_of_team(self.policies.index(policy))
        return rule.choice(self.store.samples(parts), manifest.settings)

    def analyses(self, policy: str) -> np.ndarray:
        """How often a search could have ended the missions of each design point of a policy.

        Returns:
            (points,) numbers; 0 where the number of missions does not depend on their results: in a
            study that selects nothing, and of the check of a selection.
        """
        selected = self.choice(policy) or self.cheapest(policy)
        if selected is None or self.missions is self.checks:
            return np.zeros(len(self.store.manifest.points), int)
        return np.array(selected.analyses)

    def missions_of(self, policy: str | None) -> pd.DataFrame:
        """The missions of a policy; without one, those of all.

        Raises:
            InputError: If it is not in the study.
        """
        if policy is None:
            return self.missions
        self.check_policy(policy)
        return self.missions[self.missions["policy"] == policy]

    def check_policy(self, policy: str) -> None:
        """Refuse a policy that is not in the study.

        Raises:
            InputError: If it is not.
        """
        if policy not in self.policies:
            raise unknown_name("policy", f"{policy!r} is not in the study", policy, self.policies)

    def cell(self, policy: str, point: int) -> Cell:
        """The cell of a policy at a design point, with its key.

        Raises:
            InputError: If the study has no such policy or point.
        """
        self.check_policy(policy)
        points = len(self.store.manifest.points)
        if not 0 <= point < points:
            raise InputError("point", f"{point} is not in the study", f"0..{points - 1}")
        return self.store.manifest.cells[self.policies.index(policy)][point]


def load_results(out: str | Path) -> Results:
    """Load the results of a study.

    Raises:
        InputError: If it is not a results folder, or the results are incomplete, damaged or of
            another version.
    """
    return results_of(Store.read(out))


def results_of(store: Store) -> Results:
    """The results in an open folder.

    Raises:
        InputError: If they are incomplete or damaged.
    """
    manifest = store.manifest
    missions, uavs, checks = {}, {}, {}
    for number, team in enumerate(manifest.policies):
        parts = manifest.parts_of_team(number)
        missions[team.policy] = store.missions(parts)
        uavs[team.policy] = store.uavs(parts)
        if checked := manifest.parts_of_check(number):
            checks[team.policy] = store.missions(checked)
    if not manifest.complete:
        raise InputError(store.folder, "incomplete", "run the study again to complete it")
    all_missions = _label_missions(manifest, missions)
    if checks:
        all_checks = _label_missions(manifest, checks)
    else:
        all_checks = all_missions[:0]
    bounds = store.bounds_of(manifest.parts_with_bounds())
    if bounds:
        all_missions = _with_gaps(all_missions, bounds)
    return Results(store, all_missions, _of_policies(uavs), all_checks, bounds)


def load_begun(out: str | Path) -> Results:
    """Load what there is of a study that was interrupted, or still runs.

    Returns:
        The missions of every policy and design point up to the first one that is missing, and their
        UAVs; no checks and no bounds. What was selected is not known.

    Raises:
        InputError: If it is not a results folder, or it has no missions yet.
    """
    store = Store.read(out)
    missions, uavs = {}, {}
    for number, team in enumerate(store.manifest.policies):
        if parts := store.begun(number):
            missions[team.policy] = store.missions(parts)
            uavs[team.policy] = store.uavs(parts)
    if not missions:
        raise InputError(store.folder, "has no missions yet", "run the study again to complete it")
    table = _label_missions(store.manifest, missions)
    return Results(store, table, _of_policies(uavs), table[:0], {})


def _with_gaps(missions: pd.DataFrame, bounds: Mapping[tuple[int, int], Bound]) -> pd.DataFrame:
    """The missions with their bounds, and how far each is below its bound."""
    places = zip(missions["point"], missions["replication"], strict=True)
    bound = np.array([bounds[place].ratio for place in places])
    return missions.assign(**{BOUND: bound, GAP: bound - missions[PRODUCT]})


def _of_policies(tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """The tables of all policies as one table, whose first column is ``policy``."""
    table = pd.concat(tables.values(), ignore_index=True)
    table.insert(0, "policy", np.repeat([*tables], [len(rows) for rows in tables.values()]))
    return table


def _label_missions(manifest: Manifest, missions: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """The missions of all policies, with the fields that the design sets and no record has."""
    table = _of_policies(missions)
    beyond = metric_group("operations", in_units=True)
    table = table.drop(columns=[m for m in beyond if m in table and table[m].isna().all()])
    for position, (name, values) in enumerate(_swept_fields(manifest).items(), 2):
        table.insert(position, name, table["point"].map(dict(enumerate(values))))
    return table


def _swept_fields(manifest: Manifest) -> dict[str, list[Any]]:
    """The fields that the design sets and no record has, by design point.

    A field that a point does not set has the value of the scenario. Values are JSON text where some
    of them are lists.
    """
    designs = manifest.values
    swept = {}
    for name in [name for name in designs[0] if name not in (MISSION_RECORD.names or ())]:
        values = [design[name] for design in designs]
        listed = any(isinstance(value, list) for value in values)
        swept[name] = [json.dumps(v) if listed else v for v in values]
    return swept
