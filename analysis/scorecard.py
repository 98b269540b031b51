"""The replication scorecard: the claims of the paper's Section V beside what the studies found.

Verdicts are computed, for two policies: the best learned one of each study, and the one that
learned with the paper's own means.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

from analysis.case import Case, Evidence, Finding, MissingError, Quantity
from analysis.claims import MARGIN, NO_RESULTS
from analysis.results import Results
from analysis.section_v import Claim, section_v
from dess.errors import InputError

# By learner: that with the paper's observation, network and algorithm; the first that there is.
PAPER_MEANS = ("ddqn-paper",)
# Trainings with and without transfer learning: by all means of this project, by the paper's alone.
VARIANTS = ("quick", "no transfer")
PAPER_VARIANTS = ("none of the three", "none of the three, no transfer")

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
        page: File name of the page that shows the evidence.
        learned: By the best learned policy of each study.
        paper_means: By the policy that learned with the paper's own means.
    """

    part: str
    claim: str
    place: str
    printed: tuple[Quantity, ...]
    rule: str
    page: str
    learned: Finding
    paper_means: Finding


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
    evidence = Evidence(studies, trainings, flights)
    cases = Case(evidence, (), VARIANTS), Case(evidence, PAPER_MEANS, PAPER_VARIANTS)
    return [
        Row(
            c.part,
            c.text,
            c.place,
            c.printed,
            c.rule,
            c.page,
            *(_judged(c, each) for each in cases),
        )
        for c in section_v(_margin(studies))
    ]


def _judged(claim: Claim, case: Case) -> Finding:
    """What a policy's results say of a claim; without results, why there are none."""
    try:
        return claim.judge(case)
    except MissingError as missing:
        return Finding(NO_RESULTS, note=str(missing))
    except InputError:  # another design, or missions that this code flies in another way
        return Finding(NO_RESULTS, note="the results there are were not made for it")


def _margin(studies: Mapping[str, Results]) -> float:
    """The indifference of the sweet spot's selection; the page on parameters goes by it, too."""
    rule = studies["sweet-spot"].manifest["study"]["selection"] if "sweet-spot" in studies else None
    return (rule or {}).get("indifference") or MARGIN
