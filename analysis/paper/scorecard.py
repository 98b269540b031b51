"""The claims of the paper, our verdict on each, and what they say together."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial, reduce
from inspect import signature
from pathlib import Path
from typing import Any, NamedTuple, Self

import pandas as pd

from dess import InputError
from dess.analysis import numbers
from dess.analysis.answers.policies import ranks
from dess.analysis.answers.training.transfer import BAND_LEVEL
from dess.analysis.paper import measures, rules, values
from dess.analysis.paper.rules import MARGIN, NEAR
from dess.analysis.results.learners import trained_policies_by_learner
from dess.analysis.results.tables import Results
from dess.analysis.stats.differences import difference_of_intervals
from dess.analysis.stats.intervals import Interval
from dess.analysis.stats.verdict import INCONCLUSIVE, position_of
from dess.base.files.reading import parse_toml, read_text
from dess.policies.learner.config import TrainingConfig
from dess.policies.learner.description import read_description
from dess.policies.registry import TRAINED
from dess.policies.shipped import NULLS

TRAININGS = "trainings"  # in place of the name of a study, for claims about learning curves

_FILE = Path(__file__).with_name("claims.toml")
_NAMED = {
    "near": numbers.format_margin(NEAR),
    "near_share": f"{100 * NEAR:g} %",
    "band": f"{100 * BAND_LEVEL:g} %",
    "level": numbers.format_margin(MARGIN),
    "crossing": f"{values.CROSSING:,}",
}


class Rule(NamedTuple):
    """A rule that judges a claim by what is measured.

    Attributes:
        words: When the claim holds; names in braces stand for numbers.
        judge: A function from what is measured to one of ``measures.VERDICTS``.
    """

    words: str
    judge: Callable[..., str]

    @classmethod
    def of(
        cls, name: str, words: str, remark: str = "", judge: str = "", above: Any = None
    ) -> Self:
        """A rule of the file: its judge has its name, another one, or is ``rules.all_above``."""
        of_limits = partial(rules.all_above, above)
        text = f"{words}; else it is inconclusive. {remark}".strip()
        return cls(text, of_limits if above else getattr(rules, judge or name))


class Claim(NamedTuple):
    """A claim of the paper.

    Attributes:
        page: The page with the evidence, for example ``mission.html#fig-4``.
        study: The study with the evidence, or ``TRAININGS``.
        text: What the paper claims.
        place: Where in the paper the claim stands.
        rule: The rule that judges the claim.
        measure: The function that finds what the evidence says to the rule's judge.
        compared: The parameter whose values are compared, and the metric, if it is about such.
        printed: The paper's number, if it prints one.
        basis: What is measured, in words, if the text does not say so.
        weakness: Whether the claim is that something is lost, so that no policy passes it.
        printed_metric: The metric whose printed mean the number is, if it is over a known number of
            missions; ``values.printed_intervals`` has its interval.
    """

    page: str
    study: str
    text: str
    place: str
    rule: Rule
    measure: Callable[..., measures.Finding]
    compared: Mapping[str, Any] | None = None
    printed: measures.Quantity | None = None
    basis: str = ""
    weakness: bool = False
    printed_metric: str = ""

    def with_interval(self, means: Mapping[str, Mapping[str, Interval]]) -> Self:
        """The claim with the interval of its printed mean, by study and metric, if it has one."""
        if self.printed is None or not self.printed_metric or self.study not in means:
            return self
        interval = means[self.study][self.printed_metric]
        return self._replace(printed=self.printed._replace(interval=interval))


def _read_claim(
    section: Mapping[str, Any],
    rule: str,
    measure: str,
    arguments: Mapping[str, Any] | None = None,
    printed: Mapping[str, Any] | None = None,
    **others: Any,
) -> Claim:
    """A claim of a section of the file."""
    measured = partial(getattr(measures, measure), **arguments or {})
    number = None
    metric = ""
    if printed:
        number = _printed_quantity(**printed)
        if number.n:
            metric = printed["figure"].rpartition(".")[2]
    return Claim(
        page=section["page"],
        study=section["study"],
        rule=RULES[rule],
        measure=measured,
        printed=number,
        printed_metric=metric,
        **others,
    )


def _printed_quantity(
    figure: str,
    less: str = "",
    missions: str = "",
    unit: measures.Unit = "share",
    name: str = "",
) -> measures.Quantity:
    """A number of the paper, and the number of missions that it is a mean of, if that is known."""
    n = 0
    if missions:
        n = _printed_number(missions)
    return measures.Quantity.exact(
        _printed_number(figure) - (_printed_number(less) if less else 0), n, unit, name
    )


def _printed_number(path: str) -> Any:
    """A number by its name: ``FIG_4.2.success`` is that of two UAVs in the table of Fig. 4."""
    name, *keys = path.split(".")
    return reduce(
        lambda table, key: table[int(key) if key.isdigit() else key], keys, getattr(values, name)
    )


_CONTENT = parse_toml(read_text(_FILE), str(_FILE))
RULES = {name: Rule.of(name, **texts) for name, texts in _CONTENT["rules"].items()}
CLAIMS = [
    _read_claim(section, **claim)
    for section in _CONTENT["sections"].values()
    for claim in section["claims"]
]

# The learner with the paper's observation, network and algorithm.
PAPERS_NETWORK = "ddqn-paper"
SMALLER = "-paper"  # ends the names of studies of it alone, with fewer missions

COLUMNS = ("the best learned policy", PAPERS_NETWORK, *NULLS)
# Trainings with and without transfer learning, with the methods of the best learned policy.
VARIANTS = ("quick", "no transfer")


# The kinds of claims, by what is known of the policies that have learned nothing.
DIAGNOSTIC, PASSED, OPEN, WEAKNESS = "diagnostic", "passed without learning", "open", "weakness"
UNTESTED = "untested"
KINDS = {
    DIAGNOSTIC: "The diagnostic claims: every policy without learning is shown to fail them",
    PASSED: "Claims that a policy passes that has learned nothing",
    OPEN: "Claims that no policy without learning passes, nor is each shown to fail them",
    WEAKNESS: "Weaknesses that the paper names: a policy has them too, or does not have them",
    UNTESTED: "Claims that nothing here tests",
}


@dataclass(frozen=True)
class Row:
    """A claim of the paper, its rule in words, and the findings of each policy."""

    claim: Claim
    rule: str
    findings: tuple[measures.Finding, ...]

    @property
    def kind(self) -> str:
        """One of ``KINDS``.

        A claim is diagnostic if every policy that has learned nothing, and to which it applies, is
        shown to fail it. A policy that is inconclusive is not.
        """
        if all(finding.outcome == measures.NOT_APPLICABLE for finding in self.findings):
            return UNTESTED
        if self.claim.weakness:
            return WEAKNESS
        nulls = [
            finding
            for finding in self.findings[-len(NULLS) :]
            if finding.outcome != measures.NOT_APPLICABLE
        ]
        if any(finding.passes for finding in nulls):
            return PASSED
        if nulls and all(finding.fails for finding in nulls):
            return DIAGNOSTIC
        return OPEN


def scorecard(studies: Mapping[str, Results], trainings: pd.DataFrame) -> list[Row]:
    """Every claim with its verdicts, the same for the same results.

    Args:
        studies: Results by the name of the study: ``table4``, ``fig4``, ``fig5``, ``sweet-spot``,
            and with ``SMALLER`` at the end, as far as they have been run.
        trainings: Learning curves, with the columns that ``answers.training`` reads; may be
            empty.

    Returns:
        A row per claim, with a finding for each of ``COLUMNS``.
    """

    @cache
    def evidence(study: str, column: str) -> Any:
        if study == TRAININGS:
            return _evidence_of_trainings(trainings, column)
        smaller_study = study + SMALLER
        is_own = column == PAPERS_NETWORK and smaller_study in studies
        return _evidence_of_policy(studies, smaller_study if is_own else study, column)

    from_studies = {"margin": indifference_margin(studies)}
    means = {
        name: values.printed_intervals(studies[name], name)
        for name in values.PRINTED
        if name in studies
    }

    def find(claim: Claim, column: str) -> measures.Finding:
        finding = _find_for_claim(claim, from_studies, partial(evidence, claim.study, column))
        return _limit_short_training(column, finding)

    words = {"margin": numbers.format_margin(from_studies["margin"]), **_NAMED}
    return [
        Row(
            claim,
            f"{claim.basis} {claim.rule.words.format(**words)}".strip(),
            tuple(find(claim, column) for column in COLUMNS),
        )
        for claim in (claim.with_interval(means) for claim in CLAIMS)
    ]


def indifference_margin(studies: Mapping[str, Results]) -> float:
    """The difference that does not matter: the indifference of the sweet spot's selection."""
    rule = None
    if "sweet-spot" in studies:
        rule = studies["sweet-spot"].manifest["study"]["selection"]
    return (rule or {}).get("indifference") or MARGIN


