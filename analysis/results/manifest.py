"""What a results folder is about: the study, what it was run with, and what its cells depend on."""

import inspect
import json
import shlex
import subprocess
from functools import cached_property, lru_cache
from hashlib import sha256
from importlib import import_module, metadata
from pathlib import Path, PurePath
from platform import python_version
from typing import Any, NamedTuple, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
    field_validator,
    model_validator,
)

import dess
from analysis.study.design import Design
from analysis.study.selection import Selection
from analysis.study.stopping import Precision
from analysis.study.study import CHECK, Study
from dess.errors import InputError
from dess.scenario import ScenarioSpace, load_scenario, scenario_names, validation_line
from policies import load_team

SCHEMA_VERSION = 2

# The parts of a study that are read back from its data.
_PARTS: dict[str, TypeAdapter] = {
    "set": TypeAdapter(dict[str, Any]),
    "design": TypeAdapter(Design | None),
    "precision": TypeAdapter(Precision | None),
    "selection": TypeAdapter(Selection | None),
}
LIBRARIES = ("numpy", "numba", "simpy", "scipy", "torch", "pandas", "pyarrow")


class Cell(NamedTuple):
    """A team on a design point, by their numbers, with the key of what its records depend on.

    ``key`` is a hash of all that the records depend on but the replication. ``first`` is the first
    replication.
    """

    team: int
    point: int
    key: str
    first: int


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Member(_Part):
    """The identity of a policy: its name, its class, and hashes of the code and weights it has.

    ``learner`` is the same for trained policies that differ in the seed of their training alone.
    """

    name: str
    class_: str = Field(alias="class")
    code: str
    weights: str = ""
    learner: str = ""


class Team(_Part):
    """A team of a study, as the study names it."""

    policy: str
    members: list[Member]


class DesignPoint(_Part):
    """A design point: what it sets of the scenario, and its first replication."""

    values: dict[str, Any]
    replication: int = 0


