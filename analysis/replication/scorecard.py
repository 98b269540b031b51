"""The replication scorecard: the claims of the paper's Section V beside what the studies found.

Verdicts are computed, for two policies: the best learned one of each study, and the one with the
paper's observation, network and algorithm.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from analysis.replication.claims import Claim, section_v
from analysis.replication.evidence_of_policy import Case, Finding, MissingError, Quantity, Studies
from analysis.replication.rules import MARGIN, NO_RESULTS
from analysis.results.tables import Results
from analysis.stats.verdict import INCONCLUSIVE
from dess.errors import InputError

# By learner: that with the paper's observation, network and algorithm.
PAPERS_NETWORK = "ddqn-paper"
# Trainings with and without transfer learning, with the means of the best learned policy.
VARIANTS = ("quick", "no transfer")

# Missions flown again for each number of UAVs, to see where they fly.
FLIGHTS = 12


@dataclass(frozen=True)
class Row:
    """A claim of the paper with its verdicts.

    Attributes:
        part: The heading that it belongs under.
        claim: The claim.
        place: Where the paper makes it.
        printed: The paper's figures; empty if it prints none.
        rule: In words, how the verdicts are computed.
        evidence: The page that shows it, and the section: ``mission.html#fig-4``.
        learned: By the best learned policy of each study.
        papers_network: By the policy with the paper's observation, network and algorithm.
    """

    part: str
    claim: str
    place: str
    printed: tuple[Quantity, ...]
    rule: str
    evidence: str
    learned: Finding
    papers_network: Finding


def scorecard(
    studies: Mapping[str, Results], trainings: pd.DataFrame, flights: int = FLIGHTS
) -> list[Row]:
    """Every claim with its verdicts.

    Args:
        studies: Results by the name of the study: ``table4``, ``fig4``, ``fig5``, ``sweet-spot``,
            those there are.
        trainings: Learning curves, with the columns that ``curves`` reads; may be empty.
        flights: How many missions of Fig. 4 are flown again for each number of UAVs.

    Returns:
        A row per claim, the same for the same results.
    """
    everything = Studies(studies, trainings, flights)
    cases = Case(everything, (), VARIANTS), Case(everything, (PAPERS_NETWORK,))
    return [
        Row(
            c.part,
            c.text,
            c.place,
            c.printed,
            c.rule,
            c.evidence,
            *(_judged(c, each) for each in cases),
        )
        for c in section_v(margin(studies))
    ]


def of_policy(
    studies: Mapping[str, Results], policy: str, part: str
) -> list[tuple[Claim, Finding]]:
    """The claims under a heading with what the results of one policy say, whatever it is."""
    case = Case(Studies(studies, pd.DataFrame(), FLIGHTS), named=policy)
    own = (claim for claim in section_v(margin(studies)) if claim.part == part)
    return [(claim, _judged(claim, case)) for claim in own]


def departures(training: Mapping[str, Any]) -> list[str]:
    """What of a training is not the paper's, in words.

    Args:
        training: The settings of ``policies.ddqn``, as ``config.json`` of the policy has them.
    """
    n_step, num_envs = training["n_step"], training["num_envs"]
    greedy = all(phase["temperature"] == 0 for phase in training["phases"])
    found = {
        "the return guard, which masks actions that leave no way back": training["guard"],
        "missions that start with little battery": training["low_battery_starts"],
        "early returns": training["early_returns"],
        f"{n_step}-step returns": n_step > 1,
        "the Huber loss": training["loss"] == "huber",
        "epsilon-greedy exploration without softmax": greedy,
        f"{num_envs:,} missions side by side": num_envs > 1,
        "a slow copy of the weights, which is the one evaluated": training["average_rate"] < 1,
    }
    return [words for words, ours in found.items() if ours]


def _judged(claim: Claim, case: Case) -> Finding:
    """What a policy's results say of a claim; without results, why there are none.

    A single mission, or training, has no spread that could make anything sure.
    """
    try:
        found = claim.judge(case)
        alone = any(quantity.n == 1 for quantity in found.quantities)
        return replace(found, verdict=INCONCLUSIVE) if alone else found
    except MissingError as missing:
        return Finding(NO_RESULTS, note=str(missing))
    except InputError:  # another design, or missions that this code flies in another way
        return Finding(NO_RESULTS, note="the results there are were not made for it")


def margin(studies: Mapping[str, Results]) -> float:
    """The indifference of the sweet spot's selection; the page on parameters goes by it, too."""
    rule = studies["sweet-spot"].manifest["study"]["selection"] if "sweet-spot" in studies else None
    return (rule or {}).get("indifference") or MARGIN
