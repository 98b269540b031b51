"""All checks of the page of the verification, on the results that they compare::

suite = Suite.load("results")
table = judge(suite.checks(block=100))
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np
import pandas as pd

from analysis.answers.summary import best_policy
from analysis.metrics import METRICS, SUCCESS
from analysis.numbers import words
from analysis.results.tables import Results, load_results
from analysis.verification import balances, draws, measurements
from analysis.verification.checks import Check
from analysis.verification.measurements import STUDY, CrossCheck, Log
from dess import InputError
from dess.scenario import ScenarioSpace

_LARGEST_BLOCK = 1_000_000  # missions


@dataclass(frozen=True)
class Suite:
    """The results of the study ``verification`` and of all other studies in the same folder.

    Attributes:
        study: The results of the study ``verification``.
        others: The results of the other studies, by name.
        damaged: The names of the studies that cannot be loaded.
        again: Missions that ``dess report`` has simulated for this page.
    """

    study: Results
    others: dict[str, Results]
    damaged: list[str]
    again: CrossCheck

    @classmethod
    def load(cls, folder: str | Path) -> Self:
        """Load a folder that contains a results folder per study.

        Raises:
            InputError: If the study or its cross-check is missing or damaged, or if its scenario
                has failures or arrivals in continuous time, which the checks of logs do not know.
        """
        study = load_results(Path(folder) / STUDY)
        for section in ("failures", "arrivals"):
            if getattr(study.scenario(), section).is_on:
                raise InputError(
                    f"{Path(folder) / STUDY}: its scenario has {section}, which this page cannot "
                    "check; allowed: a study without them"
                )
        again = measurements.read(folder, study)
        return cls(study, *balances.studies_in(Path(folder), but=STUDY), again)

    @property
    def studies(self) -> dict[str, Results]:
        """All studies that could be loaded, by their names."""
        return {STUDY: self.study, **self.others}

    @property
    def names(self) -> str:
        """The names of the studies in words, including those that cannot be loaded."""
        unread = f" (not read, incomplete or of other code: {words(self.damaged)})"
        return words([f"`{name}`" for name in self.studies]) + (unread if self.damaged else "")

    @cached_property
    def space(self) -> ScenarioSpace:
        """The scenario of the study."""
        return self.study.scenario()

    @cached_property
    def logs(self) -> list[Log]:
        """All missions with an event log."""
        return measurements.logs_of(self.study)

    @cached_property
    def realisations(self) -> list[Log]:
        """One mission with an event log per replication, since policies share the draws."""
        return measurements.longest(self.logs)

    @cached_property
    def missions(self) -> pd.DataFrame:
        """The missions of one policy, since policies share the draws."""
        return self._missions_of(self.study.policies[0])

    @cached_property
    def best(self) -> str:
        """The policy whose intervals are checked."""
        return best_policy(self.study.missions)

    @cached_property
    def arrivals(self) -> np.ndarray:
        """(T, K) data units that arrived in all realisations, by mission slot and node."""
        return measurements.arrivals(self.realisations, self.space)

    @cached_property
    def rates(self) -> pd.DataFrame:
        """The rates of a single UAV, as ``missions.rates`` returns them."""
        return measurements.rates(self.space, self.again.rates)

    def values(self, metric: str) -> np.ndarray:
        """(n,) a metric of the missions of the best policy."""
        return self._missions_of(self.best)[metric].to_numpy()

    def _missions_of(self, policy: str) -> pd.DataFrame:
        missions = self.study.missions
        return missions[(missions["policy"] == policy) & (missions["point"] == 0)]

    def checks(self, block: int) -> list[Check]:
        """All checks.

        Args:
            block: Number of missions in a block, for the checks of coverage.

        Raises:
            InputError: If the block has no such number.
        """
        if block not in range(2, _LARGEST_BLOCK + 1):
            raise InputError(f"block: {block!r}; allowed: 2..{_LARGEST_BLOCK:,}")
        space, seed, logs = self.space, self.study.store.manifest.seed, self.logs
        initial = np.array([log.initial for log in self.realisations])
        start_cells = np.array([log.first_cell for log in self.realisations])
        return [
            *draws.arrival_checks(self.arrivals, space.arrival_rate),
            draws.arrived_check(self.missions, space),
            draws.rate_check(self.rates),
            *draws.shadowing_checks(measurements.deviates(space, self.again.slots)),
            *draws.communication_checks(logs, seed),
            balances.conservation_check(self.studies),
            balances.balance_check(logs),
            balances.battery_check(logs),
            balances.record_check(logs),
            *balances.realisation_checks(self.study, logs),
            balances.engine_check(self.study, self.again),
            *draws.parameter_checks(self.missions, space),
            *draws.initial_checks(initial, self.missions["initial"].to_numpy(), space),
            draws.start_check(start_cells, space),
            *(
                draws.coverage_check(name, self.values(metric), block, metric == SUCCESS)
                for metric, name in METRICS.items()
            ),
        ]