class Manifest(_Part):
    """What a results folder is about. No clock and no path: equal runs have equal manifests.

    Attributes:
        scenario: The whole scenario that the design points change.
        missions: Wanted of every team and design point; grows where a rule decides it.
        selected: The design point that was selected for every team, if the study selects.
        complete: Whether all of it is there.
    """

    schema_version: int
    version: str
    code: str
    commit: str | None
    libraries: dict[str, str]
    seed: int
    study: dict[str, Any]
    scenario: dict[str, Any]
    policies: list[Team]
    points: list[DesignPoint]
    missions: list[list[int]]
    selected: list[int | None]
    complete: bool

    @field_validator("study")
    @classmethod
    def _is_a_study(cls, study: dict[str, Any]) -> dict[str, Any]:
        numbers = (study.get("missions"), study.get("logged"))
        if study.keys() != Study.model_fields.keys() or not all(type(n) is int for n in numbers):
            raise ValueError("is not the data of a study")
        for field in ("set", "design", "precision", "selection"):
            try:
                _PARTS[field].validate_json(json.dumps(study[field]))
            except ValidationError:
                raise ValueError(f"has a {field} that is none") from None
        return study

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        names = {team.policy for team in self.policies}
        if not self.points or not names or len(names) < len(self.policies):
            raise ValueError("policies, points: none, or one twice")
        shape = [len(self.points)] * len(self.policies)
        if [*map(len, self.missions)] != shape or len(self.selected) != len(self.policies):
            raise ValueError("missions, selected: not one for every policy and design point")
        if not all(1 <= n <= CHECK for of_team in self.missions for n in of_team):
            raise ValueError(f"missions: out of range; allowed: 1..{CHECK}")
        if not all(best is None or best in range(len(self.points)) for best in self.selected):
            raise ValueError("selected: no design point")
        return self

    @classmethod
    def of(cls, study: Study) -> "Manifest":
        """The manifest of a study that is run by this code."""
        # Where a scenario's file lies does not matter; what it says is told.
        data = study.model_dump(mode="json") | {"scenario": PurePath(study.scenario).name}
        base = load_scenario(study.scenario, **study.set)
        points = [
            DesignPoint(values=json.loads(json.dumps(p.values)), replication=p.replication)
            for p in study.points
        ]
        return cls(
            schema_version=SCHEMA_VERSION,
            version=dess.__version__,
            code=fingerprint("dess"),
            commit=commit_of_source(),
            libraries=library_versions(),
            seed=study.seed,
            study=data,
            scenario=base.model_dump(mode="json"),
            policies=[Team(policy=team, members=members_of(team)) for team in study.policies],
            points=points,
            missions=[[study.first] * len(points)] * len(study.policies),
            selected=[None] * len(study.policies),
            complete=False,
        )

    @classmethod
    def read(cls, path: Path) -> "Manifest":
        """Read a manifest of this version.

        Raises:
            InputError: If there is none, or it is damaged or of another version.
        """
        absent = "allowed: a results folder, made by dess study run"
        data = read_json(path, SCHEMA_VERSION, absent, _ALLOWED)
        try:
            return cls.model_validate(data)
        except ValidationError as error:
            raise InputError(f"{validation_line(error, str(path))}; {_ALLOWED}") from None

    def check_extended_by(self, new: "Manifest", path: Path) -> None:
        """Refuse to mix results: ``new`` must be the same study, or more of it.

        Raises:
            InputError: If it is not; ``path`` says where this manifest lies.
        """
        name, held = new.study["name"], self.study["name"]
        teams = {team.policy: team for team in new.policies}
        dropped = [team.policy for team in self.policies if team.policy not in teams]
        changed = [team.policy for team in self.policies if teams.get(team.policy, team) != team]
        foreign = not set(self._point_keys) <= set(new._point_keys)
        complaints = {
            f"holds study {held}, not {name}": held != name,
            f"holds seed {self.seed}, not {new.seed}": self.seed != new.seed,
            f"holds other scenarios than those of study {name}": foreign,
            f"holds policy {' '.join(dropped)}, which study {name} has not": bool(dropped),
            "made by other code of the same version": self.code != new.code,
            f"made by other code of policy {' '.join(changed)}": bool(changed),
        }
        for complaint, holds in complaints.items():
            if holds:
                raise InputError(f"{path}: {complaint}; {_ALLOWED}")

    def carried_on_from(self, held: "Manifest") -> "Manifest":
        """This manifest, as far as an earlier run of the same study got."""
        data = ("study", "policies", "points")
        if any(getattr(self, name) != getattr(held, name) for name in data):
            return self
        progress = {name: getattr(held, name) for name in ("missions", "selected", "complete")}
        return self.model_copy(update=progress)

    def replay(self, cell: Cell, replication: int) -> str:
        """The command that simulates a mission of a cell again."""
        return replay_command(
            self.study["scenario"],
            self.study["set"] | self.points[cell.point].values,
            self.scenarios[cell.point],
            self.policies[cell.team].policy,
            self.seed,
            replication,
        )

    @property
    def key(self) -> str:
        """A hash of what all records depend on, and of how many there are."""
        keys = [cell.key for cells in self.cells for cell in cells]
        return sha256(_canonical([keys, self.missions, self.selected]).encode()).hexdigest()[:16]

    @cached_property
    def scenarios(self) -> tuple[ScenarioSpace, ...]:
        """The scenario of every design point."""
        return tuple(ScenarioSpace.of(**self.scenario | point.values) for point in self.points)

    @cached_property
    def _point_keys(self) -> list[str]:
        texts = (space.model_dump_json() for space in self.scenarios)
        return [f"{text} {p.replication}" for text, p in zip(texts, self.points, strict=True)]

    @cached_property
    def cells(self) -> tuple[tuple[Cell, ...], ...]:
        """The cells of every team, in the order of the design points."""
        run = {"version": self.version, "code": self.code, "seed": self.seed}
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
    def data(self) -> dict[str, Any]:
        """The manifest as plain data."""
        return self.model_dump(mode="json", by_alias=True)

    @property
    def text(self) -> str:
        """The manifest as JSON, a line for each of its parts."""
        lines = (f"{json.dumps(key)}: {json.dumps(value)}" for key, value in self.data.items())
        return "{\n" + ",\n".join(lines) + "\n}\n"


