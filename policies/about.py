"""What there is to know about a policy: where it comes from, what it can simulate, its card."""

import inspect
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import dess
from dess.errors import InputError
from dess.files.reading import Missing, read_text
from dess.policies.learner.description import ranges_of, read_description
from dess.policies.registry import (
    FILE,
    SHIPPED,
    TypedByUser,
    folder_of,
    load,
    package_of,
    trained_names,
)
from dess.scenario import SAMPLED, ScenarioSpace, load_scenario, scenario_names

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


def about(name: str) -> About:
    """What there is to know about a policy that a user asks for.

    Raises:
        InputError: If it does not exist or cannot be loaded.
    """
    policy, folder = load(TypedByUser(name)), folder_of(name)
    described = read_description(folder) if folder else None
    requires = described.layout.model_dump() if described and described.layout else {}
    scenarios = {name: load_scenario(name).model_dump(mode="json") for name in scenario_names()}
    trained_on = described.training.scenario if described and described.layout else ""
    return About(
        name=name,
        origin=_origin(name),
        code=f"{type(policy).__module__}:{type(policy).__qualname__}",
        requires=requires,
        scenarios=[n for n, fields in scenarios.items() if requires.items() <= fields.items()],
        trained_on={field: scenarios[trained_on][field] for field in SAMPLED}
        if trained_on in scenarios
        else {},
        card=_card(folder) or inspect.getdoc(type(policy)) or "",
    )


def departures(policies: Iterable[str], spaces: Iterable[ScenarioSpace]) -> list[str]:
    """A line for each trained policy that has to act outside of the ranges of its training.

    Args:
        policies: The names of policies and teams.
        spaces: The scenarios in which they act.
    """
    lines, here = [], ranges_of(spaces)
    for name in dict.fromkeys(name for team in policies for name in team.split(",")):
        with suppress(InputError):  # whoever loads it says what is wrong
            folder = folder_of(name)
            trained = read_description(folder).ranges if folder else {}
            beyond = [
                f"{field} {_span(here[field])} (trained on {_span([low, high])})"
                for field, (low, high) in trained.items()
                if field in here and not low <= here[field][0] <= here[field][1] <= high
            ]
            if beyond:
                lines.append(f"{name} acts outside of its training: {', '.join(beyond)}")
    return lines


def _span(ends: Iterable[float]) -> str:
    return " to ".join(dict.fromkeys(f"{end:g}" for end in ends))


def _card(folder: Path | None) -> str:
    """The model card in the folder of a trained policy; empty without one."""
    try:
        return read_text(folder / CARD, CARD_LIMIT) if folder else ""
    except Missing:
        return ""


def _origin(name: str) -> str:
    """Where a policy comes from, in words."""
    if name in (*SHIPPED, *trained_names()):
        return f"shipped with dess {dess.__version__}"
    if folder := folder_of(name):
        return f"the folder {folder}"
    if file := FILE.fullmatch(name):
        return f"the file {file['path']}"
    return f"the package {package_of(name)}"
