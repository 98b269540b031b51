"""From names to policies; outside packages add theirs by the entry point ``dess.policies``."""

import json
import os
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

from dess.errors import InputError
from policies.base import Policy

GROUP = "dess.policies"

# Name -> (where it is, what it does).
SHIPPED = {
    "random": ("policies.heuristics:Random", "a random safe move, clear of teammates"),
    "nearest": ("policies.heuristics:Nearest", "the nearest node with enough data"),
    "greedy": ("policies.heuristics:Greedy", "the best residual data for the distance"),
    "tour": ("policies.heuristics:Tour", "a fixed circuit through the nodes, split among the UAVs"),
}

# One folder per trained policy, and what tells what it is.
TRAINED, CONFIG = Path(__file__).with_name("trained"), "config.json"


def names() -> list[str]:
    """All policies by name, the shipped ones first."""
    shipped = [*SHIPPED, *trained_names()]
    return [*shipped, *sorted(set(_outside()) - set(shipped))]


def trained_names() -> list[str]:
    """The names of the trained policies that are shipped."""
    return sorted(path.parent.name for path in TRAINED.glob(f"*/{CONFIG}"))


def descriptions() -> dict[str, str]:
    """What every policy does, by name, in the order of ``names``; none of them is loaded."""
    known = {name: description for name, (_, description) in SHIPPED.items()}
    known |= {name: _description(TRAINED / name) for name in trained_names()}
    return {name: known.get(name, "of another package") for name in names()}


def load(name: str | Path) -> Policy:
    """The policy of that name, or the trained one in that folder, which has that of its config.

    Raises:
        InputError: If there is no such policy, or it cannot be loaded.
    """
    folder, name = Path(name), str(name)
    if name in SHIPPED:
        module, _, attribute = SHIPPED[name][0].partition(":")
        return getattr(import_module(module), attribute)()
    shipped = name in trained_names()
    if shipped:
        folder = TRAINED / name
    # Without a name it would be the working folder.
    if name and os.path.exists(folder / CONFIG):
        from policies.ddqn.checkpoint import load_policy  # brings torch

        policy = load_policy(folder)
        if shipped:
            policy.name = name
        return policy
    outside = _outside()
    if name not in outside:
        raise InputError(
            f"policy: {name!r} is unknown; allowed: {', '.join(names())}, "
            "or the folder of a trained policy"
        )
    try:
        policy = outside[name].load()()
    except Exception as error:  # somebody else's code: whatever it raises, say whose it was
        raise InputError(
            f"policy: {name} of {outside[name].value} cannot be loaded: {error}"
        ) from error
    if not isinstance(policy, Policy):
        raise InputError(f"policy: {name} of {outside[name].value} has no name and act(view)")
    return policy


def load_team(text: str) -> list[Policy]:
    """The policies of ``"P"`` or ``"P,P,..."``: UAV i gets number ``i % len(team)``.

    Raises:
        InputError: If one of them is unknown.
    """
    return [load(name.strip()) for name in text.split(",")]


def _outside() -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=GROUP)}


def _description(folder: Path) -> str:
    """What the config of a trained policy says that it is for, or of what it is a repetition."""
    training = json.loads((folder / CONFIG).read_text("utf-8"))["training"]
    if training.get("name", folder.name) == folder.name:
        return training["description"]
    return f"{training['name']} trained once more, with seed {training['seed']}"
