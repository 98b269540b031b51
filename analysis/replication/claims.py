"""The claims of the paper's Section V: what each says, which rule judges it, what is measured.

The rules are in ``verdict_rules``, the measures in ``measures``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

from analysis.names import METRICS, PRODUCT, RATIO, SHARES, SUCCESS, value_text
from analysis.replication import measures, paper
from analysis.replication import verdict_rules as rules
from analysis.replication.measures import Measured, Quantity
from analysis.replication.verdict_rules import Rule

TRAININGS = "trainings"  # in place of the name of a study, for claims about learning curves


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


def _printed(metric: str, figure: float, missions: int = 0) -> Quantity:
    """A number of the paper, with an interval if it is a share of a known number of missions."""
    if metric in SHARES and missions:
        return Quantity(*paper.spread(figure, missions), n=missions)
    return Quantity(figure, n=missions)


def _printed_gain(metric: str, uavs: int) -> Quantity:
    """The effect of one more UAV in the paper's Fig. 4."""
    gain = paper.FIG_4[uavs][metric] - paper.FIG_4[uavs - 1][metric]
    return Quantity(gain, unit="points")


# Values that the paper names, in the form that the studies use.
_THREE, _LONE = value_text(paper.BEST_UAVS), value_text(paper.LONE_UAV)
_EARLIEST = value_text(paper.EARLIEST_CHARGE)
_ADVENTUROUS = tuple(map(value_text, paper.ADVENTUROUS))
_TURNING, _BEYOND = value_text(paper.TURNING), value_text(paper.BEYOND)

_BY_PRODUCT = "By collection ratio and communication."
_lead_of_three = partial(
    measures.lead,
    field="uavs",
    metric=PRODUCT,
    values=(_THREE,),
    name=f"UAVs {_THREE} above the next best",
)
_second_uav = partial(measures.change, field="uavs", first="1", second="2")
_third_uav = partial(measures.change, field="uavs", first="2", second="3")

# fmt: off
# In every claim, the first lines are what the paper says; the others are how we judge it.

TABLE_4 = Section("Table IV: random missions", "performance.html#table-4", "table4", [
    *(Claim(
        f"{name} over random missions", "Table IV",
        rules.reached, partial(measures.mean, metric=metric),
        _printed(metric, paper.TABLE_IV[metric], paper.TABLE_IV_MISSIONS),
    ) for metric, name in METRICS.items()),
    Claim(
        "The collection ratio stays below 100 %", "Section V-C",
        rules.never_all, measures.missed_data,
    ),
])

FIG_4 = Section("Fig. 4: one to three UAVs", "performance.html#fig-4", "fig4", [
    *(Claim(
        f"{METRICS[metric]} with {uavs} UAV{'s' if uavs > 1 else ''}", f"Fig. 4{panel}",
        rules.reached, partial(measures.mean, metric=metric, uavs=uavs),
        _printed(metric, figure),
    ) for (uavs, figures), panel in zip(paper.FIG_4.items(), "abc", strict=True)
      for metric, figure in figures.items()),
    Claim(
        "A second UAV raises the collection ratio dramatically", "Fig. 4b, Section V-C",
        rules.gained, partial(_second_uav, metric=RATIO), _printed_gain(RATIO, 2),
    ),
    Claim(
        "A third UAV raises the collection ratio further", "Fig. 4c, Section V-C",
        rules.higher, partial(_third_uav, metric=RATIO), _printed_gain(RATIO, 3),
    ),
    Claim(
        "A second UAV costs no success, though it is harder to return for charging",
        "Fig. 4b, Section V-C",
        rules.kept, partial(_second_uav, metric=SUCCESS), _printed_gain(SUCCESS, 2),
    ),
    Claim(
        "With the third UAV, success decreases slightly", "Fig. 4c, Section V-C",
        rules.slightly_lower, partial(_third_uav, metric=SUCCESS), _printed_gain(SUCCESS, 3),
    ),
    Claim(
        "All else given, three UAVs are closest to the sweet spot", "Section V-D",
        rules.best, _lead_of_three, basis=_BY_PRODUCT,
    ),
])

