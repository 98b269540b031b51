"""All checks of the page of the verification, on the results that they compare::

suite = Suite("results")
table = judge_checks(suite.checks(block=100))
"""

from pathlib import Path

import numpy as np
import pandas as pd

from dess import InputError
from dess.analysis.answers.summary import best_policy
from dess.analysis.metrics import METRICS, SUCCESS
from dess.analysis.numbers import join_words
from dess.analysis.results.tables import load_results
from dess.analysis.verification import balances, draws, measurements
from dess.analysis.verification.checks import Check
from dess.analysis.verification.measurements import STUDY

_LARGEST_BLOCK = 1_000_000  # missions


class Suite:
    """What is checked: the study ``verification``, and all other studies in the same folder.

    Attributes:
        study: The results of the study ``verification``.
        others: The results of the other studies, by name.
        damaged: The names of the studies that cannot be loaded.
        studies: All studies that could be loaded, by name.
        again: Missions that ``dess report`` has simulated for this page.
        space: The scenario of the study.
        logs: All missions with an event log.
        realisations: One mission with an event log per replication, since policies share the draws.
        missions: The missions of one policy, since policies share the draws.
        best: The policy whose intervals are checked.
        arrivals: (T, K) data units that arrived in all realisations, by mission slot and node.
        rates: The rates of a single UAV, as ``measurements.compare_rates`` returns them.
    """

    def __init__(self, folder: str | Path):
        """Load a folder that contains a results folder per study.

        Raises:
            InputError: If the study or its cross-check is missing or damaged, or if its scenario
                has failures, landing or arrivals in continuous time, which the checks of logs do
                not know.
        """
        self.study = load_results(Path(folder) / STUDY)
        self.space = self.study.scenario()
        for section in ("failures", "arrivals", "landing"):
            if self.space.has(section):
                raise InputError(
                    Path(folder) / STUDY,
                    f"its scenario has {section}, which this page cannot check",
                    "a study without them",
                )
        self.again = measurements.read_cross_check(folder, self.study)
        self.others, self.damaged = balances.studies_in(Path(folder), but=STUDY)
        self.studies = {STUDY: self.study, **self.others}
        self.logs = measurements.logs_of(self.study)
        self.realisations = measurements.longest_logs(self.logs)
        self.missions = self._missions_of(self.study.policies[0])
        self.best = best_policy(self.study.missions)
        self.arrivals = measurements.arrivals_by_slot(self.realisations, self.space)
        self.rates = measurements.compare_rates(self.space, self.again.rates)

    @property
    def names(self) -> str:
        """The names of the studies in words, including those that cannot be loaded."""
        unread = f" (not read, incomplete or of other code: {join_words(self.damaged)})"
        return join_words([f"`{name}`" for name in self.studies]) + (unread if self.damaged else "")

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
            raise InputError("block", repr(block), f"2..{_LARGEST_BLOCK:,}")
        space = self.space
        seed = self.study.store.manifest.seed
        logs = self.logs
        of_best = self._missions_of(self.best)
        initial = np.array([log.initial for log in self.realisations])
        start_cells = np.array([log.first_cell for log in self.realisations])
        return [
            *draws.arrival_checks(self.arrivals, space.arrival_rate),
            draws.arrived_check(self.missions, space),
            draws.rate_check(self.rates),
            *draws.shadowing_checks(measurements.shadowing_deviates(space, self.again.slots)),
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
                draws.coverage_check(name, of_best[metric].to_numpy(), block, metric == SUCCESS)
                for metric, name in METRICS.items()
            ),
        ]
