"""Whether the UAVs of missions that end in the air have the battery for the way home.

A mission of the paper ends where its quotas are filled, and its success does not ask for more. So
what is said of a success goes with the share of the missions in which all UAVs could fly home. With
``landing`` a success ends on the ground, and there is nothing to add.
"""

from collections.abc import Iterable

from dess.analysis import numbers
from dess.analysis.metrics import HOME, SUCCESS
from dess.analysis.results.tables import Results


def may_end_in_the_air(results: Results) -> bool:
    """Whether a success of a study may leave UAVs in the air."""
    scenarios = results.store.manifest.scenarios
    return HOME in results.missions and not all(space.landing for space in scenarios)


def with_way_home(results: Results, metrics: Iterable[str]) -> list[str]:
    """Metrics, with that of the way home after success where missions may end in the air."""
    shown = [*dict.fromkeys(metrics)]
    if SUCCESS in shown and HOME not in shown and may_end_in_the_air(results):
        shown.insert(shown.index(SUCCESS) + 1, HOME)
    return shown


def way_home_range_sentence(results: Results) -> str:
    """In how many missions of the settings all UAVs could fly home; empty where there is no need.

    Args:
        results: A study of several settings.
    """
    if not may_end_in_the_air(results):
        return ""
    shares = results.missions.groupby(["policy", "point"])[HOME].mean()
    ends = numbers.format_span([100 * shares.min(), 100 * shares.max()], "{:.1f}")
    return (
        "Success does not ask for the way home: all UAVs have the battery for it at the end of "
        f"{ends} % of the missions, depending on the setting. With landing = true, missions end on "
        "the ground."
    )
