"""The replication scorecard: the claims of the paper's Section V and the results of the studies.

Verdicts are computed for the best learned policy of each study, for the policy with the paper's
observation, network and algorithm, and for policies that have learned nothing. A claim that one of
these passes says nothing about learning: it is not diagnostic.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from inspect import signature
from typing import Any

import pandas as pd

from analysis.replication.claims import SECTIONS, TRAININGS, Claim, Section
from analysis.replication.evidence_of_policy import (
    EvidenceOfPolicy,
    MissingError,
    evidence_of_policy,
    evidence_of_trainings,
)
from analysis.replication.measures import Measured, Quantity
from analysis.replication.verdict_rules import (
    EXCEEDS,
    FALLS_SHORT,
    MARGIN,
    MATCHES,
    NO_RESULTS,
    NOT_APPLICABLE,
    gap,
)
from analysis.results.tables import Results
from analysis.stats.verdict import ABOVE, BELOW, HOLDS, IN_PART, INCONCLUSIVE, REFUTED, position
from dess import InputError
from policies.ddqn.config import TrainingConfig

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
        trainings: Learning curves, with the columns that ``questions.learning`` reads; may be
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
