"""The scorecard as HTML tells every row whole, in plain words."""

import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser

import pytest

from analysis.paper import measures
from analysis.paper.measures import NO_RESULTS, Quantity
from analysis.paper.scorecard import COLUMNS, RULES, Claim, Finding, Row, Section
from analysis.stats.verdict import ABOVE, BELOW, HOLDS, IN_PART, INCONCLUSIVE, REFUTED
from reports.pages.scorecard import answer, as_html, counts

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
    nulls = (ABSENT,) * (len(COLUMNS) - len(findings))
    return Row(Section(*section, "fig4", [claim]), claim, rule, (*findings, *nulls))


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
    return as_html(ROWS, "The claims").data


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
        "exceeds 85.9 % [85.0, 86.7] (n = 1,000)",
        "falls short 75.8 % [75.1, 76.5] (n = 1,000)",
        "no number",
        "inconclusive change: 0.0 [−0.9, +0.9] points (n = 300)",
        "crossing: 800,000 steps",
        "−13 [−46, +21] (n = 3)",
        "UAVs: 3",
        "does not apply the study fig4 has not run",
    ):
        assert shown in text, shown


def test_columns_are_named_by_their_policies_and_verdicts_are_counted(html: str) -> None:
    assert re.findall('<th scope="col">(.*?)</th>', html) == [
        "Claim", "Paper", "ddqn", "plain", *COLUMNS[2:],
    ]  # fmt: skip
    table = counts(ROWS).set_index(["Claims", "Policy"])
    assert table.loc[("all", "ddqn")].tolist() == [1, 0, 1, 1, 0]
    assert table.loc[("diagnostic", "greedy"), "Does not apply"] == 3


def test_the_answer_counts_diagnostic_claims_apart() -> None:
    passed = replace(ROWS[0], findings=(*ROWS[0].findings[:2], *[Finding(HOLDS, "greedy")] * 3))
    assert "Of 3 claims, 3 are diagnostic" in answer(ROWS)
    assert "ddqn passes 1 of these 3, and 1 of all. It falls short of “" in answer(ROWS)
    assert answer(ROWS).endswith("”; open: 1.")
    text = answer([passed, *ROWS[1:]])
    assert "2 are diagnostic" in text and "ddqn passes 0 of these 2, and 1 of all." in text


def test_it_is_whole_and_loads_nothing(html: str) -> None:
    elements = Elements(html)
    assert not elements.open
    assert elements.links == ["performance.html#table-4", "mission.html#fig-4", "learning.html"]
