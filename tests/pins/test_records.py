"""Records of missions stay the same to the bit, whatever is moved."""

from hashlib import sha256
from typing import Any

import numpy as np
import pytest
from numpy.lib.recfunctions import repack_fields

from dess import policies
from dess.model.batch import simulate_batch
from dess.scenario.scenario import load_scenario
from tests.pins.pinned import pinned

# Few pads, wind, failures and the age of the data.
EXTENDED: dict[str, Any] = {
    "pads": 2,
    "wind": {"strength": 0.6, "direction": 40, "gusts": 0.4, "seed": 5},
    "failures": {"uav_rate": 0.005, "uav_repair": 20.0, "pad_rate": 0.01, "pad_repair": 30.0},
    "age": {"measured": True, "reward": 0.5},
}
SEAS: dict[str, dict[str, Any]] = {"paper": {}, "archipelago:7": {}, "bay": EXTENDED}
TEAMS = ["greedy", "age", "planner-short", "ddqn", "generalist"]


def bytes_of(table: np.ndarray) -> bytes:
    """The bytes of a table without the columns that are younger than the pins."""
    younger = ("home", "way_home", "charged", "down")
    names = [name for name in table.dtype.names or () if name not in younger]
    return repack_fields(table[names]).tobytes()


@pytest.mark.parametrize("team", TEAMS)
def test_the_records_of_a_policy_are_the_kept_ones(team):
    hashes = []
    for sea, changes in SEAS.items():
        if team == "ddqn" and sea != "paper":
            continue  # it acts on the paper's sea only
        records = simulate_batch(load_scenario(sea, **changes), policies.load(team), 2030, 8)
        content = sha256(b"".join(map(bytes_of, records))).hexdigest()
        hashes.append(f"{sea} {content}\n")
    pinned(f"records/{team}.txt", "".join(hashes))
