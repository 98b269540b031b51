"""The replication scorecard as HTML: a table, and on a phone a card per claim."""

from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from itertools import groupby
from typing import Any

from IPython.display import HTML
from jinja2 import Environment, PackageLoader
from markupsafe import Markup

from analysis import numbers
from analysis.replication import paper
from analysis.replication.evidence_of_policy import Finding, Quantity
from analysis.replication.rules import NO_RESULTS, VERDICTS
from analysis.replication.scorecard import Row
from analysis.stats.intervals import LEVEL
from analysis.stats.verdict import HOLDS, IN_PART, INCONCLUSIVE, REFUTED

COLUMNS = {
    "learned": "The best learned policy",
    "papers_network": "The paper's network and algorithm, with means of ours",
}

# Verdict -> class and sign: never told by colour alone.
_LOOK = {
    HOLDS: ("holds", "✓"),
    IN_PART: ("in-part", "◐"),
    INCONCLUSIVE: ("open", "?"),
    REFUTED: ("refuted", "✗"),
    NO_RESULTS: ("none", "–"),
}
_AGAINST = {
    paper.ABOVE: "wholly above the paper's figure",
    paper.LEVEL: "around the paper's figure",
    paper.BELOW: "wholly below the paper's figure",
}


def scorecard(
    rows: Sequence[Row],
    pages: Collection[str] | None = None,
    departures: Sequence[str] = (),
) -> HTML:
    """The scorecard.

    Args:
        rows: As of ``analysis.replication.scorecard.scorecard``.
        pages: File names of the pages that there are, to link to; None for all.
        departures: What of the policy with the paper's network is not the paper's.
    """
    environment = Environment(
        loader=PackageLoader("reports", "templates"), autoescape=True, trim_blocks=True
    )
    usual = {column: _usual(getattr(row, column) for row in rows) for column in COLUMNS}
    titles = {
        column: f"{name} ({usual[column]})" if usual[column] else name
        for column, name in COLUMNS.items()
    }
    parts = [
        (part, [_claim(row, pages, usual) for row in own])
        for part, own in groupby(rows, key=lambda row: row.part)
    ]
    html = environment.get_template("scorecard.html").render(
        explanation=_explanation(rows, usual["papers_network"], departures),
        counts=[_count(rows, column, title) for column, title in titles.items()],
        titles=[*titles.values()],
        parts=parts,
        badge=_badge,
    )
    return HTML(html)


def _explanation(rows: Sequence[Row], papers: str, departures: Sequence[str]) -> list[str]:
    """How to read the scorecard, a paragraph each."""
    spreads = {each.interval: each for row in rows for each in row.printed if each.low is not None}
    examples = [
        f"{numbers.interval(*each.interval).partition(' % ')[2]} for a success in "
        f"{numbers.percent(each.value)} of {each.n:,} missions"
        for each in spreads.values()
    ]
    verdicts = (
        "What Section V of the paper claims, and whether it is so here. Every verdict is computed "
        "from results by the rule that stands with the claim. A claim holds, or does not hold, "
        "where whole intervals say so; it holds in part where a part of it is shown; where the "
        "missions or trainings here leave it open, it cannot be told. A figure of the paper holds "
        "if it is reached; better ones hold, too."
    )
    no_score = (
        f"The counts are no score. Rows overlap, as those that find {paper.BEST_UAVS} UAVs the "
        f"best; intervals are of {numbers.level(LEVEL)} each, unless a rule says otherwise, not of "
        f"all {len(rows)} rows at once, so some may miss by chance; and the best learned policy of "
        "a study is chosen on the missions that judge it, which flatters it. What follows from the "
        "model by itself, as that success takes a charge, is left out."
    )
    spread = (
        "The paper's figures are means of missions as well, but it prints no intervals"
        + (
            f". At {numbers.level(LEVEL)} (Wilson) they are {numbers.words(examples)}; the verdicts on "
            "these allow for that"
            if examples
            else ""
        )
        + ". Of its other figures it says too little for one: they count as exact, which makes "
        "verdicts on them a little too sure."
    )
    ours = (
        f"{papers or 'The other policy'} has the paper's observation, network and Algorithm 1. Not "
        f"the paper's, but ours, are {numbers.words(departures)}. So its column does not tell what "
        "the paper's means come to by themselves."
    )
    return [verdicts, no_score, spread, *([ours] if departures else [])]


def _claim(row: Row, pages: Collection[str] | None, usual: dict[str, str]) -> dict[str, Any]:
    of = row.evidence.partition("#")[0]
    return {
        "text": row.claim,
        "place": row.place,
        "evidence": row.evidence if pages is None or of in pages else "",
        "rule": row.rule,
        "printed": [*map(_shown, row.printed)],
        "findings": [_finding(getattr(row, column), usual[column]) for column in COLUMNS],
    }


def _finding(finding: Finding, usual: str) -> dict[str, Any]:
    whose = f"of {finding.policy}" if finding.policy not in ("", usual) else ""
    notes = (_AGAINST.get(finding.against, ""), finding.note, whose)
    return {
        "verdict": finding.verdict,
        "figures": [*map(_shown, finding.quantities)],
        "notes": [note for note in notes if note],
    }


def _shown(quantity: Quantity) -> Markup:
    """``name: 97.3 % [96.1, 98.1] (n = 300)``, numbers on one line each."""
    name = f"{quantity.name}: " if quantity.name else ""
    number = f"(n = {quantity.n:,})" if quantity.n else ""
    return Markup("{}<span>{}</span> <span>{}</span>").format(name, _figure(quantity), number)


def _figure(quantity: Quantity) -> str:
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


def _usual(findings: Iterable[Finding]) -> str:
    """The policy of most findings."""
    named = Counter(finding.policy for finding in findings if finding.policy)
    return named.most_common(1)[0][0] if named else ""


def _count(rows: Sequence[Row], column: str, title: str) -> dict[str, Any]:
    """How often every verdict is given."""
    given = Counter(getattr(row, column).verdict for row in rows)
    verdicts = [{"verdict": v, "number": given[v]} for v in VERDICTS if given[v]]
    return {"title": title, "total": len(rows), "verdicts": verdicts}


def _badge(verdict: str) -> Markup:
    look, sign = _LOOK[verdict]
    return Markup('<span class="verdict {}">{} {}</span>').format(look, sign, verdict)
