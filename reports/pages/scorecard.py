"""The replication scorecard as HTML: a table, and on a phone a card per claim.

The words of the page stand in ``templates/scorecard.html``; here is what it fills in.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import groupby

from IPython.display import HTML

from analysis import numbers
from analysis.replication import paper
from analysis.replication.measures import Quantity
from analysis.replication.scorecard import Finding, Row
from analysis.replication.verdict_rules import NO_RESULTS, VERDICTS
from analysis.stats.intervals import LEVEL
from analysis.stats.verdict import ABOVE, BELOW, HOLDS, IN_PART, INCONCLUSIVE, REFUTED
from reports.pages.template import template

# The class and the sign of each verdict; the sign helps readers who cannot see the colours.
LOOKS = {
    HOLDS: ("holds", "✓"),
    IN_PART: ("in-part", "◐"),
    INCONCLUSIVE: ("open", "?"),
    REFUTED: ("refuted", "✗"),
    NO_RESULTS: ("none", "–"),
}


def as_html(rows: Sequence[Row], departures: Sequence[str] = ()) -> HTML:
    """The scorecard.

    Args:
        rows: The result of ``analysis.replication.scorecard.scorecard``.
        departures: In what the policy with the paper's network departs from the paper.
    """
    columns = [*zip(*(row.findings for row in rows), strict=True)]
    page = template("scorecard.html", figure=figure, percent=numbers.percent)
    html = page.render(
        sections=[(s, [*of_section]) for s, of_section in groupby(rows, lambda row: row.section)],
        total=len(rows),
        policies=[*map(_usual_policy, columns)],
        counts=[_counts(findings) for findings in columns],
        looks=LOOKS,
        best_uavs=paper.BEST_UAVS,
        above=ABOVE,
        below=BELOW,
        level=numbers.level(LEVEL),
        spreads=_spreads(rows),
        departures=numbers.words(departures) if departures else "",
    )
    return HTML(html)


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


def _usual_policy(findings: Iterable[Finding]) -> str:
    """The policy of most findings; empty if none has any."""
    named = Counter(finding.policy for finding in findings if finding.policy)
    return named.most_common(1)[0][0] if named else ""


def _counts(findings: Iterable[Finding]) -> dict[str, int]:
    """The number of findings with each verdict."""
    given = Counter(finding.verdict for finding in findings)
    return {verdict: given[verdict] for verdict in VERDICTS if given[verdict]}


def _spreads(rows: Iterable[Row]) -> list[tuple[str, Quantity]]:
    """The ends of the intervals of printed figures, as ``[88.1, 91.8]``, with the figures."""
    printed = [row.claim.printed for row in rows if row.claim.printed]
    spreads = {quantity.interval: quantity for quantity in printed if quantity.low is not None}
    return [(numbers.interval(*ends).partition(" % ")[2], q) for ends, q in spreads.items()]
