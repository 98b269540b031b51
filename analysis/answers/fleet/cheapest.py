"""The answer of a search for the cheapest fleet that meets requirements.

    results = load_results("results/fleets")  # of a study that searches for the cheapest fleet
    search = search_of(results)
    search.headline(), search.facts()
    tables.fleet_table(results)  # the fleets by cost, with the answer marked

A fleet is searched for every policy and under every condition and, if there are several conditions,
under all of them together. The answer is the cheapest fleet of any policy under all conditions.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from pandas.api.types import is_numeric_dtype

from dess.analysis import numbers
from dess.analysis.answers.fleet.costs import cost_facts, mean_cost_parts
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
from dess.analysis.answers.settings.home import may_end_in_the_air
from dess.analysis.answers.settings.nodes import hardly_served_nodes
from dess.analysis.answers.settings.points import (
    conditions_in_words,
    ends_in_words,
    ends_of_point,
    fleets_in_words,
    values_of_points,
)
from dess.analysis.answers.settings.ranking import unequal_lengths
from dess.analysis.answers.settings.years import age_sentence, year_facts
from dess.analysis.facts import Fact, known_facts
from dess.analysis.metrics import AGE, COST, HOME, SUCCESS, Metric, column_in_sheet_unit, metric_of
from dess.analysis.names import DECISIONS
from dess.analysis.results.tables import Results, compute_once
from dess.analysis.stats.requirement import Requirement
from dess.analysis.study.cheapest import Cheapest, CheapestChoice, CheapestSetting
from dess.analysis.study.prices import has_priced_types
from dess.scenario.fields import ZONE_PADS


@dataclass(frozen=True, eq=False)
class CheapestFleet:
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

        All facts on the fleet take their numbers from here, from ``quoted_settings``.

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

    # --- facts ---

    @property
    def cost_in_words(self) -> str:
        """The mean cost of the fleet over the conditions, in the currency of the prices."""
        return numbers.format_money(self.cost, self.results.prices.unit)

    @property
    def summary(self) -> str:
        """The fleet and its cost; that none is known to meet the requirements if there is none."""
        if self.points:
            return f"{self.fleet}, {self.cost_in_words}"
        return "no fleet is known to meet the requirements"

    def measured(self, column: str) -> str:
        """The mean of a metric of the fleet and its interval, as text."""
        row = self.estimates(column)
        return metric_asked_for(self.results, column).written(*row[interval_columns(column)])

    def facts(self, policies: int = 1) -> list[Fact]:
        """The fleet by every requirement, its cost, and why it is not a cheaper one.

        Args:
            policies: Of how many policies the fleet is the cheapest.
        """
        if not self.points:
            return known_facts([self._cheaper_fact(), self._undecided_fact()])
        return known_facts(
            [
                *self._requirement_facts(policies),
                *self._home_facts(),
                self._missions_fact(),
                *self._year_facts(),
                *self._cost_facts(),
                self._cheaper_fact(),
                Fact(
                    "hardly served",
                    hardly_served_nodes(self.results, self.policy, self.points),
                ),
                self._ends_fact(),
                self._undecided_fact(),
            ]
        )

    def _requirement_facts(self, policies: int) -> Iterator[Fact]:
        """What was measured beside what is required, that with the least to spare first."""
        rule = self.results.study.selection
        assert isinstance(rule, Cheapest)
        horizon = self.results.store.manifest.settings[self.points[0]].horizon
        for requirement in self.tightest_first:
            yield Fact(
                requirement.metric.within,
                self.measured(requirement.column),
                requirement.bound_in_words,
                requirement.shifted(rule.tolerance, horizon).bound_in_words,
            )
        if SUCCESS not in [requirement.column for requirement in self.tightest_first]:
            yield Fact("success", self.measured(SUCCESS))
        everywhere = ""
        if self._answer.condition is None:
            everywhere = ", under every condition"
        sure = numbers.format_level(rule.shown(policies))
        yield Fact("probability of what is guaranteed", f"at least {sure}{everywhere}")

    def _home_facts(self) -> Iterator[Fact]:
        """Whether the UAVs of the fleet could fly home, where missions may end in the air."""
        if not may_end_in_the_air(self.results):
            return
        yield Fact(metric_of(HOME).within, self.measured(HOME))
        parts = mean_cost_parts(self.results)
        rows = parts[(parts["policy"] == self.policy) & parts["point"].isin(self.points)]
        stranded = rows["stranded"].mean()
        if stranded > 0:
            number = numbers.format_quantity(round(stranded, 2))
            yield Fact("UAVs without it, which have no price", f"{number} of a mission")

    def _missions_fact(self) -> Fact:
        """On which missions or years the fleet was measured."""
        name = self.results.study.replication_name
        missions = numbers.format_count(int(self.estimates(SUCCESS)["n"]), name)
        source = "of the search"
        if not self.results.checks.empty:
            source = "that check it"
        if len(self.points) > 1:
            source += ", under the worst condition for each metric"
        return Fact("measured in", f"{missions} {source}")

    def _year_facts(self) -> list[Fact]:
        """What years tell of the fleet, and its age where no requirement does."""
        if not self.results.study.years:
            return []
        age = column_in_sheet_unit(AGE, self.results.missions)
        facts = year_facts(self.results, self.policy, self.points)
        if age not in [requirement.column for requirement in self._required]:
            facts.insert(0, Fact(metric_of(age).within, self.measured(age)))
        return facts

    def _cost_facts(self) -> Iterator[Fact]:
        """The cost of the fleet with its interval, and its parts."""
        selected = self.fleets[self.fleets["selected"]]
        ends = selected[interval_columns(COST)].iloc[0]
        amount = metric_of(COST).written(*ends)
        yield Fact("cost", f"{amount} {self.results.prices.unit}")
        yield from cost_facts(self.results, self.policy, self.points)

    def _ends_fact(self) -> Fact:
        """At which ends of the values asked for the fleet lies, beyond which one may be cheaper."""
        point = self.points[0]
        ends = ends_in_words(self.results, point, _ends_of_values(self.results, point))
        return Fact("a cheaper one may lie beyond", ends)

    def _undecided_fact(self) -> Fact:
        """Which fleet is undecided, and about how many missions or years would settle it."""
        choice = self._choice
        if not choice.done or self._answer.settled:
            return Fact("undecided", "")
        name = self.results.study.replication_name
        enough = f"far more {name}s"
        if choice.enough:
            enough = f"about {float(f'{choice.enough:.2g}'):,.0f} {name}s"
        return Fact("undecided", f"{self._undecided_in_words()}; {enough} would settle it")

    def _undecided_in_words(self) -> str:
        """The fleet that may change the answer, and how many others may.

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
        if len(left) > 1:
            return f"{row['fleet']}, and {numbers.format_count(len(left) - 1, 'other fleet')}"
        return str(row["fleet"])

    def _cheaper_fact(self) -> Fact:
        """The next cheaper fleet and its verdict; without an answer, the closest."""
        if self.points:
            other = self.fleets[self.fleets[COST] < self.cost].tail(1)
            which = "next cheaper"
        else:
            nearest = least_spare(self.fleets, self._required).nlargest(1).index
            other = self.fleets.loc[nearest]
            which = "closest"
        if other.empty:
            return Fact(which, "")
        row = other.iloc[0]
        amount = numbers.format_money(row[COST], self.results.prices.unit)
        tightest = min(
            self._required,
            key=lambda requirement: relative_spare(self.fleets, requirement)[row.name],
        )
        ends = row[interval_columns(tightest.column)]
        measured = f"{tightest.metric.within} {tightest.metric.written(*ends)}"
        return Fact(f"{which} ({row['verdict']})", f"{row['fleet']}, {amount}; {measured}")