def _limit_short_training(column: str, finding: measures.Finding) -> measures.Finding:
    """A finding on the paper's network, which a training that is too short leaves inconclusive.

    It stands for the paper's learner, as trainings with and without transfer do. Other learners
    stand for themselves.
    """
    if column != PAPERS_NETWORK or finding.verdict == measures.NO_RESULTS:
        return finding
    updates = _count_updates(read_description(TRAINED / PAPERS_NETWORK).training)
    if updates >= values.CROSSING:
        return finding
    note = f"one training of {updates:,} updates{measures.TOO_SHORT}"
    notes = [*filter(None, [finding.note]), note]
    return replace(finding, verdict=INCONCLUSIVE, note="; ".join(notes))


def _count_updates(training: TrainingConfig) -> int:
    """The number of training steps of a training."""
    return training.ticks * training.updates


def departures_in_words(training: TrainingConfig) -> list[str]:
    """In what a training departs from the paper, in words."""
    n_step, num_envs = training.n_step, training.num_envs
    updates = _count_updates(training)
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
        f"its length, {updates:,} updates where the curves of the paper's two trainings cross at "
        f"{values.CROSSING:,}": updates < values.CROSSING,
    }
    return [words for words, applies in differs.items() if applies]


def _evidence_of_policy(
    studies: Mapping[str, Results], study: str, column: str
) -> measures.EvidenceOfPolicy:
    """The results in a study of the policy of a column: the best one, of a learned column."""
    if study not in studies:
        raise measures.MissingError(f"the study {study} has not been run")
    results = studies[study]
    which = f"policy {column}"
    learners = trained_policies_by_learner(results)
    if column in NULLS:
        among = [name for name in results.policies if name == column]
    elif column == COLUMNS[0]:
        among = [name for checkpoints in learners.values() for name in checkpoints]
        which = "learned policy"
    else:
        among = learners.get(column, [])
    if not among:
        raise measures.MissingError(f"the study {study} has no {which}")
    if len(among) == 1:
        best = among[0]
    else:
        best = ranks.best_policy(results.missions, among)
    return measures.EvidenceOfPolicy(results, best)


