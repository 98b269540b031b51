"""Policies by name. Other packages register theirs under the entry point ``dess.policies``.

load("greedy"), load("ddqn"), load("runs/my-training"), load_team("greedy,tour")
"""

import json
import os
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

from dess.code.libraries import needs
from dess.errors import InputError, one_of
from policies.base import Policy

GROUP = "dess.policies"

# Name -> (module and class, description).
SHIPPED = {
    "random": ("policies.heuristics:Random", "a random safe move, clear of teammates"),
    "nearest": ("policies.heuristics:Nearest", "the nearest node with enough data"),
    "greedy": ("policies.heuristics:Greedy", "the best residual data for the distance"),
    "tour": ("policies.heuristics:Tour", "a fixed circuit through the nodes, split among the UAVs"),
}

# One folder per trained policy, and the file that describes it.
TRAINED, CONFIG = Path(__file__).with_name("trained"), "config.json"


def names() -> list[str]:
    """All policies by name, the shipped ones first."""
    shipped = [*SHIPPED, *trained_names()]
    return [*shipped, *sorted(set(_outside()) - set(shipped))]


def trained_names() -> list[str]:
    """The names of the trained policies that are shipped."""
    return sorted(path.parent.name for path in TRAINED.glob(f"*/{CONFIG}"))


def descriptions() -> dict[str, str]:
    """The descriptions of all policies, in the order of ``names``; no policy is loaded."""
    known = {name: description for name, (_, description) in SHIPPED.items()}
    known |= {name: _description(TRAINED / name) for name in trained_names()}
    return {name: known.get(name, "of another package") for name in names()}


def load(name: str | Path) -> Policy:
    """Load a policy by its name, or the trained policy of a folder, named by its config.

    Raises:
        InputError: If the policy does not exist or cannot be loaded.
    """
    folder, name = Path(name), str(name)
    if name in SHIPPED:
        module, _, attribute = SHIPPED[name][0].partition(":")
        return getattr(import_module(module), attribute)()
    shipped = name in trained_names()
    if shipped:
        folder = TRAINED / name
    # An empty name would be the working folder.
    if name and os.path.exists(folder / CONFIG):
        needs("learning", f"policy {name}")
        from policies.ddqn.checkpoint import load_policy  # imports torch

        policy = load_policy(folder)
        if shipped:
            policy.name = name
        return policy
    outside = _outside()
    if name not in outside:
        raise InputError(
            f"policy: {name!r} is unknown{one_of(name, names(), 'the folder of a trained policy')}"
        )
    try:
        policy = outside[name].load()()
    except Exception as error:  # code of another package may raise anything; name the package
        raise InputError(
            f"policy: {name} of {outside[name].value} cannot be loaded: {error}"
        ) from error
    if not isinstance(policy, Policy):
        raise InputError(f"policy: {name} of {outside[name].value} has no name and act(view)")
    return policy


def load_team(text: str) -> list[Policy]:
    """Load the policies of ``"P"`` or ``"P,P,..."``: UAV i gets number ``i % len(team)``.

    Raises:
        InputError: If one of them is unknown.
    """
    return [load(name.strip()) for name in text.split(",")]


def _outside() -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=GROUP)}


def _description(folder: Path) -> str:
    """The description in the config of a trained policy, or the policy that it repeats."""
    training = json.loads((folder / CONFIG).read_text("utf-8"))["training"]
    if training.get("name", folder.name) == folder.name:
        return training["description"]
    return f"{training['name']} trained once more, with seed {training['seed']}"
