"""An auditor of event logs: it replays a mission from its log, and fails where the log is wrong.

It knows only the page ``docs/concepts/model.md`` and the constants of the scenario, and imports
nothing of dess. What the log decides is taken from it: start cells, initial data, the actions that
the UAVs asked for, the SNR of the nodes that were served, the new data, the failures and repairs,
and the battery that gusts cost. All else is computed anew and compared with the log, row by
row. What is taken from the log must be possible.

    report = audit(record.events.columns(), scenario.model_dump())
    report["metrics"]["collected"], report["uavs"][0]["battery"]
"""

from tests.dess.model.auditor.mission import audit

__all__ = ["audit"]
