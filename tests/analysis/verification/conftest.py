"""A small study with event logs, for the checks of logs and records."""

from typing import Any

import pytest

from dess.analysis.verification import measurements

# Two groups of communication slots, a queue for one pad, all nodes emptied now and then.
CHANGES: dict[str, Any] = {"communication_slots": 6, "pads": 1, "initial_data": [0, 2], "quota": 90}


@pytest.fixture(scope="session")
def results(studied):
    return studied(logged=8, set=CHANGES)


@pytest.fixture(scope="session")
def logs(results):
    return measurements.logs_of(results)


@pytest.fixture(scope="session")
def again(results):
    return measurements.simulate_missions(results, 3)
