"""Policies: heuristics, the return guard, the learned policy, and policies of other packages.

    >>> policy = dess.policies.load("greedy")      # by name, or the folder of a trained policy
    >>> [policy.name for policy in dess.policies.load_team("ddqn,tour")]
    ['ddqn', 'tour']

``policy.act(view)`` gives the actions of the UAVs in a view.
"""

from pathlib import Path

from dess.policies import registry
from dess.policies.registry import Policy, names

__all__ = ["load", "load_team", "names"]


def load(name: str | Path) -> Policy:
    """Load a policy by its name, from the folder of a trained policy, or from a Python file.

    Args:
        name: One of ``names()``; a folder that ``dess train`` has written; or ``FILE.py:CLASS``,
            which is run.

    Raises:
        InputError: If the policy does not exist or cannot be loaded.
    """
    return registry.load(name, run_files=True)


def load_team(text: str) -> list[Policy]:
    """Load the policies of ``"P"`` or ``"P,P,..."``: UAV i gets number ``i % len(team)``.

    Raises:
        InputError: If one of them does not exist or cannot be loaded.
    """
    return registry.load_team(text, run_files=True)


def __dir__() -> list[str]:
    return [*__all__]
