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
from dess.analysis.answers import summary
from dess.analysis.answers.learning import BAND
from dess.analysis.paper import measures, rules, values
from dess.analysis.paper.rules import MARGIN, NEAR
from dess.analysis.results.tables import Results
from dess.analysis.stats.verdict import INCONCLUSIVE, position
from dess.files.reading import parse_toml, read_text
from dess.policies.learner.config import TrainingConfig

TRAININGS = "trainings"  # in place of the name of a study, for claims about learning curves

_FILE = Path(__file__).with_name("claims.toml")
_NAMED = {
    "near": numbers.margin(NEAR),
    "near_share": f"{100 * NEAR:g} %",
    "band": f"{100 * BAND:g} %",
    "level": numbers.margin(MARGIN),
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


def _claim(
    section: Mapping[str, Any],
    rule: str,
    measure: str,
    arguments: Mapping[str, Any] | None = None,
    printed: Mapping[str, Any] | None = None,
    **others: Any,
) -> Claim:
    """A claim of a section of the file."""
    measured = partial(getattr(measures, measure), **arguments or {})
    number = _printed(**printed) if printed else None
    place = {name: section[name] for name in ("page", "study")}
    return Claim(rule=RULES[rule], measure=measured, printed=number, **place, **others)


def _printed(
    figure: str,
    less: str = "",
    missions: str = "",
    is_share: bool = False,
    unit: measures.Unit = "share",
    name: str = "",
) -> measures.Quantity:
    """A number of the paper, with an interval if it is a share of a known number of missions."""
    n = _figure(missions) if missions else 0
    if is_share:
        return measures.Quantity(values.spread(_figure(figure), n), n)
    return measures.Quantity.exact(_figure(figure) - (_figure(less) if less else 0), n, unit, name)


def _figure(path: str) -> Any:
    """A number by its name: ``FIG_4.2.success`` is that of two UAVs in the table of Fig. 4."""
    name, *keys = path.split(".")
    return reduce(
        lambda table, key: table[int(key) if key.isdigit() else key], keys, getattr(values, name)
    )


_CONTENT = parse_toml(read_text(_FILE), str(_FILE))
RULES = {name: Rule.of(name, **texts) for name, texts in _CONTENT["rules"].items()}
CLAIMS = [
    _claim(section, **claim)
    for section in _CONTENT["sections"].values()
    for claim in section["claims"]
]

# The learner with the paper's observation, network and algorithm.
PAPERS_NETWORK = "ddqn-paper"
SMALLER = "-paper"  # ends the names of studies of it alone, with fewer missions
# Policies that have learned nothing.
NULLS = ("greedy", "random", "random-unguarded")
COLUMNS = ("the best learned policy", PAPERS_NETWORK, *NULLS)
# Trainings with and without transfer learning, with the methods of the best learned policy.
VARIANTS = ("quick", "no transfer")


@dataclass(frozen=True)
class Row:
    """A claim of the paper, its rule in words, and the findings of each policy."""

    claim: Claim
    rule: str
    findings: tuple[measures.Finding, ...]

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

    @cache
    def evidence(study: str, column: str) -> Any:
        if study == TRAININGS:
            return _evidence_of_trainings(trainings, column)
        own = study + SMALLER
        is_own = column == PAPERS_NETWORK and own in studies
        return _evidence_of_policy(studies, own if is_own else study, column)

    known = {"margin": margin(studies)}
    words = {"margin": numbers.margin(known["margin"]), **_NAMED}
    return [
        Row(
            claim,
            f"{claim.basis} {claim.rule.words.format(**words)}".strip(),
            tuple(_finding(claim, known, partial(evidence, claim.study, c)) for c in COLUMNS),
        )
        for claim in CLAIMS
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


def _evidence_of_policy(
    studies: Mapping[str, Results], study: str, column: str
) -> measures.EvidenceOfPolicy:
    """The results in a study of the policy of a column: the best one, of a learned column."""
    if study not in studies:
        raise measures.MissingError(f"the study {study} has not been run")
    results, which = studies[study], f"policy {column}"
    learners = summary.learners(results)
    if column in NULLS:
        among = [name for name in results.policies if name == column]
    elif column == COLUMNS[0]:
        among, which = [name for of in learners.values() for name in of], "learned policy"
    else:
        among = learners.get(column, [])
    if not among:
        raise measures.MissingError(f"the study {study} has no {which}")
    best = among[0] if len(among) == 1 else summary.best_policy(results.missions, among)
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


def _finding(
    claim: Claim, known: Mapping[str, Any], evidence: Callable[[], Any]
) -> measures.Finding:
    """What a policy's results say about a claim or, without results, why there are none."""
    printed, judge = claim.printed, claim.rule.judge
    if printed:
        known = {**known, "printed": printed.interval}
    takes = known.keys() & signature(judge).parameters.keys()
    try:
        of_study = evidence()
        judge = partial(judge, **{name: known[name] for name in takes})
        compared = claim.compared
        found = claim.measure(judge, of_study.pairs(**compared) if compared else of_study)
    except measures.MissingError as missing:
        return measures.Finding(measures.NO_RESULTS, note=str(missing))
    except InputError:  # a study of another design
        return measures.Finding(
            measures.NO_RESULTS, note="the results come from a study of another design"
        )
    if any(quantity.n == 1 for quantity in found.quantities):
        found = replace(found, verdict=INCONCLUSIVE)  # one mission or training shows nothing
    first, against = found.quantities[0], ""
    if printed and first.unit == printed.unit and first.unit in ("share", "points"):
        against = position(first.interval, printed.interval.mean)
    return replace(found, policy=of_study.policy, against=against)


def answer(rows: Sequence[Row]) -> str:
    """How many claims hold for the best learned policy, diagnostic ones and all, in words."""
    telling = [row for row in rows if row.is_diagnostic]
    held, all_held = (sum(row.findings[0].holds for row in of) for of in (telling, rows))
    short = [f"“{r.claim.text}”" for r in telling if r.findings[0].outcome == measures.FALLS_SHORT]
    return (
        f"Of {len(rows)} claims, {len(telling)} are diagnostic: {numbers.words(NULLS)} do not pass "
        f"them. {names(rows)[0]} passes {held} of these {len(telling)}, and {all_held} of all."
        + f" It falls short of {numbers.words(short)}; open: {len(telling) - held - len(short)}."
        * bool(short)
    )


def names(rows: Sequence[Row]) -> list[str]:
    """For each of ``COLUMNS`` the policy of most of its findings, or its own name."""
    found = []
    for number, name in enumerate(COLUMNS):
        policies = Counter(row.findings[number].policy for row in rows)
        del policies[""]
        found.append(policies.most_common(1)[0][0] if policies else name)
    return found


def counts(rows: Sequence[Row]) -> pd.DataFrame:
    """The number of verdicts of each kind, for every policy, of diagnostic claims and of all."""
    table = []
    for claims, of in (("diagnostic", [row for row in rows if row.is_diagnostic]), ("all", rows)):
        for number, name in enumerate(names(rows)):
            given = Counter(row.findings[number].outcome for row in of)
            counted = {outcome.capitalize(): given[outcome] for outcome in measures.OUTCOMES}
            table.append({"Claims": claims, "Policy": name, **counted})
    return pd.DataFrame(table)


def against_paper(rows: Iterable[Row]) -> pd.DataFrame:
    """The results minus the printed shares, where the paper prints one.

    Returns:
        A row per claim and policy, up to the best that has learned nothing: ``claim``, ``policy``,
        ``mean``, ``low`` and ``high`` of the difference, with the interval of the printed number
        where it has one, and ``n``.
    """
    table = [
        (row.claim.text, finding.policy, *rules.gap(first.interval, printed.interval), first.n)
        for row in rows
        if (printed := row.claim.printed) and printed.unit == "share"
        for finding in row.findings[:3]
        if finding.against and (first := finding.quantities[0])
    ]
    return pd.DataFrame(table, columns=["claim", "policy", "mean", "low", "high", "n"])
