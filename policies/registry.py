"""From names to policies; outside packages add theirs by the entry point ``dess.policies``."""

from importlib import import_module
from importlib.metadata import EntryPoint, entry_points

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


def names() -> list[str]:
    """All policies by name, the shipped ones first."""
    return [*SHIPPED, *sorted(set(_outside()) - set(SHIPPED))]


def load(name: str) -> Policy:
    """The policy of that name.

    Raises:
        InputError: If there is no such policy, or an outside one cannot be loaded.
    """
    if name in SHIPPED:
        module, _, attribute = SHIPPED[name][0].partition(":")
        return getattr(import_module(module), attribute)()
    outside = _outside()
    if name not in outside:
        raise InputError(f"policy: {name!r} is unknown; allowed: {', '.join(names())}")
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
