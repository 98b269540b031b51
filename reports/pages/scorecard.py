"""The replication scorecard on its page: the answer, the tables of claims, the counts of verdicts.

The words of the tables stand in ``templates/scorecard.html``; here is what it fills in.
"""

from collections import Counter
from collections.abc import Iterable, Sequence

import pandas as pd
from IPython.display import HTML

from analysis import numbers
from analysis.paper.measures import EXCEEDS, FALLS_SHORT, MATCHES, OUTCOMES, Quantity
from analysis.paper.scorecard import COLUMNS, Row
from reports.pages.html import template

_LOOKS = dict.fromkeys(OUTCOMES, "") | {EXCEEDS: "better", MATCHES: "better", FALLS_SHORT: "worse"}


def answer(rows: Sequence[Row]) -> str:
    """How many claims hold for the best learned policy, diagnostic ones and all."""
    telling = [row for row in rows if row.is_diagnostic]
    held, all_held = (sum(row.findings[0].holds for row in of) for of in (telling, rows))
    names = numbers.words(COLUMNS[2:])
    short = [f"“{r.claim.text}”" for r in telling if r.findings[0].outcome == FALLS_SHORT]
    return (
        f"Of {len(rows)} claims, {len(telling)} are diagnostic: {names} do not pass them. "
        f"{_named(rows, 0)} passes {held} of these {len(telling)}, and {all_held} of all."
        + f" It falls short of {numbers.words(short)}; open: {len(telling) - held - len(short)}."
        * bool(short)
    )


def as_html(rows: Sequence[Row], caption: str) -> HTML:
    """A table of claims: the paper's number, and what every policy shows, with the rule."""
    columns = [_named(rows, number) for number in range(len(COLUMNS))]
    page = template("scorecard.html", figure=figure)
    return HTML(page.render(rows=rows, caption=caption, columns=columns, looks=_LOOKS))


def counts(rows: Sequence[Row]) -> pd.DataFrame:
    """The number of verdicts of each kind, for every policy, of diagnostic claims and of all."""
    table = []
    for claims, of in (("diagnostic", [row for row in rows if row.is_diagnostic]), ("all", rows)):
        for number in range(len(COLUMNS)):
            given = Counter(row.findings[number].outcome for row in of)
            counted = {outcome.capitalize(): given[outcome] for outcome in OUTCOMES}
            table.append({"Claims": claims, "Policy": _named(rows, number), **counted})
    return pd.DataFrame(table)


def figure(quantity: Quantity) -> str:
    """A figure with its interval, in its unit: ``97.3 % [96.1, 98.1]``."""
    value, low, high = quantity.interval
    spread = low < high
    match quantity.unit:
        case "share":
            return numbers.interval(value, low, high) if spread else numbers.percent(value)
        case "points":
            text = numbers.points(value, low, high) if spread else numbers.difference(value, 0)
            return f"{text} points"
        case "reward":
            ends = [f"{end:+,.0f}".replace("-", "−") for end in (value, low, high)]
            return f"{ends[0]} [{ends[1]}, {ends[2]}]" if spread else ends[0]
        case "steps":
            return f"{value:,.0f} steps"
    return f"{value:g}"


def _named(rows: Iterable[Row], number: int) -> str:
    """The policy of most findings of a column, or the name of the column."""
    named = Counter(row.findings[number].policy for row in rows if row.findings[number].policy)
    return named.most_common(1)[0][0] if named else COLUMNS[number]
