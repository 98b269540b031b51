"""Failures and repairs in the event log: what differs between the state before and after them."""

import numpy as np

from dess.record import EventLog
from dess.state import LOST, State


def log_failures(
    log: EventLog, time: float, before: State, after: State, nodes: np.ndarray
) -> None:
    """Log the failures and repairs at the end of a slot of a single mission.

    Args:
        log: The event log.
        time: The end of the slot.
        before: A copy of the state when the new data had arrived.
        after: The state after the failures and repairs.
        nodes: (K, 2) cells of the nodes.
    """
    mission = after.missions[0]
    for i, (was, u) in enumerate(zip(before.uavs[0], after.uavs[0], strict=True)):
        where = u["x"], u["y"], u["battery"]
        if u["grounded"] > was["grounded"] or u["end"] == LOST != was["end"]:
            log.add(time, "uav_failure", i, -1, u["battery"], *where)
        if u["grounded"] < was["grounded"]:
            log.add(time, "uav_repair", i, -1, u["battery"], *where)
        if u["collected"] < was["collected"]:
            log.add(time, "data_lost", i, -1, was["collected"], *where)
    change = mission["pads_out"] - before.missions[0]["pads_out"]
    for pad in np.nonzero(change)[0].tolist():
        log.add(time, "pad_failure" if change[pad] > 0 else "pad_repair", -1, -1, pad)
    silent, held = after.sensors[0]["silent"], before.residual[0]
    for k in np.nonzero(silent != before.sensors[0]["silent"])[0].tolist():
        event, state = ("node_failure", before) if silent[k] else ("node_repair", after)
        log.add(time, event, -1, k, state.residual[0, k], *nodes[k])
    if mission["node_data_lost"] and not mission["continuous"]:
        for k in np.nonzero(silent & (held > 0))[0].tolist():
            log.add(time, "data_lost", -1, k, held[k], *nodes[k])
