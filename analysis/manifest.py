"""What a results folder is about: the study, what it was run with, and what its cells depend on."""

import hashlib
import inspect
import json
import subprocess
from functools import lru_cache
from importlib import import_module, metadata
from pathlib import Path, PurePath
from platform import python_version
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

import dess
from analysis.study import Study
from dess.errors import InputError
from dess.scenario import validation_line
from policies import load_team

SCHEMA_VERSION = 1
LIBRARIES = ("numpy", "numba", "simpy", "scipy", "pandas", "pyarrow")


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Member(_Part):
    """The identity of a policy: its name, its class, and hashes of the code and weights it has."""

    name: str
    class_: str = Field(alias="class")
    code: str
    weights: str = ""


class Team(_Part):
    """A team of a study, as the study names it."""

    policy: str
    members: list[Member]


class DesignPoint(_Part):
    """A design point: the values of the swept fields, and the whole scenario."""

    values: dict[str, Any]
    scenario: dict[str, Any]


class Cell(_Part):
    """A team on a scenario: all that its records depend on but the replication."""

    version: str
    code: str
    seed: int
    scenario: dict[str, Any]
    members: list[Member]

    @property
    def text(self) -> str:
        """The cell as canonical JSON."""
        return json.dumps(self.model_dump(mode="json", by_alias=True), sort_keys=True)

    @property
    def key(self) -> str:
        """A hash of the cell's content."""
        return hashlib.sha256(self.text.encode()).hexdigest()[:16]

    def __str__(self) -> str:
        return ",".join(member.name for member in self.members)


class Manifest(_Part):
    """What a results folder is about. No clock and no path: equal runs have equal manifests."""

    schema_version: int
    version: str
    code: str
    commit: str | None
    libraries: dict[str, str]
    seed: int
    study: dict[str, Any]
    policies: list[Team]
    points: list[DesignPoint]

    @field_validator("study")
    @classmethod
    def _is_a_study(cls, study: dict[str, Any]) -> dict[str, Any]:
        numbers = (study.get("missions"), study.get("logged"))
        if study.keys() != Study.model_fields.keys() or not all(type(n) is int for n in numbers):
            raise ValueError("is not the data of a study")
        return study

    @classmethod
    def of(cls, study: Study) -> "Manifest":
        """The manifest of a study that is run by this code."""
        # Where a scenario's file lies does not matter; what it says is in the design points.
        data = study.model_dump(mode="json") | {"scenario": PurePath(study.scenario).name}
        return cls(
            schema_version=SCHEMA_VERSION,
            version=dess.__version__,
            code=fingerprint("dess"),
            commit=_commit(),
            libraries={"python": python_version()} | {n: metadata.version(n) for n in LIBRARIES},
            seed=study.seed,
            study=data,
            policies=[Team(policy=team, members=_members(team)) for team in study.policies],
            points=[
                DesignPoint(values=p.values, scenario=p.scenario.model_dump(mode="json"))
                for p in study.points
            ],
        )

    @classmethod
    def read(cls, path: Path) -> "Manifest":
        """Read a manifest of this version.

        Raises:
            InputError: If there is none, or it is damaged or of another version.
        """
        try:
            data = json.loads(path.read_text("utf-8"))
        except (FileNotFoundError, NotADirectoryError):
            raise InputError(
                f"{path}: no such file; allowed: a results folder, made by dess study run"
            ) from None
        except (OSError, ValueError) as error:
            raise InputError(f"{path}: cannot be read: {error}; {_ALLOWED}") from None
        made_by = [data.get(key) for key in _VERSIONS] if isinstance(data, dict) else [None, None]
        if None not in made_by and made_by != [dess.__version__, SCHEMA_VERSION]:
            raise InputError(
                f"{path}: made by dess {made_by[0]} (schema {made_by[1]}), "
                f"not {dess.__version__} (schema {SCHEMA_VERSION}); {_ALLOWED}"
            )
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
        scenarios = [point.scenario for point in new.points]
        foreign = any(point.scenario not in scenarios for point in self.points)
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

    def cell(self, team: int, point: int) -> Cell:
        """The cell of a team and a design point, both by number."""
        return Cell(
            version=self.version,
            code=self.code,
            seed=self.seed,
            scenario=self.points[point].scenario,
            members=self.policies[team].members,
        )

    @property
    def cells(self) -> list[tuple[int, int, Cell]]:
        """All cells with the numbers of their team and design point, in the order of the study."""
        points = range(len(self.points))
        return [(t, p, self.cell(t, p)) for t in range(len(self.policies)) for p in points]

    @property
    def data(self) -> dict[str, Any]:
        """The manifest as plain data."""
        return self.model_dump(mode="json", by_alias=True)


_VERSIONS = ("version", "schema_version")
_ALLOWED = "allowed: another --out, or remove the folder"


@lru_cache
def fingerprint(module: str) -> str:
    """A hash of the Python sources of a module: all those in its packages, or its own alone."""
    imported = import_module(module)
    source = Path(inspect.getfile(imported))
    depth = len(imported.__package__.split(".")) if imported.__package__ else 0
    folders = [source.parents[level] for level in range(depth)]
    sources = [path for folder in folders for path in sorted(folder.glob("*.py"))]
    digest = hashlib.sha256()
    for path in sources or [source]:
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def _members(team: str) -> list[Member]:
    identities = []
    for policy in load_team(team):
        kind = type(policy)
        identity = {
            "name": policy.name,
            "class": f"{kind.__module__}:{kind.__qualname__}",
            "code": fingerprint(kind.__module__),
            "weights": getattr(policy, "weights", ""),
        }
        identities.append(Member.model_validate(identity))
    return identities


def _commit() -> str | None:
    """The git commit of the source tree; nothing outside one."""
    root = Path(inspect.getfile(dess)).parents[1]
    if not (root / ".git").exists():
        return None
    command = ["git", "-C", str(root), "rev-parse", "HEAD"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None
