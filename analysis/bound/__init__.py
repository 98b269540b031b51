"""An upper bound on what any policy can collect in a mission (docs/concepts/bound.md)."""

from analysis.bound.prices import Bound as Bound
from analysis.bound.prices import check_scenario as check_scenario
from analysis.bound.prices import upper_bound as upper_bound
