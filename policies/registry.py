"""Policies by name, from the folder of a training, from a Python file, or of another package.

load("greedy"), load("ddqn"), load("runs/my-training"), load("my_policies.py:Eager")
load_team("greedy,tour"), about("ddqn").card

A policy has a name and ``act``, which chooses actions for many UAVs at once::

    class Hover:
        name = "hover"

        def act(self, view: View) -> np.ndarray:
            return np.full(len(view), 4)

Other packages register theirs under the entry point ``dess.policies``.
"""

import inspect
import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points, version
from pathlib import Path
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from dess.base.errors import InputError, listed, shown, unknown_name
from dess.base.files.reading import Missing, paths_in, read_text
from dess.base.python_file import PythonName
from dess.model.view import View
from dess.policies.learner.config import CHECKPOINT
from dess.policies.learner.description import CONFIG, field_ranges, read_description
from dess.policies.shipped import HEURISTICS, PLANNERS
from dess.scenario.fields import SAMPLED
from dess.scenario.scenario import ScenarioSpace, load_scenario, scenario_names


@runtime_checkable
class Policy(Protocol):
    """A policy chooses actions for many UAVs at once, and keeps no state between calls.

    A slow policy may have the attribute ``chunk``: how many missions a study computes and stores
    together at most, so that an interruption loses little.

    Attributes:
        name: The name under which results are stored.
    """

    name: str

    def act(self, view: View) -> np.ndarray:
        """Choose an action for every row of the view.

        Args:
            view: The state of the R UAVs that must act, over any number of missions.

        Returns:
            (R,) integers: 0 north, 1 east, 2 south, 3 west, 4 hover.
        """
        ...


GROUP = "dess.policies"

CLASSES = HEURISTICS | PLANNERS  # the shipped policies that are classes

# Former names of policies, which version 0.3 still takes.
FORMER = {"any": "generalist"}

TRAINED = Path(__file__).with_name("trained")  # one folder per trained policy

FORM = "FILE.py:CLASS"
_ALLOWED = "a class whose objects have a name and act(view)"
_OTHERS = (
    f"the folder of a trained policy, {FORM}, or what an installed package registers under "
    f"the entry point {GROUP}"
)


def names() -> list[str]:
    """All policies by name, the shipped ones first."""
    shipped = [*CLASSES, *trained_names()]
    return [*shipped, *sorted(set(_registered_policies()) - set(shipped))]


def trained_names() -> list[str]:
    """The names of the trained policies that are shipped."""
    return [path.parent.name for path in paths_in(TRAINED, f"*/{CONFIG}")]


def describe_policies() -> dict[str, str]:
    """The descriptions of all policies, in the order of ``names``.

    Those of other packages are loaded; if one cannot be loaded, its description says so.
    """
    shipped = {name: policy.about for name, policy in CLASSES.items()}
    shipped |= {name: _describe_trained(TRAINED / name) for name in trained_names()}
    outside = {name: _describe_registered(point) for name, point in _registered_policies().items()}
    return {name: (outside | shipped)[name] for name in names()}


def load(name: str | Path, *, run_files: bool = False) -> Policy:
    """Load a policy by its name, from the folder of a trained policy, or from a Python file.

    Args:
        name: One of ``names()``; a folder that ``dess train`` has written; or ``FILE.py:CLASS``.
            The folder of such a file is added to ``sys.path``, so the file can import those beside
            it. A file that was changed is loaded again only by a new process.
        run_files: Whether a Python file may be run, since a user has typed its name. A name that
            was read from data, such as results, studies and pages, runs none.

    Raises:
        InputError: If the policy does not exist, cannot be loaded, or is a class of a Python file
            that may not be run.
    """
    name = current_name(str(name))
    if name in CLASSES:
        shipped = CLASSES[name]
        return _make_policy(name, shipped.module, lambda: _find_class(shipped.module, shipped.kind))
    if folder := folder_of(name):
        from dess.policies.learner.trained import load_policy  # imports numba

        policy = load_policy(folder)
        if name in trained_names():
            policy.name = name
        return policy
    if file := PythonName.parse(name):
        file.check("policy", FORM, run_files=run_files)
        return _make_policy(
            file.name, str(file.path), lambda: _find_class(file.find_module("policy"), file.name)
        )
    if point := _registered_policies().get(name):
        return _make_policy(name, point.value, point.load)
    _check_untrained(Path(name))
    raise unknown_name("policy", f"{shown(name)} is unknown", name, names(), _OTHERS)


