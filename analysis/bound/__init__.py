"""An upper bound on what any policy can collect in a mission (``proof.md``)."""

from dess.analysis.bound.prices import Bound as Bound
from dess.analysis.bound.prices import check_scenario as check_scenario
from dess.analysis.bound.prices import upper_bound as upper_bound
