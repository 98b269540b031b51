"""Completion of names in the shell: what ``--install-completion`` asks for while somebody types.

Each function gets the beginning of a word and returns the words that it may become.
"""

from collections.abc import Iterable


def policies(start: str) -> list[str]:
    """Names of policies; of a team ``P,P,...`` the last one."""
    from policies import names

    before, comma, last = start.rpartition(",")
    return [f"{before}{comma}{name}" for name in _beginning(names(), last)]


def scenarios(start: str) -> list[str]:
    """Names of shipped scenarios, and of families of generated ones up to the seed."""
    from dess.scenario import scenario_families, scenario_names

    families = [name.removesuffix("SEED") for name in scenario_families()]
    return _beginning([*scenario_names(), *families], start)


def studies(start: str) -> list[str]:
    """Names of shipped studies."""
    from analysis import study_names

    return _beginning(study_names(), start)


def configs(start: str) -> list[str]:
    """Names of shipped configs of trainings."""
    from policies.ddqn.config import config_names

    return _beginning(config_names(), start)


def fields(start: str) -> list[str]:
    """Fields of a scenario, as ``--set`` takes them."""
    from dess.scenario import ScenarioSpace, fields_of

    return [f"{name}=" for name in _beginning(fields_of(ScenarioSpace), start)]


def _beginning(names: Iterable[str], start: str) -> list[str]:
    return [name for name in names if name.startswith(start)]
