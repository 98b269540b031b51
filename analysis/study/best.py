"""The best policy that a budget of time allows, for questions that name none.

policies_for([load_scenario("bay")], missions=300)    # ("planner", "greedy")

The choice depends on the question and on what is installed, not on the speed of this machine, so
that the same question has the same answer everywhere.
"""

import logging
from collections.abc import Iterable
from math import ceil
from statistics import mean

from dess.code.libraries import missing
from dess.scenario import ScenarioSpace
from policies.registry import trained_names

# The policies from the slowest to the fastest: the time of a decision [s] as measured on one core.
SECONDS = {"planner": 4e-4, "planner-short": 7e-5, "any": 2.5e-5, "greedy": 2e-6}
BASELINE = "greedy"  # the policy without learning and search that the best one is compared with
# From the best to the worst. A search of the same length is worse for a larger fleet.
OF_SMALL_FLEETS = ("planner", "planner-short", "any", BASELINE)
OF_LARGE_FLEETS = ("planner", "any", "planner-short", BASELINE)
SMALL = 2.0  # UAVs on average

BUDGET = 300.0  # [s]


def policies_for(spaces: Iterable[ScenarioSpace], missions: int) -> tuple[str, ...]:
    """The best policy that the budget allows, and the one that it is compared with.

    Args:
        spaces: The scenarios of the design points.
        missions: Number of missions of every design point.
    """
    spaces = [*spaces]
    made = missions * sum(map(decisions, spaces))
    is_small = mean(mean(space.uavs) for space in spaces) <= SMALL
    ranked = OF_SMALL_FLEETS if is_small else OF_LARGE_FLEETS
    best, *others = [*(name for name in ranked if made * SECONDS[name] <= BUDGET), BASELINE]
    if best in trained_names() and (absent := missing("learning", f"policy {best}")):
        best = others[0]
        logging.getLogger(__name__).warning("note: %s; %s answers", absent, best)
    return tuple(dict.fromkeys((best, BASELINE)))


def decisions(space: ScenarioSpace) -> float:
    """About the decisions of a mission: every UAV flies until its quota is filled."""
    slots = min(ceil(space.quota / space.communication_slots), space.max_slots)
    return sum(space.uavs) / 2 * slots