FIG_4_MAPS = Section("Fig. 4: where they fly", "mission.html#fig-4", "fig4", [
    Claim(
        "A lone UAV charges once", "Fig. 4a, Section V-C",
        rules.most, measures.single_charges,
    ),
    Claim(
        "A lone UAV ignores the leftmost column and the bottommost row of nodes",
        "Fig. 4a, Section V-C",
        rules.ignored, measures.ignored_nodes,
    ),
    Claim(
        "Two UAVs divide the nodes into two sectors", "Fig. 4b, Section V-C",
        rules.divided, measures.sectors,
    ),
    Claim(
        "Two UAVs reach the nodes far from the charging zone, too", "Fig. 4b, Section V-C",
        rules.higher, measures.reached_nodes,
        basis="Of that column and row, the nodes that are not ignored.",
    ),
])

FIG_5 = Section("Fig. 5: one parameter at a time", "parameters.html#fig-5", "fig5", [
    Claim(
        "Performance is best with three UAVs", "Fig. 5a, Section V-D",
        rules.best, _lead_of_three, basis=_BY_PRODUCT,
    ),
    Claim(
        "The more UAVs, the more of the data is collected", "Fig. 5a, Section V-D",
        rules.rises, partial(measures.course, field="uavs", metric=RATIO),
        basis="By collection ratio.",
    ),
    Claim(
        "A lone UAV is an extreme, and costs collection ratio", "Section V-C",
        rules.lowest, partial(measures.lag, field="uavs", metric=RATIO, value=_LONE),
    ),
    Claim(
        f"Charging at {_EARLIEST} % or below is an extreme, and costs collection ratio",
        "Section V-C",
        rules.lowest, partial(measures.lag, field="charge_start", metric=RATIO, value=_EARLIEST),
    ),
    Claim(
        f"Success is no lower at C_S {'–'.join(_ADVENTUROUS)} % than above",
        "Fig. 5b, Section V-D",
        rules.no_lower, partial(measures.lead, field="charge_start", metric=SUCCESS,
                                values=_ADVENTUROUS, name="least difference"),
    ),
    Claim(
        "All values of C_C are served well", "Fig. 5c, Section V-D",
        rules.alike, partial(measures.spread, field="charge_complete", metric=PRODUCT),
        basis=_BY_PRODUCT,
    ),
    Claim(
        f"More initial data is good up to {_TURNING} data units, and bad above",
        "Fig. 5d, Section V-D",
        rules.peaks, partial(measures.peak, field="initial_data", metric=PRODUCT, value=_TURNING),
        basis=_BY_PRODUCT,
    ),
    Claim(
        f"Above {_TURNING} data units per node, the collection ratio decreases",
        "Fig. 5d, Section V-D",
        rules.lower, partial(measures.change, field="initial_data", metric=RATIO,
                             first=_TURNING, second=_BEYOND),
    ),
    Claim(
        "More flying time is better", "Fig. 5e, Section V-D",
        rules.rises, partial(measures.course, field="flying_time", metric=PRODUCT),
        basis=_BY_PRODUCT,
    ),
])

SWEET_SPOT = Section("Section V-D: the sweet spot", "parameters.html#sweet-spot", "sweet-spot", [
    *(Claim(
        f"{name} with every parameter at its best", "Section V-D",
        rules.reached, partial(measures.mean, metric=metric),
        _printed(metric, paper.SWEET_SPOT[metric], paper.SWEET_SPOT_MISSIONS),
        basis="Of missions that had no part in the selection.",
    ) for metric, name in METRICS.items()),
    Claim(
        "The sweet spot is one of three UAVs", "Section V-D",
        rules.chosen, measures.selected_uavs,
        Quantity(paper.BEST_UAVS, unit="number", name="UAVs"),
    ),
])

FIG_3 = Section("Fig. 3: transfer learning", "learning.html#fig-3", TRAININGS, [
    Claim(
        "With transfer learning, the reward is higher in all training steps",
        "Fig. 3a, Section V-B",
        rules.throughout, partial(measures.final_lead, metric="evaluation_reward", unit="reward"),
    ),
    Claim(
        "With transfer learning, collection ratio and communication passes that without, and ends "
        "higher", "Fig. 3b, Section V-B",
        rules.passes, partial(measures.final_lead, metric=f"evaluation_{PRODUCT}", unit="points"),
        Quantity(paper.CROSSING, unit="steps", name="crossing"),
    ),
    Claim(
        "Without transfer learning, training levels off, with low performance",
        "Fig. 3b, Section V-B",
        rules.levels_off, partial(measures.level_from, metric=f"evaluation_{PRODUCT}"),
        Quantity(paper.LEVEL_FROM, unit="steps", name="level from"),
    ),
])
# fmt: on

SECTIONS = [TABLE_4, FIG_4, FIG_4_MAPS, FIG_5, SWEET_SPOT, FIG_3]
