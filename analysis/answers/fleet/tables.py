"""The fleets of a search for the cheapest one as tables: by their cost, with the answer marked."""

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.fleet.costs import (
    format_amount,
    purchase_prices,
    setting_cells,
    yearly_parts,
)
from dess.analysis.answers.fleet.requirements import (
    metric_asked_for,
    requirements_in_words,
    requirements_of,
)
from dess.analysis.answers.fleet.verdicts import (
    VERDICTS_EXPLAINED,
    checked_settings,
    judge_fleets_everywhere,
    judge_settings,
    reported_metrics,
)
from dess.analysis.answers.settings.points import has_conditions, intervals_in_words
from dess.analysis.metrics import COST, SUCCESS
from dess.analysis.results.tables import Results
from dess.analysis.tables import INTERVALS, MOST_ROWS, Table, format_counts


def fleet_rows(results: Results) -> pd.DataFrame:
    """The fleets that the answer was chosen from, of all policies, the cheapest first.

    Returns:
        Rows of ``judge_settings``, or of ``judge_fleets_everywhere`` if there are several
        conditions, with the parts of the cost (``purchase`` and ``running``) and ``answer``:
        ``answer`` for the answer, ``selected`` for the cheapest fleet of another policy that meets
        the requirements. Where costs are those of a year, the columns of ``costs.yearly_parts``
        follow.
    """
    if has_conditions(results):
        rows = judge_fleets_everywhere(results)
    else:
        rows = judge_settings(results)
    rows = rows.sort_values(COST, kind="stable", ignore_index=True)
    best = search_of(results).best
    is_answer = rows["selected"] & (rows["policy"] == best.policy)
    marks = np.where(is_answer, "answer", np.where(rows["selected"], "selected", ""))
    purchase = purchase_prices(results)
    bought = [purchase[point] for point in rows["point"]]
    rows = rows.assign(purchase=bought, running=rows[COST] - bought, answer=marks)
    if results.prices.years is None:
        return rows
    return rows.merge(yearly_parts(results), on=["policy", "fleet"], how="left")


def shown_rows(rows: pd.DataFrame, most: int) -> pd.DataFrame:
    """At most so many rows of ``fleet_rows``: the first ones, or those around the answer."""
    place = int(np.argmax(rows["answer"] == "answer"))
    first = 0
    if place >= most:
        first = max(0, min(place - most // 2, len(rows) - most))
    return rows.iloc[first : first + most]


def fleet_cells(results: Results, rows: pd.DataFrame, further: str = SUCCESS) -> pd.DataFrame:
    """Rows of ``fleet_rows`` as text, for page and terminal.

    Args:
        results: The study.
        rows: The rows.
        further: A metric that is shown beside those of the requirements.
    """
    cells = setting_cells(rows.assign(condition=""), [])
    cells = cells.rename(columns={"Cost": f"Cost [{results.prices.unit}]"})
    place = cells.shape[1]
    if results.prices.pays_for_missions:
        cells.insert(place, "Purchase", rows["purchase"].map(format_amount))
        running = "Flights' cost" if results.study.years else "Missions' cost"
        cells.insert(place + 1, running, rows["running"].map(format_amount))
    is_answer = rows["answer"] == "answer"
    cells["Requirements"] = rows["verdict"].where(~is_answer, rows["verdict"] + ": the answer")
    further_metric = metric_asked_for(results, further)
    for metric in dict.fromkeys([*reported_metrics(results), further_metric]):
        if metric.column != COST:
            cells[metric.name] = numbers.format_estimates(rows, metric.column, metric.written)
    head = results.replications_head if results.study.years else "n"
    return cells.assign(**{head: format_counts(rows["n"])})


def fleet_table(results: Results, further: str = SUCCESS) -> Table:
    """The fleets by cost, with their verdicts, the required metrics, and the answer marked.

    Args:
        results: The study.
        further: A metric that is shown beside those of the requirements.
    """
    rows = fleet_rows(results)
    top = shown_rows(rows, MOST_ROWS)
    requirements = requirements_in_words(requirements_of(results))
    caption = f"The fleets, the cheapest first. Required: {requirements}. "
    if len(top) < len(rows):
        caption += f"{len(top)} of {len(rows):,} rows, those about the answer; the data have all. "
    if has_conditions(results):
        caption += (
            "All conditions together: costs are means over them, a metric is that of the condition "
            "under which the fleet is worst at it. "
        )
    caption += f"{VERDICTS_EXPLAINED.capitalize()}. Means with {intervals_in_words(results)}"
    return Table(fleet_cells(results, top, further), caption, rows)


def condition_table(results: Results) -> Table:
    """The fleets under every condition, whether they meet the requirements there."""
    rows = judge_settings(results)
    top = rows.head(MOST_ROWS)
    shown = setting_cells(top, reported_metrics(results))
    shown.insert(shown.columns.get_loc("Cost") + 1, "Requirements", top["verdict"])
    shown["Cheapest that meets them"] = top["selected"].map({True: "yes", False: ""})
    shown["n"] = format_counts(top["n"])
    caption = f"The fleets under every condition; means with {intervals_in_words(results)}"
    return Table(shown, caption, rows)


def check_table(results: Results) -> Table:
    """The check of the selected fleets: all that is required, and the way home."""
    rows = checked_settings(results)
    shown = setting_cells(rows, reported_metrics(results))
    shown = shown.assign(n=format_counts(rows["n"]))
    caption = (
        "The check of the selected fleets on missions that had no part in the search: means with "
        f"{INTERVALS}"
    )
    return Table(shown, caption, rows)