@dataclass(frozen=True, eq=False)
class FleetSearch:
    """What a study that searches for the cheapest fleet has found, of all policies.

    Attributes:
        results: The study.
    """

    results: Results

    @cached_property
    def fleet_answers(self) -> list[CheapestFleet]:
        """The answers of every policy: one for each condition, then one for all of them."""
        conditions = [*dict.fromkeys(conditions_in_words(self.results))]
        if len(conditions) > 1:
            conditions.append(ALL_CONDITIONS)
        return [
            CheapestFleet(self.results, policy, condition, number)
            for policy in self.results.policies
            for number, condition in enumerate(conditions)
        ]

    @property
    def answers_for_all_conditions(self) -> list[CheapestFleet]:
        """The answer of every policy for all conditions."""
        of_policies = {answer.policy: answer for answer in self.fleet_answers}
        return [*of_policies.values()]

    @cached_property
    def best(self) -> CheapestFleet:
        """The cheapest fleet of any policy under all conditions; that of the first one if none.

        Of fleets that cost the same, it is the one that keeps the requirements with more to spare.
        """
        answers = self.answers_for_all_conditions
        fleets = pd.concat([answer.fleets for answer in answers])
        spare = least_spare(fleets, requirements_of(self.results))

        def cost_and_need(answer: CheapestFleet) -> tuple[float, float]:
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

    # --- facts ---

    def headline(self) -> str:
        """What to buy, and what it costs; of years also how old the data are."""
        if not self.best.points:
            return "No fleet is known to meet the requirements."
        prices = self.results.prices
        missions = ""
        if prices.pays_for_missions and prices.years is None:
            missions = f" with {numbers.format_count(prices.paid_missions, 'mission')}"
        bought = f"Buy {self.best.fleet}: {self.best.cost_in_words}{missions}."
        if not self.results.study.years:
            return bought
        return f"{bought} {age_sentence(self.results, self.best.policy, self.best.points)}"

    def facts(self) -> list[Fact]:
        """The answer by every requirement, and the answers of other policies and conditions."""
        best = self.best
        facts = [Fact("policy", best.policy), *best.facts(len(self.results.policies))]
        for other in self.fleet_answers:
            if other is best:
                continue
            where = f"with {other.policy}"
            if other.condition:
                where += f", {other.condition}"
            measured = ""
            if other.points:
                tightest = other.tightest_first[0]
                measured = f"; {tightest.metric.within} {other.measured(tightest.column)}"
            facts.append(Fact(where, f"{other.summary}{measured}"))
        lengths = unequal_lengths(self.results, best.length_dependent_metrics)
        return known_facts([*facts, lengths, self._rule_of_thumb_fact()])

    def _rule_of_thumb_fact(self) -> Fact:
        """How many UAVs a rule of thumb asks for."""
        rule = None
        if self.best.points:
            rule = rule_of_thumb(self.results, self.best.policy, self.best.points)
        if rule is None:
            return Fact("rule of thumb", "")
        return Fact("rule of thumb", rule.in_words)

    def guarantees(self) -> list[str]:
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