def current_name(team: str) -> str:
    """A policy or a team, by the present names of its policies."""
    return ",".join(FORMER.get(name.strip(), name) for name in team.split(","))


def folder_of(name: str) -> Path | None:
    """The folder of a trained policy, if the name is that of one."""
    name = current_name(name)
    folder = TRAINED / name if name in trained_names() else Path(name)
    # An empty name would be the working folder.
    return folder if name and os.path.exists(folder / CONFIG) else None


def _check_untrained(folder: Path) -> None:
    """Raise an error if a folder has a training that has not written any weights yet."""
    if os.path.exists(folder / CHECKPOINT):  # False for a name that no folder can have
        raise InputError(
            "policy",
            f"{folder} is a training that has no weights yet",
            "after the command that began it is run again with --resume",
        )


def package_of(name: str) -> str:
    """The package that adds a policy, with its version; empty for all other policies."""
    point = _registered_policies().get(name)
    return f"{point.dist.name} {point.dist.version}" if point and point.dist else ""


def _make_policy(name: str, where: str, load_class: Callable[[], Callable[[], Any]]) -> Policy:
    """A policy of a class, which may be anybody's.

    Raises:
        InputError: If the class cannot be loaded, or is none of a policy.
    """
    try:
        return _instantiate(load_class)
    except _NoPolicyError as error:
        raise InputError("policy", f"{name} of {where} {error}", _ALLOWED) from error.__cause__


class _NoPolicyError(Exception):
    """Why a class gives no policy, in words that follow its name."""


def _instantiate(load_class: Callable[[], Callable[[], Any]]) -> Policy:
    try:
        policy = load_class()()
    except InputError:
        raise
    except Exception as error:  # code of others may raise anything; name it
        raise _NoPolicyError(f"cannot be loaded: {type(error).__name__}: {error}") from error
    if not isinstance(policy, Policy):
        raise _NoPolicyError("has no name and act(view)")
    return policy


def _find_class(module: str, name: str) -> Callable[[], Any]:
    """A class by the name of its module and its own.

    Raises:
        InputError: If the module has no such class.
    """
    names_of_module = vars(import_module(module))
    if name not in names_of_module:
        classes = [n for n, value in names_of_module.items() if hasattr(value, "act")]
        raise unknown_name(f"policy: {module}", f"{shown(name)} is no class of it", name, classes)
    return names_of_module[name]


def load_team(text: str, uavs: int | None = None, *, run_files: bool = False) -> list[Policy]:
    """Load the policies of ``"P"`` or ``"P,P,..."``: UAV i gets number ``i % len(team)``.

    Args:
        text: The team.
        uavs: The size of the largest fleet, if the policies that never act in it are to be left
            out, as at some design points of a study; all are loaded by default.
        run_files: Whether the file of a policy, ``FILE.py:CLASS``, may be run.

    Raises:
        InputError: If one of them is unknown.
    """
    return [load(name.strip(), run_files=run_files) for name in text.split(",")[:uavs]]


def python_files_in(team: str) -> list[str]:
    """Those policies of a team that are classes of Python files, which ``load_team`` would run.

    Nothing is imported to find out.
    """
    names = map(str.strip, team.split(","))
    return [name for name in names if PythonName.parse(name) and not folder_of(name)]


def list_teams(teams: Any) -> Any:
    """Teams as a list; what is no list of text is left as it is, to be refused."""
    if isinstance(teams, str | Mapping) or not isinstance(teams, Iterable):
        return teams
    return [*teams]


def is_path(name: str) -> bool:
    """Whether a name is a path, so that what it names depends on the working folder."""
    return name not in names() and bool(PythonName.parse(name) or folder_of(name))


def is_confirmed(team: str, named: Iterable[str]) -> bool:
    """Whether a user has named all Python files of a team that data name, so that they may be run.

    Args:
        team: The team.
        named: The teams that the user has typed.
    """
    confirmed_files = {file for text in named for file in python_files_in(text)}
    return confirmed_files.issuperset(python_files_in(team))


