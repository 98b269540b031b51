"""A planner: a fluid model of the mission, and a search for the best plan in it."""

from dess.policies.planner.courses import Course, first_plan, plan_of
from dess.policies.planner.policy import Budget, LongPlanner, Planner, ShortPlanner

__all__ = ["Budget", "Course", "LongPlanner", "Planner", "ShortPlanner", "first_plan", "plan_of"]
