"""The best policy that a budget of time allows, for questions that name none.

policies_for([load_scenario("bay")], missions=300)    # ("planner", "greedy")

The choice depends on the question and on what is installed, not on the speed of this machine, so
that the same question has the same answer everywhere.
"""

import logging
from collections.abc import Iterable
from math import ceil

from dess.code.libraries import missing
from dess.scenario import ScenarioSpace
from policies.registry import trained_names

# The policies from the best to the fastest, and the time of a decision [s] as measured on one core.
SECONDS = {"planner": 4e-4, "planner-short": 7e-5, "any": 2.5e-5, "greedy": 2e-6}
BASELINE = "greedy"  # the policy without learning and search that the best one is compared with

BUDGET = 300.0  # [s]


def policies_for(spaces: Iterable[ScenarioSpace], missions: int) -> tuple[str, ...]:
    """The best policy that the budget allows, and the one that it is compared with.

    Args:
        spaces: The scenarios of the design points.
        missions: Number of missions of every design point.
    """
    decisions = missions * sum(map(_decisions, spaces))
    affordable = (name for name, each in SECONDS.items() if decisions * each <= BUDGET)
    best = next(affordable, BASELINE)
    if best in trained_names() and (absent := missing("learning", f"policy {best}")):
        logging.getLogger(__name__).warning("note: %s; %s answers", absent, BASELINE)
        best = BASELINE
    return tuple(dict.fromkeys((best, BASELINE)))


def _decisions(space: ScenarioSpace) -> float:
    """About the decisions of a mission: every UAV flies until its quota is filled."""
    return sum(space.uavs) / 2 * ceil(space.quota / space.communication_slots)
