"""The claims of the paper and our verdict on each."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache, partial, reduce
from inspect import signature
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from analysis import numbers
from analysis.answers.learning import BAND
from analysis.paper import measures, values
from analysis.paper.measures import (
    EXCEEDS,
    FALLS_SHORT,
    MARGIN,
    MATCHES,
    NEAR,
    NO_RESULTS,
    NOT_APPLICABLE,
    EvidenceOfPolicy,
    Measured,
    MissingError,
    Quantity,
    Unit,
    evidence_of_policy,
    evidence_of_trainings,
    gap,
)
from analysis.results.tables import Results
from analysis.stats.verdict import ABOVE, BELOW, HOLDS, IN_PART, INCONCLUSIVE, REFUTED, position
from dess import InputError
from dess.files.parsing import parse_toml
from dess.files.reading import read_text
from policies.learner.config import TrainingConfig

TRAININGS = "trainings"  # in place of the name of a study, for claims about learning curves

_FILE = Path(__file__).with_name("claims.toml")
_NAMED = {
    "near": numbers.margin(NEAR),
    "near_share": f"{100 * NEAR:g} %",
    "band": f"{100 * BAND:g} %",
    "level": numbers.margin(MARGIN),
    "crossing": f"{values.CROSSING:,}",
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
        return Quantity(*values.spread(_figure(figure), n), n=n)
    return Quantity(_figure(figure) - (_figure(less) if less else 0), n=n, unit=unit, name=name)


def _figure(path: str) -> Any:
    """A number by its name: ``FIG_4.2.success`` is that of two UAVs in the table of Fig. 4."""
    name, *keys = path.split(".")
    return reduce(
        lambda table, key: table[int(key) if key.isdigit() else key], keys, getattr(values, name)
    )


_CONTENT = parse_toml(read_text(_FILE), str(_FILE))
RULES = {
    name: Rule(judge=getattr(measures, name), **texts) for name, texts in _CONTENT["rules"].items()
}
SECTIONS = {
    key: Section(**section | {"claims": [_claim(**claim) for claim in section["claims"]]})
    for key, section in _CONTENT["sections"].items()
}


# The learner with the paper's observation, network and algorithm.
PAPERS_NETWORK = "ddqn-paper"
SMALLER = "-paper"  # ends the names of studies of it alone, with fewer missions
# Policies that have learned nothing.
NULLS = ("greedy", "random", "random-unguarded")
COLUMNS = ("the best learned policy", PAPERS_NETWORK, *NULLS)
# Trainings with and without transfer learning, with the methods of the best learned policy.
VARIANTS = ("quick", "no transfer")

Evidence = Callable[[str], Any]  # from the name of a study to its evidence


@dataclass(frozen=True)
class Finding:
    """What the results of a policy say about a claim.

    Attributes:
        verdict: One of ``verdict_rules.VERDICTS``.
        policy: The policy; empty for a claim about trainings.
        quantities: The quantities that the verdict is based on; the first one is compared with the
            paper's number.
        against: Where the interval of the first quantity lies relative to the paper's number
            (``stats.verdict.position``); empty if they cannot be compared.
        note: A remark in words, or the reason why there are no results.
    """

    verdict: str
    policy: str = ""
    quantities: tuple[Quantity, ...] = ()
    against: str = ""
    note: str = ""

    @property
    def holds(self) -> bool:
        """Whether the policy passes the claim."""
        return self.verdict == HOLDS

    @property
    def outcome(self) -> str:
        """The verdict as pages write it: one of ``verdict_rules.OUTCOMES``."""
        if self.holds:
            return EXCEEDS if self.against == ABOVE else MATCHES
        short = self.verdict == REFUTED or (self.verdict == IN_PART and self.against == BELOW)
        if short:
            return FALLS_SHORT
        return NOT_APPLICABLE if self.verdict == NO_RESULTS else INCONCLUSIVE


@dataclass(frozen=True)
class Row:
    """A claim of the paper, its section, its rule in words, and the findings of each policy."""

    section: Section
    claim: Claim
    rule: str
    findings: tuple[Finding, ...]

    @property
    def is_diagnostic(self) -> bool:
        """Whether no policy passes the claim that has learned nothing."""
        return not any(finding.holds for finding in self.findings[-len(NULLS) :])


def scorecard(studies: Mapping[str, Results], trainings: pd.DataFrame) -> list[Row]:
    """Every claim with its verdicts, the same for the same results.

    Args:
        studies: Results by the name of the study: ``table4``, ``fig4``, ``fig5``, ``sweet-spot``,
            and with ``SMALLER`` at the end, as far as they have been run.
        trainings: Learning curves, with the columns that ``answers.learning`` reads; may be
            empty.

    Returns:
        A row per claim, with a finding for each of ``COLUMNS``.
    """

    def evidence(
        variants: tuple[str, str] | None, study: str, learner: str = "", policy: str = ""
    ) -> Any:
        if study == TRAININGS:
            return evidence_of_trainings(trainings, variants)
        if learner == PAPERS_NETWORK and study + SMALLER in studies:
            study += SMALLER
        return evidence_of_policy(studies, study, learner, policy)

    policies = (
        partial(evidence, VARIANTS),
        partial(evidence, None, learner=PAPERS_NETWORK),
        *(partial(evidence, None, policy=name) for name in NULLS),
    )
    return [
        row for section in SECTIONS.values() for row in _rows(section, margin(studies), policies)
    ]


def margin(studies: Mapping[str, Results]) -> float:
    """The difference that does not matter: the indifference of the sweet spot's selection."""
    rule = studies["sweet-spot"].manifest["study"]["selection"] if "sweet-spot" in studies else None
    return (rule or {}).get("indifference") or MARGIN


