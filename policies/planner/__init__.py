"""A planner: a fluid model of the mission, and a search for the best plan in it."""

from policies.planner.drawing import Course, plan_of
from policies.planner.policy import LongPlanner, Planner

__all__ = ["Course", "LongPlanner", "Planner", "plan_of"]
