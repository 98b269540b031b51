"""The manifest of a results folder: the study, what it was run with, and the keys of its cells."""

import json
from collections.abc import Collection
from functools import cached_property
from hashlib import sha256
from pathlib import Path, PurePath
from typing import Any, NamedTuple, Self

from pydantic import TypeAdapter, ValidationError, field_validator, model_validator

import dess
from analysis.results.documents import Document
from analysis.results.provenance import (
    Acceptance,
    Team,
    code_behind,
    commit_of_source,
    differing,
    engine_code,
    library_versions,
    team_of,
)
from analysis.study.cheapest import AnySelection, Setting
from analysis.study.costs import Costs
from analysis.study.design import Design, DesignPoint
from analysis.study.stopping import Precision
from analysis.study.study import CHECK, Study
from dess import InputError
from dess.scenario import ScenarioSpace, load_scenario
from policies.registry import files_of

SCHEMA_VERSION = 3

# The parts of a study that are read back from its data.
_PARTS: dict[str, TypeAdapter] = {
    "set": TypeAdapter(dict[str, Any]),
    "design": TypeAdapter(Design | None),
    "costs": TypeAdapter(Costs | None),
    "precision": TypeAdapter(Precision | None),
    "selection": TypeAdapter(AnySelection | None),
}


# What is selected for a team: a design point, or one for each question; None without a selection.
Selected = int | list[int] | None


class Cell(NamedTuple):
    """A team at a design point, given by their numbers.

    ``key`` is a hash of all that the records depend on, except the replication. ``first`` is the
    first replication.
    """

    team: int
    point: int
    key: str
    first: int


class Origin(Document):
    """What results were made with; manifests and the evidence in pages have these fields.

    Attributes:
        version: Version of dess.
        code: For every module that the records depend on, a hash of its code at the last run.
        engine_code: A hash of the code of the engines at the first run. Like the code of the
            policies, it is part of the keys of the cells.
        accepted: The changes of code between the runs, in their order.
        commit: The git commit of the source tree, if there is one.
        libraries: The versions of the libraries, by name.
        seed: Seed of the missions.
        scenario: The complete scenario, before the design points change it.
        policies: The teams, with the hashes of code and weights that are part of the cells' keys.
        study: The study as data.
    """

    version: str
    code: dict[str, str]
    engine_code: str
    accepted: list[Acceptance]
    commit: str | None
    libraries: dict[str, str]
    seed: int
    scenario: dict[str, Any]
    policies: list[Team]
    study: dict[str, Any]

    @field_validator("study")
    @classmethod
    def _is_a_study(cls, study: dict[str, Any]) -> dict[str, Any]:
        study = {"costs": None} | study  # results of earlier versions have no costs
        numbers = (study.get("missions"), study.get("logged"))
        if study.keys() != Study.model_fields.keys() or not all(type(n) is int for n in numbers):
            raise ValueError("is not the data of a study")
        for field, part in _PARTS.items():
            try:
                part.validate_json(json.dumps(study[field]))
            except ValidationError:
                raise ValueError(f"has an invalid {field}") from None
        return study

    def space(self, values: dict[str, Any]) -> ScenarioSpace:
        """The scenario with the values of a design point.

        Raises:
            InputError: If it is not valid.
        """
        return ScenarioSpace.of(**self.scenario | values)

    def changes_here(self, named: Collection[str] = ()) -> list[str]:
        """How the code and libraries of this process differ from those that made the results.

        Args:
            named: The teams that the user has named. Policies of other Python files are not loaded,
                so they are not compared.

        Raises:
            InputError: If a policy cannot be loaded.
        """
        known = {file for team in named for file in files_of(team)}
        closed = [t for t in self.policies if not known.issuperset(files_of(t.policy))]
        teams = [team for team in self.policies if team not in closed]
        here, changes = code_behind(team.policy for team in teams), []
        code = {name: code for name, code in self.code.items() if name in here or not closed}
        if self.version != dess.__version__:
            changes.append(f"made by dess {self.version}, not {dess.__version__}")
        elif modules := differing(code, here):
            changes.append(f"made by other code of {', '.join(modules)}")
        if weights := [t.policy for t in teams if t.weights != team_of(t.policy).weights]:
            changes.append(f"made by other weights of {', '.join(weights)}")
        if closed:
            files = ", ".join(team.policy for team in closed)
            changes.append(f"made by a Python file that was not read, of policy {files}")
        versions = library_versions()
        made = self.libraries  # torch may be absent, here or where the results were made
        if others := [n for n in versions if n in made and made[n] != versions[n]]:
            changes.append(f"made with other versions of {', '.join(others)}")
        return changes


