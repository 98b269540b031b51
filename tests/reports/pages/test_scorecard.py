"""The scorecard as HTML tells every row whole, in plain words."""

import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser

import pytest

from analysis import numbers
from analysis.replication import measures, paper
from analysis.replication.claims import RULES, Claim, Section
from analysis.replication.measures import Quantity
from analysis.replication.scorecard import Finding, Row
from analysis.replication.verdict_rules import NO_RESULTS, VERDICTS
from analysis.stats.verdict import ABOVE, BELOW, HOLDS, IN_PART, INCONCLUSIVE, REFUTED
from reports.pages.scorecard import as_html

ABSENT = Finding(NO_RESULTS, note="the study fig4 has not run")


def row(
    section: tuple[str, str],
    text: str,
    place: str,
    rule: str,
    printed: Quantity | None,
    *findings: Finding,
) -> Row:
    """A row of the scorecard; pages do not look at how a claim is measured and judged."""
    claim = Claim(text, place, RULES["most"], measures.missed_data, printed)
    return Row(Section(*section, "fig4", [claim]), claim, rule, findings)


TABLE_4, FIG_4 = ("Table IV", "performance.html#table-4"), ("Fig. 4", "mission.html#fig-4")
ROWS = [
    row(
        TABLE_4,
        "Collection ratio <over> missions",
        "Table IV",
        "Holds if it is reached.",
        Quantity(0.798, n=1000),
        Finding(HOLDS, "ddqn", (Quantity(0.859, 0.85, 0.867, 1000),), ABOVE),
        Finding(IN_PART, "plain", (Quantity(0.758, 0.751, 0.765, 1000),), BELOW),
    ),
    row(
        FIG_4,
        "Success at C_S 10 %",
        "Fig. 4b",
        "Holds if C_S does not matter.",
        None,
        Finding(INCONCLUSIVE, "ddqn", (Quantity(-0.0001, -0.009, 0.009, 300, "points", "change"),)),
        ABSENT,
    ),
    row(
        ("Fig. 3", "learning.html"),
        "The reward is higher",
        "Fig. 3a",
        "Holds if it is.",
        Quantity(800_000, unit="steps", name="crossing"),
        Finding(
            REFUTED,
            "quick",
            (Quantity(-12.6, -46.4, 21.2, 3, "reward"), Quantity(3, unit="number", name="UAVs")),
            note="ends below",
        ),
        ABSENT,
    ),
]


@pytest.fixture(scope="module")
def html() -> str:
    return as_html(ROWS).data


def text_of(html: str) -> str:
    bare = re.sub(r"<style>.*?</style>", "", html, flags=re.S)
    return unescape(re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", bare)))


class Elements(HTMLParser):
    """What is open at the end, and what refers to elsewhere."""

    def __init__(self, html: str):
        super().__init__()
        self.open: list[str] = []
        self.links: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.open.append(tag)
        self.links += [value or "" for key, value in attrs if key in ("href", "src")]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_every_row_is_told(html: str) -> None:
    text = text_of(html)
    for row in ROWS:
        assert row.claim.place in text
        assert row.rule in text
    for shown in (
        "Collection ratio <over> missions",
        "79.8 % (n = 1,000)",
        "85.9 % [85.0, 86.7] (n = 1,000)",
        "interval above the paper's number",
        "75.8 % [75.1, 76.5] (n = 1,000)",
        "interval below the paper's number",
        "no number",
        "change: 0.0 [−0.9, +0.9] points (n = 300)",
        "crossing: 800,000 steps",
        "−13 [−46, +21] (n = 3)",
        "UAVs: 3",
        "ends below of quick",
        "the study fig4 has not run",
    ):
        assert shown in text, shown


def test_verdicts_are_words_and_signs_and_are_counted(html: str) -> None:
    text = text_of(html)
    counts = "1 ✓ holds 1 ? inconclusive 1 ✗ does not hold"
    assert f"The best learned policy (ddqn) , of 3 claims: {counts}" in text
    other = "The paper's network and algorithm, with our additions (plain)"
    assert f"{other} , of 3 claims: 1 ◐ holds in part 2 – no results" in text
    for verdict in VERDICTS:
        assert re.search(rf'<span class="verdict [a-z-]+">. {verdict}</span>', html)
    assert html.count('class="verdict ') == 2 * len(ROWS) + 5


def test_on_a_phone_every_cell_has_its_label(html: str) -> None:
    assert html.count('<tr class="claim">') == len(ROWS)
    assert html.count("data-label=") - html.count("attr(data-label") >= 3 * len(ROWS)
    assert html.count('<td data-label="The best learned policy (ddqn)">') == len(ROWS)


def test_it_is_whole_and_loads_nothing(html: str) -> None:
    elements = Elements(html)
    assert not elements.open
    assert elements.links == ["performance.html#table-4", "mission.html#fig-4", "learning.html"]


def test_without_any_results_columns_have_no_policy() -> None:
    rows = [row(FIG_4, "Claim", "Place", "Holds if so.", None, ABSENT, ABSENT)]
    text = text_of(as_html(rows).data)
    assert "The best learned policy , of 1 claim: 1 – no results" in text
    assert "()" not in text


def test_it_says_how_to_read_it() -> None:
    success = Quantity(*paper.spread(0.901, 1000), n=1000)
    rows = [replace(ROWS[0], claim=replace(ROWS[0].claim, printed=success)), *ROWS[1:]]
    text = text_of(as_html(rows, departures=["a guard", "5-step returns"]).data)
    spread = numbers.interval(*success.interval).partition(" % ")[2]
    assert (
        f"At 95 % (Wilson) the intervals are {spread} for a success in 90.1 % of 1,000 missions"
        in text
    )
    assert f"does not hold for all {len(rows)} rows together" in text
    assert (
        "The counts of verdicts are not a score" in text
        and "the same missions that judge it" in text
    )
    assert "plain has the paper's observation, network and Algorithm 1." in text
    assert "It differs from the paper in a guard and 5-step returns." in text
