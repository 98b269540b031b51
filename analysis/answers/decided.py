"""What the rules of a study decided: the precision that was reached, and the selected settings."""

import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.policies.performance import _ENDS
from dess.analysis.answers.settings.points import points_in_words
from dess.analysis.answers.summary import means_of_points
from dess.analysis.measured import ranking_column
from dess.analysis.metrics import metric_of
from dess.analysis.results.tables import Results
from dess.analysis.study.cheapest import Cheapest
from dess.analysis.tables import (
    INTERVALS,
    MOST_ROWS,
    Table,
    format_counts,
    stack_by_policy,
)


def reached_precisions(results: Results) -> pd.DataFrame:
    """How narrow the intervals are, for a study with targets.

    Returns:
        A row per policy, design point and metric: ``policy``, and the fields of
        ``dess.analysis.study.stopping.Reached``. Empty if the study has no targets.
    """
    manifest = results.store.manifest
    if (rule := manifest.study.precision) is None:
        return pd.DataFrame()
    tables = {
        policy: pd.DataFrame(rule.reached(results.store.samples(manifest.parts_of_team(team))))
        for team, policy in enumerate(results.policies)
    }
    return stack_by_policy(tables)


def precision_table(rows: pd.DataFrame, most: int | None = MOST_ROWS) -> Table:
    """The precision of each estimate beside its target.

    Args:
        rows: The ``reached_precisions``.
        most: The largest number of rows that it has; None: all.
    """
    top = rows[:most]
    cells = {
        "Policy": top["policy"],
        "Point": top["point"],
        "Metric": top["metric"].map(lambda metric: metric_of(metric).name),
        "Missions": format_counts(top["missions"]),
        "Mean": top["mean"].map(numbers.format_quantity),
        "Half-width": top["half_width"].map("{:.2g}".format),
        "Target": top["target"].map("{:.2g}".format),
        "Reached": top["met"].map({True: "yes", False: "no: the budget ended"}),
    }
    return Table(pd.DataFrame(cells), f"Half-widths of {INTERVALS}, and their targets", rows)


def selected_settings(results: Results) -> pd.DataFrame:
    """The design point that was selected for every policy, and its guarantee.

    Returns:
        A row per policy: ``policy``, ``point``, ``setting`` in words, number of ``missions``,
        ``left`` (number of points not ruled out), ``guaranteed``, ``guarantee`` in words, and the
        ``metric`` that it is selected by with its ``mean``, ``low`` and ``high`` over the missions
        of the selection. Empty if the study selects nothing. For a study that selects the cheapest
        setting, the rows of ``FleetSearch.selected_fleets``.
    """
    rule = results.study.selection
    if isinstance(rule, Cheapest):
        return search_of(results).selected_fleets()
    words = points_in_words(results)
    rows = []
    for policy in results.policies:
        if (c := results.choice(policy)) is not None:
            selected = (policy, c.best, words[c.best], c.missions, len(c.survivors))
            rows.append((*selected, c.guaranteed, c.guarantee))
    columns = ["policy", "point", "setting", "missions", "left", "guaranteed", "guarantee"]
    table = pd.DataFrame(rows, columns=columns)
    if rule is None:
        return table
    metric = ranking_column(rule.metric, results.missions)
    means = means_of_points(results)
    ends = means.loc[means["metric"] == metric, ["policy", "point", "metric", *_ENDS]]
    return table.merge(ends, on=["policy", "point"], how="left")


def selected_by_cells(selected: pd.DataFrame) -> list[str]:
    """What each setting was selected by, with its interval, as text.

    Args:
        selected: Rows of ``selected_settings``.
    """
    write = metric_of(selected["metric"].iloc[0]).written
    return [write(*ends) for ends in selected[_ENDS].to_numpy(float)]


def selection_table(results: Results) -> Table:
    """The setting that was selected for every policy."""
    data = selected_settings(results)
    cells = {
        "Policy": data["policy"],
        "Selected setting": data["setting"],
        "Missions of the selection": format_counts(data["missions"]),
        "Settings not ruled out": data["left"],
    }
    measure = metric_of(data["metric"].iloc[0])
    cells[measure.label] = selected_by_cells(data)
    caption = f"The setting that was selected for every policy by {measure.within}"
    return Table(pd.DataFrame(cells), caption, data)
