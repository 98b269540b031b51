"""A process that logs every slot of a mission."""


def log_slots(mission):
    """One line of the event log for each slot."""
    while True:
        yield mission.env.timeout(1)
        mission.log("slot")