def _evidence_of_trainings(trainings: pd.DataFrame, column: str) -> measures.EvidenceOfTrainings:
    """The trainings with transfer learning and without; only the best learned policy has them."""
    if column != COLUMNS[0]:
        raise measures.MissingError(
            "no trainings of this policy with and without transfer learning"
        )
    if trainings.empty or not {*VARIANTS} <= {*trainings["variant"]}:
        raise measures.MissingError(f"no trainings {' and '.join(VARIANTS)}")
    return measures.EvidenceOfTrainings(trainings, *VARIANTS)


def _find_for_claim(
    claim: Claim, from_studies: Mapping[str, Any], evidence: Callable[[], Any]
) -> measures.Finding:
    """What a policy's results say about a claim or, without results, why there are none."""
    printed = claim.printed
    judge = claim.rule.judge
    arguments = dict(from_studies)
    if printed:
        arguments["printed"] = printed.interval
    takes = arguments.keys() & signature(judge).parameters.keys()
    try:
        of_study = evidence()
        judge = partial(judge, **{name: arguments[name] for name in takes})
        compared = claim.compared
        finding = claim.measure(judge, of_study.pairs(**compared) if compared else of_study)
    except measures.MissingError as missing:
        return measures.Finding(measures.NO_RESULTS, note=str(missing))
    except InputError:  # a study of another design
        return measures.Finding(
            measures.NO_RESULTS, note="the results come from a study of another design"
        )
    if any(quantity.n == 1 for quantity in finding.quantities):
        finding = replace(finding, verdict=INCONCLUSIVE)  # one mission or training shows nothing
    finding = replace(finding, policy=of_study.policy, weakness=claim.weakness)
    first, *others = finding.quantities
    if not printed or first.unit != printed.unit or first.unit not in ("share", "points"):
        return finding
    beyond = difference_of_intervals(first.interval, printed.interval)
    shown = first, measures.Quantity(beyond, 0, "points", "minus the paper's"), *others
    return replace(finding, quantities=shown, against=position_of(beyond))


