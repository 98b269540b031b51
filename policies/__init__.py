"""Who decides: heuristics, the return guard, and policies from outside packages."""

from policies.registry import load, load_team, names

__all__ = ["load", "load_team", "names"]
