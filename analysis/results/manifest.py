"""The manifest of a results folder: the study, what it was run with, and the keys of its cells."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property, lru_cache
from hashlib import sha256
from pathlib import Path, PurePath
from typing import Annotated, Any, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

import dess
from dess import InputError
from dess.analysis.results import provenance
from dess.analysis.study.cheapest import Setting
from dess.analysis.study.design import DesignPoint
from dess.analysis.study.fields import CHECK, StudyData
from dess.analysis.study.study import Study
from dess.base.files.documents import Sha256
from dess.scenario.data_sheet import Units
from dess.scenario.scenario import SEA, ScenarioSpace, load_scenario

SCHEMA_VERSION = 3
PROGRESS = {"missions", "selected", "complete"}  # what a run changes in its manifest
NO_TEAM = -1  # the team of the cells of bounds, which hold for every policy

# What is selected for a team: a design point, or one for each question; None without a selection.
Selected = int | list[int] | None


class Cell(NamedTuple):
    """A team at a design point, given by their numbers, or the bounds of a design point.

    ``key`` is a hash of all that the records depend on, except the replication. ``first`` is the
    first replication.
    """

    team: int
    point: int
    key: str
    first: int


@dataclass(frozen=True)
class CellPart:
    """Consecutive replications of a cell."""

    cell: Cell
    replications: range

    def __len__(self) -> int:
        """The number of missions."""
        return len(self.replications)


class Manifest(provenance.Origin):
    """The manifest of a results folder.

    It contains neither a time nor a path, so equal runs have equal manifests.

    Attributes:
        missions: Number of missions needed of every team at every design point. It grows during the
            run if a rule decides it.
        selected: For every team the selected design point, or the list of selected points if one is
            selected for each of several conditions; None if the study selects nothing.
        complete: Whether all missions are present.
        bound_code: A hash of the code of the bound at the first run, which is part of the keys of
            the bounds; None if the study has no bounds.
    """

    schema_version: int
    points: list[DesignPoint] = Field(min_length=1)
    missions: list[list[Annotated[int, Field(ge=1, le=CHECK)]]]
    selected: list[Selected]
    complete: bool
    bound_code: Sha256 | None = None

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        names = [team.policy for team in self.policies]
        study = self.study
        if len({*names}) < len(names):
            raise ValueError("policies: one is listed twice")
        shape = [len(self.points)] * len(names)
        if [*map(len, self.missions)] != shape or len(self.selected) != len(names):
            raise ValueError("missions, selected: not one for every policy and design point")
        teams = range(len(names))
        if not {p for team in teams for p in self.selected_points(team)} <= {*range(*shape[:1])}:
            raise ValueError("selected: is not a design point")
        if study.selection is None and any(selected is not None for selected in self.selected):
            raise ValueError("selected: the study selects nothing")
        if study.bounds != bool(self.bound_code):
            raise ValueError("bound_code: does not belong to the bounds of the study")
        if study.size != len(self.points):
            raise ValueError("points: are not those of the design")
        self.scenarios  # noqa: B018 - they are checked when they are made
        return self

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with other values; its cells are made again only if they may be others."""
        copy = super().model_copy(update=update)
        if {*(update or ())} <= PROGRESS:
            cached = self.__dict__.keys() - type(self).model_fields.keys()
            copy.__dict__.update({name: self.__dict__[name] for name in cached})
        return copy

    def selected_points(self, team: int) -> list[int]:
        """The design points that were selected for a team; none, if the study selects nothing."""
        selected = self.selected[team]
        if isinstance(selected, int):
            return [selected]
        return selected or []

    @classmethod
    def of(cls, study: Study) -> "Manifest":
        """The manifest of a study that is run by this code."""
        # The path of a scenario file does not matter, since its content is stored.
        data = study.model_dump(mode="json") | {"scenario": PurePath(study.scenario).name}
        base = load_scenario(study.scenario, **study.set)
        points = json.loads(json.dumps([*map(asdict, study.points)]))
        return cls(
            schema_version=SCHEMA_VERSION,
            version=dess.__version__,
            code=provenance.code_behind(
                study.policies, study.bounds, study.processes, run_files=study.run_files
            ),
            engine_code=provenance.engine_code(),
            accepted=[],
            commit=provenance.commit_of_source(),
            libraries=provenance.library_versions(),
            seed=study.seed,
            study=StudyData.model_validate(data),
            scenario=base.model_dump(mode="json"),
            policies=[
                provenance.team_of(policy, run_files=study.run_files) for policy in study.policies
            ],
            points=points,
            missions=[[study.first] * len(points)] * len(study.policies),
            selected=[None] * len(study.policies),
            complete=False,
            bound_code=provenance.bound_code() if study.bounds else None,
            processes=[provenance.identify_process(process) for process in study.processes],
        )

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a manifest of this version.

        Raises:
            InputError: If the file does not exist, is damaged, or has another version.
        """
        made_by = {"version": dess.__version__, "schema_version": SCHEMA_VERSION}
        return cls.load(path, _ALLOWED, "a results folder, made by dess study run", made_by)

    def extended_to(self, new: "Manifest", path: Path, accepting: int | None) -> "Manifest":
        """The manifest of a folder with these results, after a new run has added to them.

        The new run must be of the same study or of an extension of it. Cells keep their keys, so
        that their missions are found even if other code was accepted.

        Args:
            new: The manifest of the run.
            path: The path of this manifest, for messages.
            accepting: Number of missions in the folder if missions of other code are accepted, None
                if they are not.

        Raises:
            InputError: If the results would not belong together.
        """
        self._check_extended_by(new, path)
        changes = provenance.differing_modules(self.code, new.code)
        if changes and accepting is None:
            modules = ", ".join(changes)
            raise InputError(
                path, f"made by other code of {modules}", f"{_ALLOWED}, or --accept-code"
            )
        accepted = []
        if changes:
            accepted = [provenance.Acceptance(modules=changes, missions=accepting or 0)]
        old_teams = {team.policy: team for team in self.policies}
        update: dict[str, Any] = {
            "engine_code": self.engine_code,
            "bound_code": self.bound_code or new.bound_code,
            "policies": [old_teams.get(team.policy, team) for team in new.policies],
            "accepted": self.accepted + accepted,
            "processes": self.processes,
        }
        if self.study == new.study and self.points == new.points:
            update |= {name: getattr(self, name) for name in PROGRESS}
        return new.model_copy(update=update)

    def _check_extended_by(self, new: "Manifest", path: Path) -> None:
        name = new.study.name
        kept_name = self.study.name
        teams = {team.policy: team.weights for team in new.policies}
        dropped = [team.policy for team in self.policies if team.policy not in teams]
        changed = [t.policy for t in self.policies if teams.get(t.policy) != t.weights]
        processes = self.functions
        is_same = (self.scenario, self.points) == (new.scenario, new.points)
        foreign = not is_same and not set(self._point_keys) <= set(new._point_keys)
        complaints = {
            f"holds study {kept_name}, not {name}": kept_name != name,
            f"holds seed {self.seed}, not {new.seed}": self.seed != new.seed,
            f"holds missions with {processes}, not with {new.functions}": processes
            != new.functions,
            f"holds other scenarios than those of study {name}": foreign,
            f"holds policy {' '.join(dropped)}, which study {name} does not have": bool(dropped),
            f"made by other weights of policy {' '.join(changed)}": bool(changed),
            f"holds bounds, which study {name} does not have": bool(
                self.bound_code and not new.bound_code
            ),
        }
        for complaint, holds in complaints.items():
            if holds:
                raise InputError(path, complaint, _ALLOWED)

    @property
    def functions(self) -> str:
        """The processes of the user in words."""
        names = [identity.function for identity in self.processes]
        return f"process {', '.join(names)}" if names else "no process"

    @property
    def key(self) -> str:
        """A hash of all that the records depend on, and of their number."""
        keys = [cell.key for cells in self.cells for cell in cells]
        accepted = [change.data for change in self.accepted]
        bounds = []
        if self.bound_code:
            bounds = [[cell.key for cell in self.bound_cells]]
        content = _canonical_json([keys, self.missions, self.selected, accepted, *bounds])
        return sha256(content.encode()).hexdigest()[:16]

    def units_at(self, points: np.ndarray) -> Units | None:
        """What a slot, a cell and a data unit are at (n,) design points; None without sheets."""
        units = [space.units for space in self.scenarios]
        if all(units):
            return Units(*np.array(units)[points].T)
        return None

    @cached_property
    def settings(self) -> list[Setting]:
        """The design points, for the search for the cheapest setting; none without prices."""
        if not (costs := self.study.costs):
            return []
        points = zip(self.values, self.scenarios, strict=True)
        return [Setting.of(values, space, costs) for values, space in points]

    @cached_property
    def values(self) -> list[dict[str, Any]]:
        """The values of every design point, of all fields that the design sets.

        A field that a design point does not set has the value of the scenario.
        """
        fields = dict.fromkeys(field for point in self.points for field in point.values)
        base = self.space({})
        unset = {field: base.plain_value(field) for field in fields if field != SEA}
        if SEA in fields:
            unset |= {SEA: self.study.scenario}
        else:
            unset |= {}
        return [unset | point.values for point in self.points]

    @cached_property
    def scenarios(self) -> tuple[ScenarioSpace, ...]:
        """The scenario of every design point."""
        return tuple(self.space(point.values) for point in self.points)

    @cached_property
    def _point_keys(self) -> list[str]:
        points = zip(self._scenario_texts, self.points, strict=True)
        return [f"{text} {point.replication}" for text, point in points]

    @cached_property
    def cells(self) -> tuple[tuple[Cell, ...], ...]:
        """The cells of every team, in the order of the design points."""
        run: dict[str, Any] = {"version": self.version, "code": self.engine_code, "seed": self.seed}
        if self.processes:
            run["processes"] = [[process.function, process.code] for process in self.processes]
        members = [team.data["members"] for team in self.policies]
        return tuple(
            self._cells(n, run | {"members": of_team}) for n, of_team in enumerate(members)
        )

    @cached_property
    def bound_cells(self) -> tuple[Cell, ...]:
        """The cells of the bounds, in the order of the design points; none without bounds."""
        run = {"version": self.version, "bound": self.bound_code, "seed": self.seed}
        if self.bound_code:
            return self._cells(NO_TEAM, run)
        return ()

    def parts_of_team(self, team: int, counts: Sequence[int] | None = None) -> list[CellPart]:
        """The first missions of every cell of a team: so many, or as many as were needed."""
        return _first_parts(self.cells[team], counts or self.missions[team])

    def parts_of_check(self, team: int) -> list[CellPart]:
        """The missions that check the design points selected for a team.

        The selection was not based on any of these missions.
        """
        check = 0
        if self.study.selection:
            check = self.study.selection.check
        cells = self.cells[team]
        replications = range(CHECK, CHECK + check)
        return [CellPart(cells[point], replications) for point in self.selected_points(team)]

    def parts_with_bounds(self, counts: Sequence[Sequence[int]] | None = None) -> list[CellPart]:
        """The missions that need bounds, at every design point those of any team; or none.

        Args:
            counts: The missions of every team and design point; by default as many as were needed.
        """
        if not self.bound_cells:
            return []
        return _first_parts(self.bound_cells, np.max(counts or self.missions, axis=0).tolist())

    def _cells(self, team: int, run: dict[str, Any]) -> tuple[Cell, ...]:
        """The cells of what is made with the same code and seed at every design point."""
        texts = (_canonical_json(run) + text for text in self._scenario_texts)
        keys = (sha256(text.encode()).hexdigest()[:16] for text in texts)
        points = enumerate(zip(keys, self.points, strict=True))
        return tuple(Cell(team, p, key, point.replication) for p, (key, point) in points)

    @cached_property
    def _scenario_texts(self) -> list[str]:
        return [*map(_text_of, self.scenarios)]

    @property
    def text(self) -> str:
        """The manifest as JSON, with a line for each of its parts."""
        lines = (f"{json.dumps(key)}: {json.dumps(value)}" for key, value in self.data.items())
        return "{\n" + ",\n".join(lines) + "\n}\n"


def _first_parts(cells: Sequence[Cell], counts: Sequence[int]) -> list[CellPart]:
    return [CellPart(c, range(c.first, c.first + n)) for c, n in zip(cells, counts, strict=True)]


# Where else a run can write, in the words of a message.
ELSEWHERE = "another results folder (--out of dess study run, --results of dess sweep or what-if)"
_ALLOWED = f"{ELSEWHERE}, another name, or remove the folder"


@lru_cache(maxsize=2**15)
def _text_of(space: ScenarioSpace) -> str:
    """A scenario as text; the manifests of a run have the same ones."""
    return _canonical_json(space.model_dump(mode="json"))


def _canonical_json(data: Any) -> str:
    return json.dumps(data, sort_keys=True)
