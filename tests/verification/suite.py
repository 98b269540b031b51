"""All checks of the simulator, on the results that they compare.

suite = Suite(results, others)
table = judge_checks(suite.checks(block=100))
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from dess.analysis.answers.policies.ranks import best_policy
from dess.analysis.metrics import METRICS, SUCCESS
from dess.analysis.results.tables import Results
from tests.verification import balances, draws, measurements
from tests.verification.checks import Check
from tests.verification.measurements import MISSIONS

STUDY = "verification"


class Suite:
    """What is checked: the study ``verification``, and other studies beside it.

    Attributes:
        study: The results of the study ``verification``.
        studies: The results of all studies, by name.
        again: Missions of the study, simulated again with the SimPy engine.
        space: The scenario of the study.
        logs: All missions with an event log.
        realisations: One mission with an event log per replication, since policies share the draws.
        missions: The missions of one policy, since policies share the draws.
        best: The policy whose intervals are checked.
        arrivals: (T, K) data units that arrived in all realisations, by mission slot and node.
        rates: The rates of a single UAV, as ``measurements.compare_rates`` returns them.
        slots: The data of every communication slot of a single UAV.
    """

    def __init__(self, study: Results, others: Mapping[str, Results], again: int = MISSIONS):
        """Simulate what the checks need beside the studies.

        Args:
            study: The results of the study ``verification``.
            others: The results of other studies, by name.
            again: Missions of every policy to simulate again.
        """
        self.study = study
        self.studies = {STUDY: study, **others}
        self.space = study.scenario()
        self.again = measurements.simulate_again(study, again)
        self.logs = measurements.logs_of(study)
        self.realisations = measurements.longest_logs(self.logs)
        self.missions = self._missions_of(study.policies[0])
        self.best = best_policy(study.missions)
        self.arrivals = measurements.arrivals_by_slot(self.realisations, self.space)
        seed = study.store.manifest.seed
        self.rates = measurements.compare_rates(
            self.space, measurements.simulate_rates(self.space, seed)
        )
        self.slots = measurements.simulate_slots(self.space, seed)

    def _missions_of(self, policy: str) -> pd.DataFrame:
        missions = self.study.missions
        return missions[(missions["policy"] == policy) & (missions["point"] == 0)]

    def checks(self, block: int) -> list[Check]:
        """All checks.

        Args:
            block: Number of missions in a block, for the checks of coverage.
        """
        space = self.space
        logs = self.logs
        of_best = self._missions_of(self.best)
        initial = np.array([log.initial for log in self.realisations])
        start_cells = np.array([log.first_cell for log in self.realisations])
        return [
            *draws.arrival_checks(self.arrivals, space.arrival_rate),
            draws.arrived_check(self.missions, space),
            draws.rate_check(self.rates),
            *draws.shadowing_checks(measurements.shadowing_deviates(space, self.slots)),
            *draws.communication_checks(logs, self.study.store.manifest.seed),
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