class Manifest(Origin):
    """The manifest of a results folder.

    It contains neither a time nor a path, so equal runs have equal manifests.

    Attributes:
        missions: Number of missions needed of every team at every design point. It grows during the
            run if a rule decides it.
        selected: For every team the selected design point, or the list of selected points if one is
            selected for each of several conditions; None if the study selects nothing.
        complete: Whether all missions are present.
    """

    schema_version: int
    points: list[DesignPoint]
    missions: list[list[int]]
    selected: list[Selected]
    complete: bool

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        names = {team.policy for team in self.policies}
        if not self.points or not names or len(names) < len(self.policies):
            raise ValueError("policies, points: are empty, or one is listed twice")
        shape = [len(self.points)] * len(self.policies)
        if [*map(len, self.missions)] != shape or len(self.selected) != len(self.policies):
            raise ValueError("missions, selected: not one for every policy and design point")
        if not all(1 <= n <= CHECK for of_team in self.missions for n in of_team):
            raise ValueError(f"missions: out of range; allowed: 1..{CHECK}")
        teams = range(len(self.policies))
        if not {p for team in teams for p in self.selected_points(team)} <= {*range(*shape[:1])}:
            raise ValueError("selected: is not a design point")
        return self

    def selected_points(self, team: int) -> list[int]:
        """The design points that were selected for a team; none, if the study selects nothing."""
        selected = self.selected[team]
        return [selected] if isinstance(selected, int) else selected or []

    @classmethod
    def of(cls, study: Study) -> "Manifest":
        """The manifest of a study that is run by this code."""
        # The path of a scenario file does not matter, since its content is stored.
        data = study.model_dump(mode="json") | {"scenario": PurePath(study.scenario).name}
        base = load_scenario(study.scenario, **study.set)
        points = [
            DesignPoint(values=json.loads(json.dumps(p.values)), replication=p.replication)
            for p in study.points
        ]
        return cls(
            schema_version=SCHEMA_VERSION,
            version=dess.__version__,
            code=code_behind(study.policies),
            engine_code=engine_code(),
            accepted=[],
            commit=commit_of_source(),
            libraries=library_versions(),
            seed=study.seed,
            study=data,
            scenario=base.model_dump(mode="json"),
            policies=[team_of(policy) for policy in study.policies],
            points=points,
            missions=[[study.first] * len(points)] * len(study.policies),
            selected=[None] * len(study.policies),
            complete=False,
        )

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a manifest of this version.

        Raises:
            InputError: If the file does not exist, is damaged, or has another version.
        """
        absent = "allowed: a results folder, made by dess study run"
        return cls.load(path, SCHEMA_VERSION, absent, _ALLOWED)

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
        changes = differing(self.code, new.code)
        if changes and accepting is None:
            modules = ", ".join(changes)
            raise InputError(
                f"{path}: made by other code of {modules}; {_ALLOWED}, or --accept-code"
            )
        accepted = [Acceptance(modules=changes, missions=accepting or 0)] if changes else []
        held = {team.policy: team for team in self.policies}
        update: dict[str, Any] = {
            "engine_code": self.engine_code,
            "policies": [held.get(team.policy, team) for team in new.policies],
            "accepted": self.accepted + accepted,
        }
        if self.study == new.study and self.points == new.points:
            progress = ("missions", "selected", "complete")
            update |= {name: getattr(self, name) for name in progress}
        # This is not a copy of ``new``, whose cached properties would be wrong with other keys.
        fields = {name: getattr(new, name) for name in Manifest.model_fields}
        return Manifest(**fields | update)

    def _check_extended_by(self, new: "Manifest", path: Path) -> None:
        name, held = new.study["name"], self.study["name"]
        teams = {team.policy: team.weights for team in new.policies}
        dropped = [team.policy for team in self.policies if team.policy not in teams]
        changed = [t.policy for t in self.policies if teams.get(t.policy) != t.weights]
        foreign = not set(self._point_keys) <= set(new._point_keys)
        complaints = {
            f"holds study {held}, not {name}": held != name,
            f"holds seed {self.seed}, not {new.seed}": self.seed != new.seed,
            f"holds other scenarios than those of study {name}": foreign,
            f"holds policy {' '.join(dropped)}, which study {name} does not have": bool(dropped),
            f"made by other weights of policy {' '.join(changed)}": bool(changed),
        }
        for complaint, holds in complaints.items():
            if holds:
                raise InputError(f"{path}: {complaint}; {_ALLOWED}")

    @property
    def key(self) -> str:
        """A hash of all that the records depend on, and of their number."""
        keys = [cell.key for cells in self.cells for cell in cells]
        accepted = [change.data for change in self.accepted]
        content = _canonical([keys, self.missions, self.selected, accepted])
        return sha256(content.encode()).hexdigest()[:16]

    @cached_property
    def costs(self) -> Costs | None:
        """The prices of the study, if it has any."""
        prices = self.study["costs"]
        return None if prices is None else Costs.model_validate(prices)

    @cached_property
    def selection(self) -> AnySelection | None:
        """The rule by which the study selects design points; None if it selects none."""
        return _PARTS["selection"].validate_json(json.dumps(self.study["selection"]))

    @cached_property
    def settings(self) -> list[Setting]:
        """The design points of a study with prices, for the search for the cheapest setting."""
        assert self.costs is not None
        return [
            Setting.of(values, space, self.costs)
            for values, space in zip(self.values, self.scenarios, strict=True)
        ]

    @cached_property
    def values(self) -> list[dict[str, Any]]:
        """The values of every design point, of all fields that the design sets.

        A field that a design point does not set has the value of the scenario.
        """
        fields = dict.fromkeys(field for point in self.points for field in point.values)
        rows = ({**self.scenario, **point.values} for point in self.points)
        return [{field: row[field] for field in fields} for row in rows]

    @cached_property
    def scenarios(self) -> tuple[ScenarioSpace, ...]:
        """The scenario of every design point."""
        return tuple(self.space(point.values) for point in self.points)

    @cached_property
    def _point_keys(self) -> list[str]:
        texts = (space.model_dump_json() for space in self.scenarios)
        return [f"{text} {p.replication}" for text, p in zip(texts, self.points, strict=True)]

    @cached_property
    def cells(self) -> tuple[tuple[Cell, ...], ...]:
        """The cells of every team, in the order of the design points."""
        run = {"version": self.version, "code": self.engine_code, "seed": self.seed}
        scenarios = [_canonical(space.model_dump(mode="json")) for space in self.scenarios]
        teams = []
        for number, team in enumerate(self.policies):
            members = [member.model_dump(mode="json", by_alias=True) for member in team.members]
            whose = _canonical(run | {"members": members})
            keys = (sha256((whose + text).encode()).hexdigest()[:16] for text in scenarios)
            teams.append(
                tuple(Cell(number, p, k, self.points[p].replication) for p, k in enumerate(keys))
            )
        return tuple(teams)

    @property
    def text(self) -> str:
        """The manifest as JSON, with a line for each of its parts."""
        lines = (f"{json.dumps(key)}: {json.dumps(value)}" for key, value in self.data.items())
        return "{\n" + ",\n".join(lines) + "\n}\n"


_ALLOWED = "allowed: another --out, or remove the folder"


def _canonical(data: Any) -> str:
    return json.dumps(data, sort_keys=True)
