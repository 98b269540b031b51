"""From names to policies; outside packages add theirs by the entry point ``dess.policies``."""

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

# One folder per trained policy.
TRAINED = Path(__file__).with_name("trained")


def names() -> list[str]:
    """All policies by name, the shipped ones first."""
    shipped = [*SHIPPED, *trained_names()]
    return [*shipped, *sorted(set(_outside()) - set(shipped))]


def trained_names() -> list[str]:
    """The names of the trained policies that are shipped."""
    return sorted(path.parent.name for path in TRAINED.glob("*/config.json"))


def load(name: str | Path) -> Policy:
    """The policy of that name, or the trained one in that folder.

    Raises:
        InputError: If there is no such policy, or it cannot be loaded.
    """
    path = Path(name)
    name = str(name)
    if name in trained_names():
        path = TRAINED / name
    if (path / "config.json").exists():
        from policies.ddqn.checkpoint import load_policy

        return load_policy(path)
    if name in SHIPPED:
        module, _, attribute = SHIPPED[name][0].partition(":")
        return getattr(import_module(module), attribute)()
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
