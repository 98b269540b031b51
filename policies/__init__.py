"""Policies: heuristics, the return guard, the learned policy, and policies of other packages.

policy = policies.load("greedy")      # by name, or the folder of a trained policy
team = policies.load_team("ddqn,tour")
actions = policy.act(view)
"""

from policies.registry import load, load_team, names

__all__ = ["load", "load_team", "names"]


def __dir__() -> list[str]:
    return [*__all__]
