"""The missions of a panel's baseline, which a page compares with its own."""

from hashlib import sha256

from dess import simulate_batch
from dess.model.record import Records, empty_records
from dess.policies.registry import load
from dess.scenario.scenario import ScenarioSpace

CHECKED = 100  # of the baseline, which are compared with those of Python


def hash_missions(space: ScenarioSpace, policy: str, seed: int, fleet: int) -> list[str]:
    """The SHA-256 hashes of the records of the first missions, as the module writes them.

    Args:
        space: The scenario.
        policy: The policy of all UAVs.
        seed: The seed of the missions.
        fleet: The number of UAVs for which a record has room.
    """
    records = simulate_batch(space, [load(policy)], seed, CHECKED)
    padded = _with_room(records, fleet)
    return [
        sha256(b"".join(kind[row].tobytes() for kind in padded if len(kind))).hexdigest()
        for row in range(CHECKED)
    ]


def _with_room(records: Records, fleet: int) -> Records:
    """Records with room for a fleet, and for what extended scenarios measure."""
    padded = empty_records(len(records.missions), fleet, is_extended=True)
    padded.missions[:] = records.missions
    padded.uavs[:, : records.uavs.shape[1]] = records.uavs
    if len(records.operations):
        padded.operations[:] = records.operations
    return padded
