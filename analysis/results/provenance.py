"""Provenance of records: the code of the engines and policies, the libraries, the git commit.

Code is identified by hashes of the syntax trees of modules (``dess.base.sources``), both of the
modules that the engines import and of those that a policy imports. So the code of environments and
figures does not count, nor do comments and docstrings.
"""

import inspect
import json
import subprocess
from collections.abc import Collection, Iterable, Mapping
from functools import cached_property, lru_cache
from importlib import metadata
from pathlib import Path
from platform import python_version
from typing import Annotated, Any, Literal, Self

from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    ValidationError,
    field_serializer,
    model_validator,
)

import dess
from dess.analysis.study.fields import StudyData
from dess.analysis.study.stopping import Text
from dess.analysis.study.study import change_scenario
from dess.base.errors import to_input_error
from dess.base.files.documents import Document, Sha256
from dess.base.sources import OURS, code_of, combined
from dess.model.mission import Process
from dess.model.processes import load_process, load_processes
from dess.policies.registry import Policy, is_confirmed, load_team
from dess.scenario.scenario import SEA, ScenarioSpace, scenario_at

ENGINES = ("dess.model.batch", "dess.model.mission")
BOUND = ("dess.analysis.bound",)
LIBRARIES = ("numpy", "numba", "simpy", "scipy", "pandas", "pyarrow")

# Strings of a known form: a module, a class, a library, a version.
Module = Annotated[str, Field(pattern=r"^[\w.]+$", max_length=500)]
Class = Annotated[str, Field(pattern=r"^[\w.]+:[\w.<>]+$", max_length=1000)]
Library = Annotated[str, Field(pattern=r"^[\w.-]+$", max_length=100)]
Version = Annotated[str, Field(pattern=r"^[\w.+!-]+$", max_length=100)]
Commit = Annotated[str, Field(pattern=r"^[0-9a-f]{40,64}$")]


class Member(Document):
    """The identity of a policy: its name, its class, and hashes of its code and weights.

    ``learner`` is the same for trained policies that differ only in the seed of their training.
    """

    name: Text
    class_: Class = Field(alias="class")
    code: Sha256
    weights: Text = ""
    learner: Text = ""


class Team(Document):
    """A team of a study, by the name that it has in the study."""

    policy: Text
    members: list[Member] = Field(min_length=1)

    @property
    def weights(self) -> list[tuple[str, str, str]]:
        """What identifies the policies, apart from their code."""
        return [(member.name, member.weights, member.learner) for member in self.members]


class ProcessIdentity(Document):
    """The identity of a process of a user, by the name that it was typed with.

    Attributes:
        process: Its file and its function.
        function: The name of the function.
        code: A hash of the code of its file and of what that imports.
    """

    process: Text
    function: Text
    code: Sha256


class Acceptance(Document):
    """A change of code that was accepted by the option ``--accept-code``.

    Attributes:
        modules: The hashes, old and new, of the modules that differ; empty for one that is gone.
        missions: The number of missions that were simulated before, with the old code.
    """

    modules: dict[Module, tuple[Sha256, Sha256 | Literal[""]]]
    missions: int

    @property
    def text(self) -> str:
        """The change of code in words."""
        return f"other code of {', '.join(self.modules)} after {self.missions:,} missions"


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
        study: The study, with the name of its scenario in place of a path.
        processes: The processes of the user in every mission, with the hashes of their code.
    """

    version: Version
    code: dict[Module, Sha256]
    engine_code: Sha256
    accepted: list[Acceptance]
    commit: Commit | None
    libraries: dict[Library, Version]
    seed: int
    scenario: dict[str, Any]
    policies: list[Team] = Field(min_length=1)
    study: StudyData
    processes: list[ProcessIdentity] = []

    @field_serializer("study", mode="wrap")
    def _newest_first(self, study: StudyData, dump: SerializerFunctionWrapHandler) -> Any:
        """The study as data, in the order in which manifests have always had it."""
        data = dump(study)
        return {name: data[name] for name in ("costs", "bounds")} | data

    @model_validator(mode="after")
    def _is_of_the_study(self) -> Self:
        self.space({})  # it is checked when it is made
        if "/" in self.study.scenario:
            raise ValueError("study.scenario: is not the name of a scenario")
        if [team.policy for team in self.policies] != [*self.study.policies]:
            raise ValueError("policies: are not those of the study")
        return self

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with other values, which computes again what depends on them."""
        fields = {name: getattr(self, name) for name in type(self).model_fields}
        return self.model_construct(**fields | dict(update or {}))

    def space(self, values: dict[str, Any]) -> ScenarioSpace:
        """The scenario with the values of a design point.

        Raises:
            InputError: If it is not valid.
        """
        if SEA in values:
            return scenario_at(self.study.scenario, values, **self.study.set)
        return change_scenario(self._fields, json.dumps(values))

    @cached_property
    def _fields(self) -> str:
        return json.dumps(self.scenario)

    def load_processes(self, named: Collection[str]) -> list[Process]:
        """The processes of the missions, all of which the user has to name.

        Raises:
            InputError: If one of them is not named, or cannot be loaded.
        """
        typed = {name: name for name in named}
        names = [identity.process for identity in self.processes]
        return load_processes(typed.get(name, name) for name in names)

    def changes_here(self, named: Collection[str] = ()) -> list[str]:
        """How the code and libraries of this process differ from those that made the results.

        Args:
            named: The teams and processes that the user has named. Those of other Python files are
                not loaded, so they are not compared.

        Raises:
            InputError: If a policy cannot be loaded.
        """
        names = [team.policy for team in self.policies]
        closed = [name for name in names if not is_confirmed(name, named)]
        teams = {team.policy: team for team in self.policies if team.policy not in closed}
        processes = [identity.process for identity in self.processes]
        opened = [process for process in named if process in processes]
        unread = {"policy": closed, "process": [p for p in processes if p not in named]}
        code_here = code_behind(teams, self.study.bounds, opened, run_files=True)
        changes = []
        has_all = not any(unread.values())
        code = {name: code for name, code in self.code.items() if name in code_here or has_all}
        if self.version != dess.__version__:
            changes.append(f"made by dess {self.version}, not {dess.__version__}")
        elif modules := differing_modules(code, code_here):
            changes.append(f"made by other code of {', '.join(modules)}")
        present_teams = {name: team_of(name, run_files=True) for name in teams}
        if weights := [n for n in teams if teams[n].weights != present_teams[n].weights]:
            changes.append(f"made by other weights of {', '.join(weights)}")
        for kind, files in unread.items():
            if files:
                changes.append(
                    f"made by a Python file that was not read, of {kind} {', '.join(files)}"
                )
        versions = library_versions()
        recorded = self.libraries
        if others := [n for n in versions if n in recorded and recorded[n] != versions[n]]:
            changes.append(f"made with other versions of {', '.join(others)}")
        return changes


