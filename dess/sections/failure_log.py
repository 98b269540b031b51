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
    _log_uavs(log, time, before, after)
    _log_pads(log, time, before, after)
    _log_nodes(log, time, before, after, nodes)


def _log_uavs(log: EventLog, time: float, before: State, after: State) -> None:
    for i, (was, u) in enumerate(zip(before.uavs[0], after.uavs[0], strict=True)):
        where = u["x"], u["y"]
        if u["grounded"] > was["grounded"] or u["end"] == LOST != was["end"]:
            log.add(time, "uav_failure", i, -1, u["battery"], *where, u["battery"])
        if u["grounded"] < was["grounded"]:
            log.add(time, "uav_repair", i, -1, u["battery"], *where, u["battery"])
        if u["collected"] < was["collected"]:
            log.add(time, "data_lost", i, -1, was["collected"], *where, u["battery"])


def _log_pads(log: EventLog, time: float, before: State, after: State) -> None:
    change = after.missions[0]["pads_out"] - before.missions[0]["pads_out"]
    for pad in np.nonzero(change)[0].tolist():
        log.add(time, "pad_failure" if change[pad] > 0 else "pad_repair", -1, -1, pad)


def _log_nodes(log: EventLog, time: float, before: State, after: State, nodes: np.ndarray) -> None:
    were, are = before.sensors[0]["silent"], after.sensors[0]["silent"]
    for k in np.nonzero(were != are)[0].tolist():
        event = "node_failure" if are[k] else "node_repair"
        held = before.residual[0, k] if are[k] else after.residual[0, k]
        log.add(time, event, -1, k, held, *nodes[k])
    if after.missions[0]["node_data_lost"] and not after.missions[0]["continuous"]:
        for k in np.nonzero(are & (before.residual[0] > 0))[0].tolist():
            log.add(time, "data_lost", -1, k, before.residual[0, k], *nodes[k])