def _describe_registered(point: EntryPoint) -> str:
    """What a policy of another package is, or why it cannot be loaded."""
    origin = f"of the package {package_of(point.name)}"
    try:
        words = inspect.getdoc(type(_instantiate(point.load))) or ""
    except (InputError, _NoPolicyError) as error:
        return f"{error} ({origin})"
    return f"{words.partition(chr(10))[0].rstrip('.')} ({origin})" if words else origin


def _registered_policies() -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=GROUP)}


def _describe_trained(folder: Path) -> str:
    """The description in the config of a trained policy, or the policy that it repeats."""
    training = read_description(folder).training
    if training.name == folder.name:
        return training.description
    return f"{training.name} trained once more, with seed {training.seed}"


CARD = "README.md"  # beside the weights of a trained policy
CARD_LIMIT = 2**20  # bytes


class About(NamedTuple):
    """A policy in words.

    Attributes:
        name: As commands take it.
        origin: Where it comes from: dess, a package, a folder or a file.
        code: Its module and class.
        requires: The fields of a scenario that must have these values; empty if any will do.
        scenarios: The shipped scenarios that it can simulate.
        trained_on: The ranges of the sampled parameters in its training; empty if it has none.
        card: Its model card in Markdown, or what its class says.
    """

    name: str
    origin: str
    code: str
    requires: dict[str, Any]
    scenarios: list[str]
    trained_on: dict[str, Any]
    card: str


def describe_policy(name: str, *, run_files: bool = False) -> About:
    """What there is to know about a policy.

    Args:
        name: The policy.
        run_files: Whether the file of a policy, ``FILE.py:CLASS``, may be run.

    Raises:
        InputError: If it does not exist or cannot be loaded.
    """
    name = current_name(name)
    policy = load(name, run_files=run_files)
    folder = folder_of(name)
    described = read_description(folder) if folder else None
    requires = described.layout.model_dump() if described and described.layout else {}
    scenarios = {
        scenario: load_scenario(scenario).model_dump(mode="json") for scenario in scenario_names()
    }
    trained_on = described.training.scenario if described and described.layout else ""
    return About(
        name=name,
        origin=_describe_origin(name),
        code=f"{type(policy).__module__}:{type(policy).__qualname__}",
        requires=requires,
        scenarios=[n for n, fields in scenarios.items() if requires.items() <= fields.items()],
        trained_on={field: scenarios[trained_on][field] for field in SAMPLED}
        if trained_on in scenarios
        else {},
        card=_read_card(folder) or inspect.getdoc(type(policy)) or "",
    )


def list_departures(policies: Iterable[str], spaces: Iterable[ScenarioSpace]) -> list[str]:
    """A line for each trained policy that has to act outside of the ranges of its training.

    Args:
        policies: The names of policies and teams.
        spaces: The scenarios in which they act.
    """
    folders = {name: folder_of(name) for team in policies for name in team.split(",")}
    trained = {name: folder for name, folder in folders.items() if folder}
    if not trained:
        return []
    lines = []
    spaces = [*spaces]
    present = field_ranges(spaces)
    # No policy that is shipped was trained on these.
    conditions = []
    if any(space.radio.steps for space in spaces):
        conditions.append("a rate in steps (trained on eq. 9)")
    if any(space.consumption.is_on for space in spaces):
        conditions.append("slots that do not all take 1 % of the battery (trained on 1 %)")
    for name, folder in trained.items():
        with suppress(InputError):  # whoever loads it says what is wrong
            beyond = [
                f"{field} {_format_range(present[field])} (trained on {_format_range([low, high])})"
                for field, (low, high) in read_description(folder).ranges.items()
                if field in present and not low <= present[field][0] <= present[field][1] <= high
            ]
            beyond += conditions
            if beyond:
                lines.append(f"{name} acts outside of its training: {listed(beyond)}")
    return lines


def _format_range(ends: Iterable[float]) -> str:
    return " to ".join(dict.fromkeys(f"{end:g}" for end in ends))


def _read_card(folder: Path | None) -> str:
    """The model card in the folder of a trained policy; empty without one."""
    try:
        return read_text(folder / CARD, CARD_LIMIT) if folder else ""
    except Missing:
        return ""


def _describe_origin(name: str) -> str:
    """Where a policy comes from, in words."""
    if name in (*CLASSES, *trained_names()):
        return f"shipped with dess {version('dess')}"
    if folder := folder_of(name):
        return f"the folder {folder}"
    if file := PythonName.parse(name):
        return f"the file {file.path}"
    return f"the package {package_of(name)}"
