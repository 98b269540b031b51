"""The best setting of every policy, and its means compared with the paper's (Section V-D)."""

import pandas as pd

from analysis import numbers
from analysis.names import METRICS, parameter, value_text
from analysis.questions import summary
from analysis.replication import paper
from analysis.results.tables import Results


def setting(results: Results, point: int) -> dict[str, str]:
    """The values of a design point in words, by the short names of its parameters."""
    values = results.store.manifest.points[point].values
    return {parameter(field).short: value_text(value) for field, value in values.items()}


def table(results: Results) -> pd.DataFrame:
    """A table with a row for the paper and a row per policy: its best setting and its check."""
    checks = {(row.policy, row.metric): row for row in summary.checks(results).itertuples()}
    printed = {name: numbers.percent(paper.SWEET_SPOT[metric]) for metric, name in METRICS.items()}
    rows = [{"Policy": "paper", **dict.fromkeys(setting(results, 0), ""), **printed}]
    for row in summary.selections(results).itertuples():
        means = {
            name: summary.with_mark(checks[row.policy, metric], paper.SWEET_SPOT[metric])
            for metric, name in METRICS.items()
            if checks
        }
        effort = {"Missions": f"{row.missions:,}", "Settings left": str(row.left)}
        effort["Guarantee"] = row.guarantee
        rows.append({"Policy": row.policy, **setting(results, row.point), **means, **effort})
    return pd.DataFrame(rows)