def of_kind(rows: Iterable[Row], kind: str) -> list[Row]:
    """The claims of one of ``KINDS``."""
    return [row for row in rows if row.kind == kind]


def scorecard_sentence(rows: Sequence[Row]) -> str:
    """How many claims hold for the best learned policy, by kinds of claims, in words.

    A weakness that the policy shares with the paper's is no claim that it passes.
    """
    telling, passed, undecided, weaknesses, untested = (of_kind(rows, kind) for kind in KINDS)
    policy = policy_names(rows)[0]
    holding = sum(row.findings[0].passes for row in telling)
    short = [f"“{row.claim.text}”" for row in telling if row.findings[0].fails]
    without, undecided_held = (
        sum(row.findings[0].passes for row in rows_of_kind) for rows_of_kind in (passed, undecided)
    )
    shared = sum(row.findings[0].outcome == measures.SHARED for row in weaknesses)
    sentences = [
        f"Of {len(telling)} claims of the paper that tell learning from "
        f"chance, {policy} passes {holding}: {numbers.join_words(NULLS)}, as far as they were "
        "simulated, are shown to fail them."
    ]
    if short:
        sentences.append(f"It falls short of {numbers.join_words(short)}.")
    sentences.append(
        f"Of the other {len(rows) - len(telling)}, it passes {without} of {len(passed)} that a "
        f"policy without learning passes too, and {undecided_held} of {len(undecided)} on which "
        f"such policies decide nothing; it is shown to have {shared} of {len(weaknesses)} "
        "weaknesses that the paper names."
    )
    if untested:
        sentences.append(f"Nothing here tests {len(untested)}.")
    return " ".join(sentences)


def policy_names(rows: Sequence[Row]) -> list[str]:
    """For each of ``COLUMNS`` the policy of most of its findings, or its own name."""
    names = []
    for number, name in enumerate(COLUMNS):
        policies = Counter(row.findings[number].policy for row in rows)
        del policies[""]
        names.append(policies.most_common(1)[0][0] if policies else name)
    return names


def count_verdicts(rows: Sequence[Row]) -> pd.DataFrame:
    """The number of verdicts, for every policy and kind of claims; without those never given."""
    table = []
    for kind in KINDS:
        for number, name in enumerate(policy_names(rows)):
            outcomes = Counter(row.findings[number].outcome for row in of_kind(rows, kind))
            counted = {outcome.capitalize(): outcomes[outcome] for outcome in measures.OUTCOMES}
            table.append({"Claims": kind, "Policy": name, **counted})
    frame = pd.DataFrame(table)
    return frame.loc[:, [bool(frame[column].any()) for column in frame]]


def against_paper(rows: Iterable[Row]) -> pd.DataFrame:
    """The results minus the printed shares, where the paper prints one.

    Returns:
        A row per claim and policy, up to the best that has learned nothing: ``claim``, ``policy``,
        ``mean``, ``low`` and ``high`` of the difference, with the interval of the printed number
        where it has one, and ``n``.
    """
    table = [
        (
            row.claim.text,
            finding.policy,
            *finding.quantities[1].interval,
            finding.quantities[0].n,
        )
        for row in rows
        if row.claim.printed and row.claim.printed.unit == "share"
        for finding in row.findings[:3]
        if finding.against
    ]
    return pd.DataFrame(table, columns=["claim", "policy", "mean", "low", "high", "n"])
