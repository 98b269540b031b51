"""A planner: a fluid model of the mission, and a search for the best plan in it."""

from policies.planner.policy import LongPlanner, Planner

__all__ = ["LongPlanner", "Planner"]
