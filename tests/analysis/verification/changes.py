"""Logs and results with something changed in them."""

from dataclasses import replace
from typing import Any

from dess.analysis.results.tables import Results
from dess.analysis.verification.measurements import Log


def altered(logs: list[Log], event: str, which: int = 0, **columns: Any) -> list[Log]:
    """The logs with one event of the first changed; of a function, what it makes of the value."""
    events = logs[0].events.copy()
    row = events.index[events["event"] == event][which]
    for name, value in columns.items():
        events.loc[row, name] = value(events.loc[row, name]) if callable(value) else value
    return [replace(logs[0], events=events), *logs[1:]]


def with_records(results: Results, row: int, **values: Any) -> Results:
    """The results with one record changed."""
    missions = results.missions.copy()
    for name, value in values.items():
        missions.loc[row, name] = value(missions.loc[row, name])
    return replace(results, missions=missions)
