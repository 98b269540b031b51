"""Provenance of records: the code of the engines and policies, the libraries, the git commit.

Code is identified by hashes of the syntax trees of modules (``dess.code.sources``), both of the
modules that the engines import and of those that a policy imports. So the code of environments and
figures does not count, nor do comments and docstrings.
"""

import inspect
import subprocess
from collections.abc import Iterable, Mapping
from functools import lru_cache
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from platform import python_version

from pydantic import Field

import dess
from analysis.results.documents import Document
from dess.code.sources import OURS, code_of, combined
from policies import load_team
from policies.base import Policy

ENGINES = ("dess.batch", "dess.mission")
LIBRARIES = ("numpy", "numba", "simpy", "scipy", "torch", "pandas", "pyarrow")


class Member(Document):
    """The identity of a policy: its name, its class, and hashes of its code and weights.

    ``learner`` is the same for trained policies that differ only in the seed of their training.
    """

    name: str
    class_: str = Field(alias="class")
    code: str
    weights: str = ""
    learner: str = ""


class Team(Document):
    """A team of a study, by the name that it has in the study."""

    policy: str
    members: list[Member]

    @property
    def weights(self) -> list[tuple[str, str, str]]:
        """What identifies the policies, apart from their code."""
        return [(member.name, member.weights, member.learner) for member in self.members]


class Acceptance(Document):
    """A change of code that was accepted by the option ``--accept-code``.

    Attributes:
        modules: The hashes, old and new, of the modules that differ; empty for one that is gone.
        missions: The number of missions that were simulated before, with the old code.
    """

    modules: dict[str, tuple[str, str]]
    missions: int

    @property
    def text(self) -> str:
        """The change of code in words."""
        return f"other code of {', '.join(self.modules)} after {self.missions:,} missions"


def team_of(policy: str) -> Team:
    """A team with the identities of its policies, as this process has them."""
    return Team(policy=policy, members=members_of(policy))


def members_of(team: str) -> list[Member]:
    """The identities of a team's policies, as this process has them."""
    return [
        Member.model_validate(
            {
                "name": policy.name,
                "class": f"{type(policy).__module__}:{type(policy).__qualname__}",
                "code": combined(_code(_modules_of(policy))),
                "weights": getattr(policy, "weights", ""),
                "learner": getattr(policy, "learner", ""),
            }
        )
        for policy in load_team(team)
    ]


def engine_code() -> str:
    """A hash of the code of the engines."""
    return combined(_code(ENGINES))


def code_behind(teams: Iterable[str]) -> dict[str, str]:
    """Hashes of the modules that the records of teams depend on, by name."""
    hashes = {**_code(ENGINES)}
    for policy in (policy for team in teams for policy in load_team(team)):
        hashes |= _code(_modules_of(policy))
    return dict(sorted(hashes.items()))


def differing(old: Mapping[str, str], new: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    """The old and the new hash of each old module that has changed or is gone.

    A new module need not be listed: it matters only if an old module has changed to import it.
    """
    return {name: (code, new.get(name, "")) for name, code in old.items() if new.get(name) != code}


def library_versions() -> dict[str, str]:
    """The versions of Python and of the libraries on which records may depend.

    A library that is not installed is left out.
    """
    installed = [name for name in LIBRARIES if find_spec(name)]
    return {"python": python_version()} | {name: metadata.version(name) for name in installed}


def commit_of_source() -> str | None:
    """The git commit of the source tree; None outside a git repository."""
    root = Path(inspect.getfile(dess)).parents[1]
    if not (root / ".git").exists():
        return None
    command = ["git", "-C", str(root), "rev-parse", "HEAD"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None


def _modules_of(policy: Policy) -> tuple[str, ...]:
    """The modules of a policy's class and of its attributes' classes, such as a network's."""
    home = type(policy).__module__
    packages = OURS | {home.partition(".")[0]}
    held = {type(value).__module__ for value in vars(policy).values()}
    return (home, *sorted(m for m in held - {home} if m.partition(".")[0] in packages))


@lru_cache
def _code(modules: tuple[str, ...]) -> dict[str, str]:
    return code_of(*modules)