def departures(training: TrainingConfig) -> list[str]:
    """In what a training departs from the paper, in words."""
    n_step, num_envs = training.n_step, training.num_envs
    greedy = all(phase.temperature == 0 for phase in training.phases)
    differs = {
        "the return guard, which masks actions that would be too late to return": training.guard,
        "missions that start with little battery": training.low_battery_starts,
        "early returns": training.early_returns,
        f"{n_step}-step returns": n_step > 1,
        "the Huber loss": training.loss == "huber",
        "epsilon-greedy exploration without softmax": greedy,
        f"{num_envs:,} missions side by side": num_envs > 1,
        "a slow copy of the weights, which is the one evaluated": training.average_rate < 1,
    }
    return [words for words, applies in differs.items() if applies]


def _rows(section: Section, margin: float, policies: Iterable[Evidence]) -> list[Row]:
    """The claims of a section, with findings from the evidence of several policies."""
    evidence = [cache(partial(of_study, section.study)) for of_study in policies]
    return [
        Row(
            section,
            claim,
            claim.rule_in_words(margin),
            tuple(_finding(claim, margin, of_policy) for of_policy in evidence),
        )
        for claim in section.claims
    ]


def _finding(claim: Claim, margin: float, evidence: Callable[[], Any]) -> Finding:
    """What a policy's results say about a claim or, without results, why there are none."""
    try:
        of_study = evidence()
        measured = claim.measure(of_study)
    except MissingError as missing:
        return Finding(NO_RESULTS, note=str(missing))
    except InputError:  # a study of another design
        return Finding(NO_RESULTS, note="the results come from a study of another design")
    policy = of_study.policy if isinstance(of_study, EvidenceOfPolicy) else ""
    verdict, against = _verdict(claim, margin, measured), _against(claim, measured)
    return Finding(verdict, policy, measured.quantities, against, measured.note)


def _verdict(claim: Claim, margin: float, measured: Measured) -> str:
    """The verdict by the rule; a single mission or training cannot show anything."""
    if any(quantity.n == 1 for quantity in measured.quantities):
        return INCONCLUSIVE
    judge = claim.rule.judge
    known: dict[str, Any] = {"margin": margin}
    if claim.printed:
        known["printed"] = claim.printed.interval
    takes = known.keys() & signature(judge).parameters.keys()
    return judge(*measured.arguments, **{name: known[name] for name in takes})


def _against(claim: Claim, measured: Measured) -> str:
    """Where the interval of the first quantity lies relative to the paper's number, if any."""
    first, printed = measured.quantities[0], claim.printed
    if printed is None or first.low is None or first.unit != printed.unit:
        return ""
    return position(first.interval, printed.value)


def against_paper(rows: Iterable[Row]) -> pd.DataFrame:
    """The results minus the printed shares, where the paper prints one.

    Returns:
        A row per claim and policy, up to the best that has learned nothing: ``claim``, ``policy``,
        ``mean``, ``low`` and ``high`` of the difference, with the interval of the printed number
        where it has one, and ``n``.
    """
    table = [
        (row.claim.text, finding.policy, *gap(first.interval, printed.interval), first.n)
        for row in rows
        if (printed := row.claim.printed) and printed.unit == "share"
        for finding in row.findings[:3]
        if finding.against and (first := finding.quantities[0])
    ]
    return pd.DataFrame(table, columns=["claim", "policy", "mean", "low", "high", "n"])
