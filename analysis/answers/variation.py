"""A variation of a scenario compared with its baseline, on the same missions.

    variation = Variation(load_results("results/what-if/HASH"), "greedy")
    variation.headline(), variation.facts()

``sides`` has the numbers behind it.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import tomli_w

from dess.analysis import numbers
from dess.analysis.answers.missions import end_in_words, estimate_metric
from dess.analysis.answers.sides import (
    BASELINE,
    MEASURES,
    POWER,
    SIDES,
    VARIATION,
    best_policy_of_side,
    compare_sides,
    means_of_sides,
    missions_needed,
    paired_differences,
)
from dess.analysis.facts import Fact, known_facts
from dess.analysis.measured import usual_metric
from dess.analysis.metrics import (
    COST,
    HOME,
    METRICS,
    PRODUCT,
    RATIO,
    SUCCESS,
    Metric,
    format_length,
    metric_of,
)
from dess.analysis.names import RANGES, described_field, field_in_words, field_named, sum_in_words
from dess.analysis.results.resimulate import resimulate
from dess.analysis.results.tables import Results
from dess.analysis.stats.verdict import (
    ABOVE,
    BELOW,
    INCONCLUSIVE,
    MARKS,
    NOT_RULED_OUT,
    SEEN_ABOVE,
    SEEN_BELOW,
    judge_difference,
)
from dess.analysis.tables import Table
from dess.scenario.fields import ZONE_PADS

if TYPE_CHECKING:  # figures need the extra reports
    from matplotlib.figure import Figure


_VERDICTS = {
    ABOVE: "higher",
    SEEN_ABOVE: f"higher in what was seen, where {NOT_RULED_OUT}",
    INCONCLUSIVE: "inconclusive",
    SEEN_BELOW: f"lower in what was seen, where {NOT_RULED_OUT}",
    BELOW: "lower",
}
_MOST_NAMED = 2  # the largest number of changed fields that a headline names
_MARKED = (
    "▲ higher in the variation, ▼ lower, △ higher and ▽ lower in what was seen, where a rare "
    "failure is not ruled out, ≈ inconclusive"
)

_SHORT = {SUCCESS: "Success", RATIO: "Collection ratio", PRODUCT: "Their product"}


def _missing_in_words(answer: Any) -> str:
    """How many missions would probably show a difference of the size of the estimate."""
    needed = missions_needed(answer)
    if needed == np.inf:
        return "these do not tell"
    return f"about {float(f'{needed:.2g}'):,.0f} for a probability of {100 * POWER:g} %"


def format_change(answer: Any) -> str:
    """The paired difference of a row of ``compare_sides`` with its interval, as text.

    It is in percentage points for the paper's metrics; small numbers have more digits.
    """
    ends = (answer.difference, answer.low, answer.high)
    if metric_of(answer.metric).kind == "cost":
        return numbers.format_amounts(*ends, sign="+")
    if not metric_of(answer.metric).in_percent:
        return _format_amount(*ends, sign="+")
    if 0 < answer.high - answer.low < 0.01:
        return _format_amount(*(100 * end for end in ends), sign="+")
    return numbers.format_points(*ends)


def _format_amount(value: float, *ends: float, sign: str = "") -> str:
    """A number with two decimals, or more if it is small, and its interval if it has a length."""
    if abs(value) >= 0.1 or not value:
        digits = 2
    else:
        digits = 4
    rounded = [round(number, digits) or 0.0 for number in (value, *ends)]  # no -0.00
    texts = [
        numbers.format_minus(f"{number:{sign if number else ''}.{digits}f}") for number in rounded
    ]
    if len({*ends}) > 1:
        return f"{texts[0]} [{', '.join(texts[1:])}]"
    return texts[0]


@dataclass(frozen=True, eq=False)
class Variation:
    """A variation compared with its baseline.

    Attributes:
        results: The study; ``results.missions`` is a tidy table of the missions.
        shown: The policy of ``typical`` and ``worst``.
    """

    results: Results
    shown: str

    def table(self) -> pd.DataFrame:
        """The paired differences, with a row per policy and metric, as ``compare_sides``."""
        return compare_sides(self.results)

    @property
    def _leading(self) -> Metric:
        """The metric that the answer is about: the product, or of years the age of the data."""
        return metric_of(usual_metric(self.results.missions))

    def _of_leading(self) -> Iterable[Any]:
        """The rows of the table on the leading metric, one per policy."""
        table = self.table()
        return table[table["metric"] == self._leading.column].itertuples()

    def _change_of_leading(self, row: Any) -> str:
        """The difference of the leading metric with its unit, of a row of ``compare_sides``."""
        if self._leading.in_percent:
            return f"{format_change(row)} points"
        return self._leading.change(row.difference, row.low, row.high)

    def headline(self) -> str:
        """What is changed, and by how much that changes the leading metric of the shown policy."""
        changes = [
            f"{field_named(side.Field).words(side.Variation)} instead of {side.Baseline}"
            for side in self._fields(self._changed).itertuples()
        ]
        changed = numbers.join_words(changes)
        if len(changes) > _MOST_NAMED:
            changed = f"{len(changes)} changed fields"
        (row,) = (row for row in self._of_leading() if row.policy == self.shown)
        metric = self._leading.within
        return f"{changed}: {metric} with {self.shown} {self._change_of_leading(row)}."

    def facts(self) -> list[Fact]:
        """How the leading metric of every policy changes, by the mean and in how many missions."""
        facts = []
        for row in self._of_leading():
            facts += self._leading_facts(row)
        table = self.table()
        for row in table[table["metric"] == COST].itertuples():
            unit = self.results.prices.unit
            before, after = (numbers.format_money(mean, unit) for mean in (row.before, row.after))
            change = f"{format_change(row)} {unit}, {_VERDICTS[judge_difference(row)]}"
            label = f"{metric_of(COST).within} with {row.policy}"
            facts.append(Fact(label, f"{change}; {before} before, {after} after"))
        for row in table[table["metric"] == HOME].itertuples():
            before, after = map(numbers.format_percent, (row.before, row.after))
            label = f"{metric_of(HOME).within} with {row.policy}"
            facts.append(Fact(label, f"{before} before, {after} after"))
        facts += [
            Fact(f"best in the {side}", self._best(point)) for point, side in enumerate(SIDES)
        ]
        return known_facts(facts)

    def _leading_facts(self, row: Any) -> list[Fact]:
        """What a row of ``compare_sides`` on the leading metric says of its policy.

        A failed mission counts 0 in the product, so that a few of them can outweigh many small
        gains: the product may be higher in most missions and lower on average.
        """
        policy = row.policy
        verdict = judge_difference(row)
        metric = self._leading
        before, after = map(metric.write, (row.before, row.after))
        gaps = paired_differences(self.results, policy, metric.column)
        if metric.less_is_better:
            gaps = -gaps
        better, worse = (numbers.format_percent(share.mean()) for share in (gaps > 0, gaps < 0))
        missions = self.results.missions_of(policy)
        failures = (1 - missions[SUCCESS]).groupby(missions["point"]).sum().astype(int)
        change = f"{self._change_of_leading(row)}, {_VERDICTS[verdict]}"
        facts = [
            Fact(f"{metric.within} with {policy}", f"{change}; {before} before, {after} after"),
            Fact(f"{row.n:,} pairs with {policy}", f"better in {better}, worse in {worse}"),
        ]
        name = self.results.study.replication_name
        if failures.any() and not self.results.study.years:
            counts = f"{failures[BASELINE]:,} before, {failures[VARIATION]:,} after"
            facts.append(Fact(f"failed missions with {policy}", counts))
        if verdict not in (ABOVE, BELOW):
            facts.append(Fact(f"{name}s to show it with {policy}", _missing_in_words(row)))
        return facts

    def _best(self, point: int) -> str:
        """The best policy of one side with its mean, as ``greedy, 95.3 % [94.5, 96.1]``."""
        policy = best_policy_of_side(self.results, point)
        metric = self._leading
        mean = estimate_metric(self.results, policy, metric.column, point)
        return f"{policy}, {metric.written(*mean[['mean', 'low', 'high']])}"

    @property
    def _changed(self) -> dict[str, Any]:
        """The fields that the variation sets."""
        return self.results.store.manifest.points[VARIATION].values

    def _fields(self, names: Iterable[str]) -> pd.DataFrame:
        """Fields of the scenario in the baseline and in the variation, as a table to print."""
        rows = [
            (
                name,
                described_field(name).brief,
                *(self._value_in_words(side, name) for side in (BASELINE, VARIATION)),
            )
            for name in names
        ]
        return pd.DataFrame(rows, columns=["Field", "Meaning", "Baseline", "Variation"])

    def _value_in_words(self, side: int, field: str) -> str:
        """The value of a field on one side; also of a zone that 0 pads leave out."""
        given = self.results.store.manifest.points[side].values.get(field)
        if field == ZONE_PADS and given is not None:
            return str(sum_in_words(given))
        return field_in_words(self.results.scenario(side), field)

    def field_table(self) -> pd.DataFrame:
        """The fields that the variation changes, that both sides set and that missions draw."""
        space = self.results.scenario(BASELINE)
        ranges = {name: getattr(space, name) for name in RANGES}
        drawn = [name for name, (low, high) in ranges.items() if low < high]
        shared = self.results.store.manifest.study.set
        return self._fields(dict.fromkeys([*self._changed, *shared, *drawn]))

    @property
    def sides(self) -> tuple[list[str], list[str]]:
        """The changed fields with their values in the baseline and in the variation: ``3 UAVs``."""
        before, after = (
            [field_named(name).words(self._value_in_words(side, name)) for name in self._changed]
            for side in (BASELINE, VARIATION)
        )
        return before, after

    def measures_table(self, policy: str) -> Table:
        """The means of a policy on both sides, and their differences."""
        table = self.table()
        rows = table[table["policy"] == policy]
        lines = []
        for row in rows.itertuples():
            measure = self._measure_of(row.metric)
            if measure.in_percent:
                write, unit = (numbers.format_percent, " points")
            elif measure.kind == "cost":
                write, unit = (partial(numbers.format_money, currency=""), "")
            else:
                write, unit = (_format_amount, "")
            means = (row.before, row.after)
            sides = ["–" if np.isnan(mean) else write(mean).rstrip() for mean in means]
            name = (_SHORT | MEASURES).get(row.metric) or measure.label
            difference = ""
            if row.n:
                difference = f"{MARKS[judge_difference(row)]} {format_change(row)}{unit}"
            lines.append([name, *sides, difference])
        heads = [policy, "Baseline", "Variation", "Paired difference"]
        name = self.results.study.replication_name
        caption = f"Means per {name} with {policy}, n = {rows['n'].max():,}; {_MARKED}"
        return Table(pd.DataFrame(lines, columns=heads), caption, rows)

    def pairing(self) -> pd.DataFrame:
        """How much common random numbers narrow the intervals, as a table to print."""
        table = self.table()
        lines = []
        for row in table[table["metric"].isin([*METRICS])].itertuples():
            if np.isnan(row.variance_reduction):  # the same in all missions
                lines.append((row.policy, _SHORT[row.metric], "no variance", *"–––"))
                continue
            left = 1 - row.variance_reduction
            if left < 1:
                narrower = numbers.format_percent(1 - left**0.5)
            else:
                narrower = "none"
            if left:
                worth = f"{row.n / left:,.0f}"
            else:
                worth = "any number"
            amounts = (
                numbers.format_minus(f"{row.correlation:.2f}"),
                numbers.format_percent(left),
                narrower,
            )
            lines.append((row.policy, _SHORT[row.metric], *amounts, worth))
        heads = ["Policy", "Metric", "Correlation", "Variance left", "Narrower by", "Worth"]
        return pd.DataFrame(lines, columns=heads)

    def finding(self, metric: str = PRODUCT) -> str:
        """How a metric differs with each policy, in a sentence for the caption of a figure.

        Args:
            metric: The metric.
        """
        table = self.table()
        measure = self._measure_of(metric)
        unit = " points" if measure.in_percent else f" {measure.unit}".rstrip()
        parts = []
        for row in table[table["metric"] == metric].itertuples():
            if not row.n:
                parts.append(f"with {row.policy} measured on one side alone")
            elif row.low == row.high == 0:
                parts.append(f"with {row.policy} the same in all pairs")
            else:
                verdict = _VERDICTS[judge_difference(row)]
                parts.append(f"with {row.policy} {verdict} ({format_change(row)}{unit})")
        return f"{measure.name} in the variation: {'; '.join(parts)}. "

    def _measure_of(self, metric: str) -> Metric:
        """A metric, in the currency of the study if it is a cost."""
        measure = metric_of(metric)
        if measure.kind == "cost":
            return replace(measure, unit=self.results.prices.unit)
        return measure

    def spread_in_words(self) -> str:
        """In how many missions the product differs with each policy, in a sentence."""
        parts = []
        for policy in self.results.policies:
            gaps = paired_differences(self.results, policy)
            better, worse = (numbers.format_percent(part.mean()) for part in (gaps > 0, gaps < 0))
            parts.append(f"with {policy} higher in {better} and lower in {worse} of the pairs")
        return f"Product in the variation: {'; '.join(parts)}. "

    def plot(self) -> "Figure":
        """The paired differences of the metrics, with intervals."""
        from dess.analysis.figures import comparison

        return comparison.plot_gains(self.table())

    def plot_means(self, metric: str = PRODUCT) -> "Figure":
        """A metric of every policy in the baseline and in the variation, with intervals.

        Args:
            metric: One of the paper's metrics, or of what the missions measured.
        """
        from dess.analysis.figures import comparison

        sides = ["\n".join((side, *words)) for side, words in zip(SIDES, self.sides, strict=True)]
        return comparison.plot_sides(means_of_sides(self.results), metric, sides)

    def plot_spread(self) -> "Figure":
        """The distribution of the paired differences in product."""
        from dess.analysis.figures import comparison

        policies = self.results.policies
        return comparison.plot_difference_spread(
            {policy: paired_differences(self.results, policy) for policy in policies}
        )

    def typical(self) -> "Example":
        """The replication that has the median of the differences.

        With an even number it is the lower one of the two in the middle; among equal ones, the
        first.
        """
        ordered = paired_differences(self.results, self.shown).sort_values(kind="stable")
        median = ordered.iloc[(len(ordered) - 1) // 2]
        return Example(self, int(ordered.index[ordered == median][0]))

    def worst(self) -> "Example":
        """The replication with the lowest product in the variation.

        Among equal ones it is the one with the lowest collection ratio, then the first.
        """
        missions = self.results.missions
        is_shown = (missions["policy"] == self.shown) & (missions["point"] == VARIATION)
        ordered = missions[is_shown].sort_values([PRODUCT, RATIO], kind="stable")
        return Example(self, int(ordered["replication"].iloc[0]))

    def as_toml(self) -> str:
        """The question as the TOML file of a study, to which rows can be added."""
        study = self.results.manifest["study"]
        names = ("scenario", "policies", "missions", "seed", "set", "design")
        return tomli_w.dumps({"name": "my-sweep"} | {n: study[n] for n in names if study[n] != {}})


@dataclass(frozen=True)
class Example:
    """A replication of the shown policy in the baseline and in the variation.

    Attributes:
        variation: The variation and its baseline.
        replication: The replication.
    """

    variation: Variation
    replication: int

    def effect(self) -> str:
        """By how much the variation changes the mission, in a sentence of Markdown."""
        policy = self.variation.shown
        gap = numbers.format_difference(
            paired_differences(self.variation.results, policy)[self.replication], 0
        )
        return (
            f"Replication {self.replication} with **{policy}**: the variation changes the product "
            f"by {gap} points."
        )

    def commands(self) -> list[str]:
        """The commands that simulate both missions again."""
        command = self.variation.results.command
        lines = []
        for point, side in enumerate(SIDES):
            lines += [f"# {side}", command(self.variation.shown, point, self.replication)]
        return lines

    def drawings(self) -> "list[tuple[Figure, str, str]]":
        """The two missions, simulated again: a figure, its alternative text and caption each."""
        return [self._drawing(point) for point in (BASELINE, VARIATION)]

    def _drawing(self, point: int) -> "tuple[Figure, str, str]":
        from dess.analysis.figures.missions import mission_figure

        shown, results = self.variation.shown, self.variation.results
        mission = resimulate(results, shown, point, self.replication)
        figure = mission_figure(mission.events, mission.scenario)
        caption = (
            f"{SIDES[point].capitalize()} ({', '.join(self.variation.sides[point])}): collection "
            f"ratio {numbers.format_percent(mission.record.collection_ratio)}; "
            f"{end_in_words(mission)}. "
            f"{format_length(mission.record.slots, mission.scenario.units)}. n = 1."
        )
        return figure, "Map of the mission; battery, residual data and charging", caption
