"""The answer of a search for the cheapest fleet that meets requirements.

    results = load_results("results/fleets")  # of a study that searches for the cheapest fleet
    search = search_of(results)
    search.sentence()  # in words
    tables.fleet_table(results)  # the fleets by cost, with the answer marked

A fleet is searched for every policy and under every condition and, if there are several conditions,
under all of them together. The answer is the cheapest fleet of any policy under all conditions.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from pandas.api.types import is_numeric_dtype

from dess.analysis import numbers
from dess.analysis.answers.fleet.costs import (
    cost_parts_in_words,
    mean_cost_parts,
    prices_in_words,
)
from dess.analysis.answers.fleet.requirements import (
    least_spare,
    metric_asked_for,
    relative_spare,
    requirements_of,
)
from dess.analysis.answers.fleet.rule_of_thumb import rule_of_thumb
from dess.analysis.answers.fleet.verdicts import (
    ALL_CONDITIONS,
    cheapest_choice,
    interval_columns,
    judge_fleets_everywhere,
    judge_settings,
    quoted_settings,
)
from dess.analysis.answers.settings.home import (
    may_end_in_the_air,
    stranded_sentence,
    way_home_sentence,
)
from dess.analysis.answers.settings.nodes import hardly_served_clause
from dess.analysis.answers.settings.points import (
    conditions_in_words,
    ends_of_point,
    ends_sentence,
    fleets_in_words,
    values_of_points,
)
from dess.analysis.answers.settings.ranking import unequal_lengths_sentence
from dess.analysis.metrics import COST, HOME, SUCCESS, Metric, metric_of
from dess.analysis.names import DECISIONS
from dess.analysis.results.tables import Results, compute_once
from dess.analysis.stats.requirement import Requirement
from dess.analysis.stats.verdict import Verdict
from dess.analysis.study.cheapest import Cheapest, CheapestChoice, CheapestSetting
from dess.analysis.study.prices import has_priced_types
from dess.scenario.fields import ZONE_PADS

_WHY_NOT = {
    Verdict.MET: "meets the requirements as well, and saves less than matters",
    Verdict.OPEN: "is not known to meet the requirements",
    Verdict.MISSED: "misses the requirements",
}


@dataclass(frozen=True, eq=False)
class FleetAnswer:
    """The cheapest fleet of a policy under one condition, or under all conditions together.

    Attributes:
        results: The study.
        policy: The policy.
        condition: The condition in words; empty if there is only one.
        number: The number of the answer among those of the policy; the last is for all conditions.
    """

    results: Results
    policy: str
    condition: str
    number: int

    @cached_property
    def _choice(self) -> CheapestChoice:
        return cheapest_choice(self.results, self.policy)

    @property
    def _answer(self) -> CheapestSetting:
        return self._choice.answers[self.number]

    @property
    def points(self) -> tuple[int, ...]:
        """The design points of the fleet, one for each condition of the question; empty if none."""
        return self._answer.points

    @cached_property
    def fleets(self) -> pd.DataFrame:
        """The rows of ``judge_settings`` or ``judge_fleets_everywhere`` that it was chosen from."""
        together = self.condition == ALL_CONDITIONS
        if together:
            table = judge_fleets_everywhere(self.results)
        else:
            table = judge_settings(self.results)
        is_asked = (table["policy"] == self.policy) & (table["condition"] == self.condition)
        return table[is_asked]

    @property
    def fleet(self) -> str:
        """The fleet in words; ``none`` if no fleet is known to meet the requirements."""
        if self.points:
            return fleets_in_words(self.results)[self.points[0]]
        return "none"

    @property
    def cost(self) -> float:
        """The mean cost of the fleet over the conditions; infinite if there is none."""
        selected = self.fleets[self.fleets["selected"]]
        if len(selected):
            return float(selected[COST].iloc[0])
        return np.inf

    @cached_property
    def tightest_first(self) -> list[Requirement]:
        """The requirements, that with the least to spare first."""
        selected = self.fleets["selected"]
        if not selected.any():
            return requirements_of(self.results)
        room = {
            r.column: float(relative_spare(self.fleets, r)[selected].iloc[0])
            for r in self._required
        }
        return sorted(self._required, key=lambda requirement: room[requirement.column])

    @property
    def _required(self) -> list[Requirement]:
        return requirements_of(self.results)

    @property
    def length_dependent_metrics(self) -> list[Metric]:
        """The metrics by which fleets are compared that may depend on the length of a mission."""
        asked = [requirement.metric for requirement in self._required]
        if self.results.prices.hour:
            return [*asked, metric_of(COST)]
        return asked

    def estimates(self, column: str) -> pd.Series:
        """The mean of a metric of the fleet with its interval, under its worst condition.

        All sentences on the fleet take their numbers from here, from ``quoted_settings``.

        Args:
            column: The column of the metric.

        Returns:
            A row with the metric, the ends of its interval and ``n``.
        """
        table = quoted_settings(self.results)
        rows = table[(table["policy"] == self.policy) & table["point"].isin(self.points)]
        if metric_of(column).less_is_better:
            worst = rows[column].idxmax()
        else:
            worst = rows[column].idxmin()
        return rows.loc[worst]

    # --- sentences ---

    @property
    def cost_in_words(self) -> str:
        """The mean cost of the fleet over the conditions, in the currency of the prices."""
        return numbers.format_money(self.cost, self.results.prices.unit)

    @property
    def _ends_of_cost_in_words(self) -> str:
        """The interval of the mean cost, to follow it; empty if it is the same in all missions."""
        selected = self.fleets[self.fleets["selected"]]
        estimate, *ends = selected[interval_columns(COST)].iloc[0]
        if ends[0] == ends[1]:
            return ""
        _, interval = metric_of(COST).written(estimate, *ends).split(" ", 1)
        return f" {interval}"

    @property
    def _where(self) -> str:
        """The policy and the condition, as the beginning of a sentence."""
        where = f"With the policy `{self.policy}`"
        if self.condition:
            where += f" and under {self.condition}"
        return where

    def choice_sentence(self) -> str:
        """Which fleet is the cheapest that meets the requirements, and what it costs."""
        if not self.points:
            return f"{self._where}, no fleet is known to meet the requirements."
        parts = cost_parts_in_words(self.results, self.policy, self.points)
        return (
            f"{self._where}, the cheapest fleet that meets the requirements is **{self.fleet}** "
            f"for {self.cost_in_words}{self._ends_of_cost_in_words}{parts}"
            f"{hardly_served_clause(self.results, self.policy, self.points)}."
        )

    def estimates_sentence(self) -> str:
        """What was measured of the fleet, beside what is required; that with the least spare first.

        Of a fleet whose success is not required, the sentence says what it is.
        """
        if not self.points:
            return ""
        texts = []
        for requirement in self.tightest_first:
            texts.append(
                f"its {requirement.metric.within} is {self._measured(requirement.column)} "
                f"({requirement.bound_in_words} required)"
            )
        if SUCCESS not in [requirement.column for requirement in self.tightest_first]:
            texts.append(f"its success is {self._measured(SUCCESS)} (none is required)")
        missions = f"{int(self.estimates(SUCCESS)['n']):,} missions"
        is_checked = not self.results.checks.empty
        if is_checked:
            source = f"{missions} that check it"
        else:
            source = f"the {missions} of the search"
        if len(self.points) > 1:
            where = ", under the worst condition for each,"
        else:
            where = ","
        text = f"In {source}{where} {numbers.join_words(texts)}."
        if len(self.tightest_first) > 1:
            text += f" Nearest to what is required is its {self.tightest_first[0].metric.within}."
        return text

    def measured_in_words(self) -> str:
        """What was measured of it by each requirement, as ``success 99.7 % [98.1, 99.9]``."""
        texts = [
            f"{requirement.metric.within} {self._measured(requirement.column)}"
            for requirement in self.tightest_first
        ]
        return numbers.join_words(texts)

    def _measured(self, column: str) -> str:
        """The mean of a metric of the fleet and its interval, in words."""
        row = self.estimates(column)
        return metric_asked_for(self.results, column).written(*row[interval_columns(column)])

    def home_sentence(self) -> str:
        """Whether the UAVs of the fleet could fly home, where missions may end in the air."""
        if not self.points or not may_end_in_the_air(self.results):
            return ""
        row = self.estimates(HOME)
        share = way_home_sentence(*row[interval_columns(HOME)])
        parts = mean_cost_parts(self.results)
        rows = parts[(parts["policy"] == self.policy) & parts["point"].isin(self.points)]
        return f"{share} {stranded_sentence(self.results, rows['stranded'].mean())}".strip()

    def guarantee_sentence(self, policies: int = 1) -> str:
        """What the search has shown of the fleet, with its probability.

        Args:
            policies: Of how many policies the fleet is the cheapest.
        """
        if not self.points:
            return ""
        rule = self.results.study.selection
        assert isinstance(rule, Cheapest)
        horizon = self.results.store.manifest.settings[self.points[0]].horizon
        shifted = [requirement.shifted(rule.tolerance, horizon) for requirement in self._required]
        shown = [f"its {bound.metric.within} is {bound.bound_in_words}" for bound in shifted]
        where = ""
        if self._answer.condition is None:
            where = " under every condition"
        sure = numbers.format_level(rule.shown(policies))
        return f"With a probability of at least {sure}, {numbers.join_words(shown)}{where}."

    def ends_sentence(self) -> str:
        """At which ends of the values asked for the fleet lies, beyond which one may be cheaper."""
        if not self.points:
            return ""
        point = self.points[0]
        return ends_sentence(
            self.results, point, _ends_of_values(self.results, point), "a cheaper one"
        ).strip()

    def budget_sentence(self) -> str:
        """Which pair the budget left undecided, and about how many missions would settle it."""
        choice = self._choice
        rule = self.results.study.selection
        if not choice.done or self._answer.settled:
            return ""
        assert isinstance(rule, Cheapest)
        if choice.enough:
            enough = f"about {float(f'{choice.enough:.2g}'):,.0f} missions"
        else:
            enough = "far more"
        return (
            f"The budget of {rule.budget:,} missions ended before it was decided whether "
            f"{self._undecided_in_words()}; {enough} would settle it."
        )

    def _undecided_in_words(self) -> str:
        """The pair of a fleet and the policy that may change the answer, and how many others may.

        It is the cheapest of those that are left beside the answer; without an answer, the one that
        is the closest to the requirements.
        """
        left = {*self._answer.left} - {self.points}
        firsts = [points[0] for points in left]
        words = fleets_in_words(self.results)
        rows = self.fleets[self.fleets["fleet"].isin([words[point] for point in firsts])]
        if self.points:
            row = rows.sort_values(COST, kind="stable").iloc[0]
        else:
            row = rows.loc[least_spare(rows, self._required).idxmax()]
        if row["verdict"] == Verdict.MET:
            what = "costs less"
        else:
            what = "meets the requirements"
        text = f"**{row['fleet']}** with the policy `{self.policy}` {what}"
        if len(left) > 1:
            text += f" ({numbers.format_count(len(left) - 1, 'other fleet')} may change it too)"
        return text

    def cheaper_sentence(self) -> str:
        """The next cheaper fleet and why it is not the answer; without an answer, the closest."""
        selected = self.fleets[self.fleets["selected"]]
        if len(selected):
            other = self.fleets[self.fleets[COST] < self.cost].tail(1)
            which = "next cheaper"
        else:
            nearest = least_spare(self.fleets, self._required).nlargest(1).index
            other = self.fleets.loc[nearest]
            which = "closest"
        if other.empty:
            return ""
        row = other.iloc[0]
        amount = numbers.format_money(row[COST], self.results.prices.unit)
        measured = [
            f"{r.metric.within} {r.metric.written(*row[interval_columns(r.column)])}"
            for r in self._required
        ]
        return (
            f"The {which} one, **{row['fleet']}** for {amount} with "
            f"{numbers.join_words(measured)}, {_WHY_NOT[row['verdict']]}."
        )

    def rule_of_thumb_sentence(self) -> str:
        """How many UAVs a rule of thumb asks for; empty without a fleet or a data sheet."""
        if not self.points:
            return ""
        rule = rule_of_thumb(self.results, self.policy, self.points)
        if rule is None:
            return ""
        return rule.sentence(self.results.scenario(self.points[0]).uavs[1])

    def headline(self) -> str:
        """The fleet, its cost, what was measured of it, and whether its UAVs could fly home."""
        parts = [self.choice_sentence(), self.estimates_sentence(), self.home_sentence()]
        return " ".join(filter(None, parts))

    def reasons(self, policies: int = 1) -> str:
        """How sure the answer is, and why it is not a cheaper fleet.

        Args:
            policies: Of how many policies the fleet is the cheapest.
        """
        parts = [
            self.guarantee_sentence(policies),
            self.ends_sentence(),
            self.budget_sentence(),
            self.cheaper_sentence(),
        ]
        return " ".join(filter(None, parts))


@dataclass(frozen=True, eq=False)
class FleetSearch:
    """What a study that searches for the cheapest fleet has found, of all policies.

    Attributes:
        results: The study.
    """

    results: Results

    @cached_property
    def fleet_answers(self) -> list[FleetAnswer]:
        """The answers of every policy: one for each condition, then one for all of them."""
        conditions = [*dict.fromkeys(conditions_in_words(self.results))]
        if len(conditions) > 1:
            conditions.append(ALL_CONDITIONS)
        return [
            FleetAnswer(self.results, policy, condition, number)
            for policy in self.results.policies
            for number, condition in enumerate(conditions)
        ]

    @property
    def answers_for_all_conditions(self) -> list[FleetAnswer]:
        """The answer of every policy for all conditions."""
        of_policies = {answer.policy: answer for answer in self.fleet_answers}
        return [*of_policies.values()]

    @cached_property
    def best(self) -> FleetAnswer:
        """The cheapest fleet of any policy under all conditions; that of the first one if none.

        Of fleets that cost the same, it is the one that keeps the requirements with more to spare.
        """
        answers = self.answers_for_all_conditions
        fleets = pd.concat([answer.fleets for answer in answers])
        spare = least_spare(fleets, requirements_of(self.results))

        def cost_and_need(answer: FleetAnswer) -> tuple[float, float]:
            selected = answer.fleets.index[answer.fleets["selected"]]
            return answer.cost, -spare[selected].max()

        return min(answers, key=cost_and_need)

    @property
    def shown_point(self) -> int:
        """The design point of the answer that pages show missions of; of the closest fleet if none.

        Of a fleet for several conditions, it is that of the last condition.
        """
        if self.best.points:
            return self.best.points[-1]
        rows = judge_settings(self.results)
        rows = rows[rows["policy"] == self.best.policy]
        return int(rows.loc[least_spare(rows, requirements_of(self.results)).idxmax(), "point"])

    @property
    def shown_missions(self) -> pd.DataFrame:
        """The missions of the answer that pages show, those of ``shown_point``."""
        missions = self.results.missions
        is_policy = missions["policy"] == self.best.policy
        return missions[is_policy & (missions["point"] == self.shown_point)]

    # --- sentences ---

    def sentence(self) -> str:
        """The cheapest fleet of all policies, and which the others would have named."""
        return " ".join([self.best.headline(), *self.other_policies_sentences()])

    def other_policies_sentences(self) -> list[str]:
        """For each other policy, what its cheapest fleet is, so how much depends on the policy."""
        sentences = []
        for other in self.answers_for_all_conditions:
            if other.policy == self.best.policy:
                continue
            if other.fleet == self.best.fleet:
                if self.best.points:
                    sentences.append(
                        f"With the policy `{other.policy}`, it is the same fleet, with "
                        f"{other.measured_in_words()}."
                    )
            elif other.points:
                sentences.append(
                    f"With the policy `{other.policy}`, it would be **{other.fleet}** for "
                    f"{other.cost_in_words}."
                )
            else:
                sentences.append(
                    f"With the policy `{other.policy}`, no fleet is known to meet the requirements."
                )
        return sentences

    def reason_sentences(self) -> list[str]:
        """How sure the answer is; then the answers of the other policies and conditions."""
        lines = [
            self.best.reasons(len(self.results.policies)),
            self.best.rule_of_thumb_sentence(),
            unequal_lengths_sentence(self.results, self.best.length_dependent_metrics),
        ]
        lines += [
            f"{other.headline()} {other.reasons()}".strip()
            for other in self.fleet_answers
            if other is not self.best
        ]
        return [line for line in lines if line]

    def sentences(self) -> list[str]:
        """The answer, what is paid for, how sure it is, and the other answers."""
        return [self.sentence(), prices_in_words(self.results), *self.reason_sentences()]

    def guarantee_sentences(self) -> list[str]:
        """What is guaranteed about the selected fleets of every policy; none without a search."""
        choices = [self.results.cheapest(policy) for policy in self.results.policies]
        return [*dict.fromkeys(choice.guarantee for choice in choices if choice)]

    # --- the numbers behind them ---

    def selected_fleets(self) -> pd.DataFrame:
        """What was selected for every policy and condition.

        Returns:
            A row per policy and condition and, if there are several conditions, one for all of
            them: ``policy``, ``condition`` in words, ``point`` (None if no setting is selected, or
            for all conditions), ``setting`` (the fleet in words), ``missions`` of the policy,
            ``left`` (number of settings that may be as good), ``guaranteed`` and ``guarantee``.
        """
        rows = []
        for fleet_answer in self.fleet_answers:
            choice = cheapest_choice(self.results, fleet_answer.policy)
            of_one = choice.answers[fleet_answer.number]
            is_point = of_one.points and of_one.condition is not None
            rows.append(
                {
                    "policy": fleet_answer.policy,
                    "condition": fleet_answer.condition,
                    "point": of_one.points[0] if is_point else None,
                    "setting": fleet_answer.fleet,
                    "missions": choice.missions,
                    "left": len(of_one.left),
                    "guaranteed": of_one.settled,
                    "guarantee": choice.guarantee,
                }
            )
        return pd.DataFrame(rows).astype({"point": "Int64"})

    def deciding_requirement(self) -> tuple[Requirement, str]:
        """The requirement that the answer is chosen by, and the condition under which it is.

        It is the one that alone asks for the most expensive fleet, with the policy of the answer;
        of several of these, the one that the answer keeps with the least to spare. A fleet costs
        its mean over the conditions: what chance makes of its cost under each decides nothing.
        """
        rows = judge_settings(self.results)
        rows = rows[rows["policy"] == self.best.policy]
        cost_of_fleets = rows.groupby("fleet")[COST].mean()

        def need_and_lack(requirement: Requirement, part: pd.DataFrame) -> tuple[float, float]:
            keeps = requirement.margin(part[requirement.column]) >= 0
            cheapest_cost = np.inf
            if keeps.any():
                cheapest_cost = cost_of_fleets[part["fleet"][keeps]].min()
            room = relative_spare(part, requirement)
            selected = part["point"].isin(self.best.points)
            if selected.any():
                least_room = float(room[selected].iloc[0])
            else:
                least_room = float(room.max())
            return cheapest_cost, -least_room

        parts: Sequence[tuple[str, pd.DataFrame]] = [*rows.groupby("condition", sort=False)]
        asked = [
            (asked_requirement, str(name), part)
            for asked_requirement in requirements_of(self.results)
            for name, part in parts
        ]
        requirement, condition, _ = max(asked, key=lambda found: need_and_lack(found[0], found[2]))
        return requirement, condition


@compute_once
def search_of(results: Results) -> FleetSearch:
    """What a study that searches for the cheapest fleet has found."""
    return FleetSearch(results)


def _ends_of_values(results: Results, point: int) -> dict[str, str]:
    """The ends of the swept values at which a fleet lies and beyond which one may be cheaper.

    With more UAVs or pads a fleet is cheaper only if that saves enough of the others.
    """
    table = values_of_points(results)
    space = results.scenario(point)
    prices = results.prices
    cheapest_uav = min(prices.prices_of_uavs(space, max(len(space.fleet), 1)))
    price_of = {"uavs": cheapest_uav, "pads": prices.pad, ZONE_PADS: prices.pad * len(space.zones)}
    price_of = {field: price for field, price in price_of.items() if field in table}
    fewest = {ZONE_PADS: 0}  # of others one
    spent = {
        field: price * (table[field][point] - fewest.get(field, 1))
        for field, price in price_of.items()
        if is_numeric_dtype(table[field])
    }
    if "uavs" in spent and has_priced_types(space):
        spent["uavs"] = prices.price_of_uavs(space, space.uavs[1]) - cheapest_uav

    def may_be_cheaper(field: str, end: str) -> bool:
        if end == "least" or not price_of.get(field):
            return True
        return sum(spent.values()) - spent[field] > price_of[field]

    return {
        field: end
        for field, end in ends_of_point(results, point).items()
        if field in DECISIONS and may_be_cheaper(field, end)
    }
