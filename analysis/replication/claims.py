"""The claims of the paper's Section V, and the rules that judge them, as ``claims.toml`` has them.

The judges of the rules are in ``verdict_rules``, the measures in ``measures``.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial, reduce
from pathlib import Path
from typing import Any, NamedTuple

from analysis import numbers
from analysis.questions.learning.curves import BAND
from analysis.replication import measures, paper, verdict_rules
from analysis.replication.measures import Measured, Quantity, Unit
from analysis.replication.verdict_rules import MARGIN, NEAR
from dess.files.parsing import parse_toml
from dess.files.reading import read_text

TRAININGS = "trainings"  # in place of the name of a study, for claims about learning curves

_FILE = Path(__file__).with_suffix(".toml")
_NAMED = {
    "near": numbers.margin(NEAR),
    "near_share": f"{100 * NEAR:g} %",
    "band": f"{100 * BAND:g} %",
    "level": numbers.margin(MARGIN),
    "crossing": f"{paper.CROSSING:,}",
}


@dataclass(frozen=True)
class Rule:
    """A rule that judges a claim by quantities.

    Attributes:
        words: When the claim holds; names in braces stand for numbers.
        judge: A function from quantities to one of ``verdict_rules.VERDICTS``.
        remark: A remark that follows the words.
    """

    words: str
    judge: Callable[..., str]
    remark: str = ""

    def in_words(self, margin: float) -> str:
        """The rule in words; ``margin`` is the difference that does not matter."""
        text = f"{self.words}; else it is inconclusive. {self.remark}".strip()
        return text.format(margin=numbers.margin(margin), **_NAMED)


@dataclass(frozen=True)
class Claim:
    """A claim of the paper.

    Attributes:
        text: What the paper claims.
        place: Where in the paper the claim stands.
        rule: The rule that judges the claim.
        measure: The function that computes what the rule judges, from the evidence of the section.
        printed: The paper's number, if it prints one.
        basis: What is measured, in words, if the text does not say so.
    """

    text: str
    place: str
    rule: Rule
    measure: Callable[..., Measured]
    printed: Quantity | None = None
    basis: str = ""

    def rule_in_words(self, margin: float) -> str:
        """The rule in words; ``margin`` is the difference that does not matter."""
        return f"{self.basis} {self.rule.in_words(margin)}".strip()


class Section(NamedTuple):
    """Claims about the same evidence: a heading, the page with the evidence, the study, the claims.

    The page is, for example, ``mission.html#fig-4``; the study may be ``TRAININGS``.
    """

    heading: str
    page: str
    study: str
    claims: list[Claim]


def _claim(
    rule: str,
    measure: str,
    arguments: Mapping[str, Any] | None = None,
    printed: Mapping[str, Any] | None = None,
    **texts: str,
) -> Claim:
    """A claim of the file."""
    measured = partial(getattr(measures, measure), **arguments or {})
    number = _printed(**printed) if printed else None
    return Claim(rule=RULES[rule], measure=measured, printed=number, **texts)


def _printed(
    figure: str,
    less: str = "",
    missions: str = "",
    is_share: bool = False,
    unit: Unit = "share",
    name: str = "",
) -> Quantity:
    """A number of the paper, with an interval if it is a share of a known number of missions."""
    n = _figure(missions) if missions else 0
    if is_share:
        return Quantity(*paper.spread(_figure(figure), n), n=n)
    return Quantity(_figure(figure) - (_figure(less) if less else 0), n=n, unit=unit, name=name)


def _figure(path: str) -> Any:
    """A number by its name: ``FIG_4.2.success`` is that of two UAVs in the table of Fig. 4."""
    name, *keys = path.split(".")
    return reduce(
        lambda table, key: table[int(key) if key.isdigit() else key], keys, getattr(paper, name)
    )


_CONTENT = parse_toml(read_text(_FILE), str(_FILE))
RULES = {
    name: Rule(judge=getattr(verdict_rules, name), **texts)
    for name, texts in _CONTENT["rules"].items()
}
SECTIONS = {
    key: Section(**section | {"claims": [_claim(**claim) for claim in section["claims"]]})
    for key, section in _CONTENT["sections"].items()
}