_VERSIONS = ("version", "schema_version")
_ALLOWED = "allowed: another --out, or remove the folder"


def _canonical(data: Any) -> str:
    return json.dumps(data, sort_keys=True)


def read_json(path: Path, schema: int, absent: str, allowed: str) -> Any:
    """The data of a JSON file that tells its ``version`` and ``schema_version``.

    Args:
        path: The file.
        schema: The schema that it must be of.
        absent: What is allowed, if it is not there.
        allowed: What is allowed otherwise.

    Raises:
        InputError: If there is none, or it is no JSON or of another version.
    """
    try:
        data = json.loads(path.read_text("utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(f"{path}: no such file; {absent}") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {error}; {allowed}") from None
    made_by = [data.get(key) for key in _VERSIONS] if isinstance(data, dict) else [None]
    if None not in made_by and made_by != [dess.__version__, schema]:
        raise InputError(
            f"{path}: made by dess {made_by[0]} (schema {made_by[1]}), "
            f"not {dess.__version__} (schema {schema}); {allowed}"
        )
    return data


def replay_command(
    name: str,
    values: dict[str, Any],
    scenario: ScenarioSpace,
    policy: str,
    seed: int,
    replication: int,
) -> str:
    """The command that simulates a mission again.

    Args:
        name: Of the scenario.
        values: What is set of it.
        scenario: What it is with these, told where the name is not that of a shipped one.
        policy: The team.
        seed: Of the mission.
        replication: Its number.
    """
    if name not in scenario_names():  # its file may be anywhere: say what it changes
        name, usual = "paper", load_scenario("paper").model_dump(mode="json")
        ours = scenario.model_dump(mode="json")
        values = {key: value for key, value in ours.items() if value != usual[key]}
    settings = [word for k, v in values.items() for word in ("--set", f"{k}={json.dumps(v)}")]
    which = ["--policy", policy, "--seed", str(seed), "--replication", str(replication)]
    return shlex.join(["dess", "simulate", "--scenario", name, *settings, *which])


@lru_cache
def fingerprint(module: str) -> str:
    """A hash of the Python sources of a module: all those in its packages, or its own alone."""
    imported = import_module(module)
    source = Path(inspect.getfile(imported))
    depth = len(imported.__package__.split(".")) if imported.__package__ else 0
    folders = [source.parents[level] for level in range(depth)]
    sources = [path for folder in folders for path in sorted(folder.glob("*.py"))]
    digest = sha256()
    for path in sources or [source]:
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def members_of(team: str) -> list[Member]:
    """The identities of a team's policies, as this process has them."""
    identities = []
    for policy in load_team(team):
        kind = type(policy)
        identity = {
            "name": policy.name,
            "class": f"{kind.__module__}:{kind.__qualname__}",
            "code": fingerprint(kind.__module__),
            "weights": getattr(policy, "weights", ""),
            "learner": getattr(policy, "learner", ""),
        }
        identities.append(Member.model_validate(identity))
    return identities


def library_versions() -> dict[str, str]:
    """What records may depend on besides the code: Python, and the libraries that compute."""
    return {"python": python_version()} | {name: metadata.version(name) for name in LIBRARIES}


def commit_of_source() -> str | None:
    """The git commit of the source tree; nothing outside one."""
    root = Path(inspect.getfile(dess)).parents[1]
    if not (root / ".git").exists():
        return None
    command = ["git", "-C", str(root), "rev-parse", "HEAD"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None