def team_of(policy: str, *, run_files: bool = False) -> Team:
    """A team with the identities of its policies, as this process has them."""
    return Team(policy=policy, members=members_of(policy, run_files=run_files))


def members_of(team: str, *, run_files: bool = False) -> list[Member]:
    """The identities of a team's policies, as this process has them."""
    return [_member_identity(policy) for policy in load_team(team, run_files=run_files)]


def _member_identity(policy: Policy) -> Member:
    fields = {
        "name": policy.name,
        "class": f"{type(policy).__module__}:{type(policy).__qualname__}",
        "code": combined(_code_hashes(_modules_of(policy))),
        "weights": getattr(policy, "weights", ""),
        "learner": getattr(policy, "learner", ""),
    }
    try:
        return Member.model_validate(fields)
    except ValidationError as error:  # the class may be anybody's
        raise to_input_error(error, "policy", Member) from None


def identify_process(process: str) -> ProcessIdentity:
    """The identity of a process that a user has typed, as this process has it."""
    loaded = load_process(process)
    code = combined(_code_hashes((loaded.module,)))
    return ProcessIdentity(process=process, function=loaded.run.__name__, code=code)


def engine_code() -> str:
    """A hash of the code of the engines."""
    return combined(_code_hashes(ENGINES))


def bound_code() -> str:
    """A hash of the code of the bound."""
    return combined(_code_hashes(BOUND))


def code_behind(
    teams: Iterable[str],
    bounds: bool = False,
    processes: Iterable[str] = (),
    *,
    run_files: bool = False,
) -> dict[str, str]:
    """Hashes of the modules that records and bounds depend on, by name.

    Args:
        teams: The teams of the missions.
        bounds: Whether there are bounds.
        processes: The processes of the user, who has typed them.
        run_files: Whether Python files of the teams may be run.
    """
    hashes = _code_hashes(ENGINES) | (_code_hashes(BOUND) if bounds else {})
    for process in processes:
        hashes |= _code_hashes((load_process(process).module,))
    for team in teams:
        for policy in load_team(team, run_files=run_files):
            hashes |= _code_hashes(_modules_of(policy))
    return dict(sorted(hashes.items()))


def differing_modules(old: Mapping[str, str], new: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    """The old and the new hash of each old module that has changed or is gone.

    A new module need not be listed: it matters only if an old module has changed to import it.
    """
    return {name: (code, new.get(name, "")) for name, code in old.items() if new.get(name) != code}


def library_versions() -> dict[str, str]:
    """The versions of Python and of the libraries on which records may depend."""
    return {"python": python_version()} | {name: metadata.version(name) for name in LIBRARIES}


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
    modules = {type(value).__module__ for value in vars(policy).values()}
    return (home, *sorted(m for m in modules - {home} if m.partition(".")[0] in packages))


@lru_cache
def _code_hashes(modules: tuple[str, ...]) -> dict[str, str]:
    return code_of(*modules)
