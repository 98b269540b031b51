"""A what-if question in one line: a study of a scenario and changes of it."""

import json
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import tomli_w
from scipy import stats

from analysis import numbers
from analysis.answers import summary
from analysis.answers.missions import estimate
from analysis.execution.effort import check_run, policies_for
from analysis.execution.jobs import Progress
from analysis.execution.runner import run_study
from analysis.metrics import METRICS, PRODUCT, RATIO, SUCCESS, measured_in, metric_of
from analysis.names import parameter
from analysis.results.chunks import MANIFEST, short_hash
from analysis.results.manifest import Manifest
from analysis.results.resimulate import resimulate
from analysis.results.tables import Results
from analysis.stats.differences import compare
from analysis.stats.intervals import LEVEL, by_replication
from analysis.stats.verdict import ABOVE, BELOW, INCONCLUSIVE, MARKS, position
from analysis.study.study import Study, study_from
from dess import InputError
from dess.errors import one_of
from dess.files.reading import paths_in
from dess.scenario import SAMPLED, ScenarioSpace, dotted, fields_of, load_scenario
from policies.registry import typed

NAME = "what-if"
BASELINE, VARIATION = 0, 1  # the design points
SIDES = ("baseline", "variation")

_RANGES = (*SAMPLED, "initial_data")  # fields that hold [low, high]


def question(
    settings: Mapping[str, Any],
    baseline: Mapping[str, Any] | None = None,
    scenario: str | Path = "paper",
    policies: Sequence[str] | None = None,
    missions: int = 500,
    seed: int = 0,
) -> Study:
    """The study that answers: what if the baseline had these settings?

    Where fields of a section are set, both sides measure what the section can measure.

    Args:
        settings: Fields of the scenario that the variation sets.
        baseline: Fields of the scenario that are set in both; in the variation, ``settings`` comes
            first.
        scenario: The name of a shipped scenario, or a TOML file.
        policies: Teams, each compared with itself. Without any, the best policy that five minutes
            allow, and ``greedy``.
        missions: Number of missions of each policy on each side, at least 2.
        seed: Seed of the missions.

    Raises:
        InputError: If a field, a value or a policy is unknown or not allowed, or if ``settings``
            changes nothing.
    """
    for name, values in (("settings", settings), ("baseline", baseline or {})):
        if not isinstance(values, Mapping):
            raise InputError(f"{name}: {values!r}; allowed: fields and values, such as {{uavs=5}}")
    fixed, changed = dotted(dict(baseline or {})), dotted(dict(settings))
    measuring = {field for field in changed if field.endswith(".measured")}
    if changed.keys() - measuring:  # what changes is something else, which both sides measure
        fixed |= {field: changed.pop(field) for field in sorted(measuring)}
    fixed = _measured(fixed | changed) | fixed
    sides = load_scenario(scenario, **fixed), load_scenario(scenario, **fixed | changed)
    _check_changes(*sides, changed)
    if isinstance(missions, int) and missions < 2:
        raise InputError(f"missions: {missions} is too few; allowed: 2 or more")
    before = {field: fixed[field] for field in changed if field in fixed}
    data = {
        "name": NAME,
        "description": "a variation compared with its baseline, on the same missions",
        "scenario": str(scenario),
        "set": {field: value for field, value in fixed.items() if field not in changed},
        "design": {"kind": "table", "rows": [before, changed]},
        "policies": typed(policies_for(sides, missions) if policies is None else policies),
        "missions": missions,
        "seed": seed,
    }
    return study_from(data, "question")


def key_of(study: Study) -> str:
    """A hash of all that the records of a question depend on, without their number.

    So the same question with more missions adds to the same results folder.
    """
    manifest = Manifest.of(study)
    without_number = {name: v for name, v in manifest.data["study"].items() if name != "missions"}
    cells = [cell.key for of_team in manifest.cells for cell in of_team]
    return short_hash(json.dumps([without_number, cells], sort_keys=True).encode())


def check_policy(study: Study, policy: str) -> None:
    """Refuse a policy that is not in the question.

    Raises:
        InputError: If the study does not have the policy.
    """
    if policy not in study.policies:
        raise InputError(f"shown: {policy!r} is not asked about{one_of(policy, study.policies)}")


def ask(
    study: Study,
    folder: str | Path,
    workers: int = 1,
    progress: Progress | None = None,
    yes: bool = False,
) -> Results:
    """Run a question into ``FOLDER/what-if/KEY``; missions of other questions there are reused.

    Args:
        study: The result of ``question``.
        folder: Folder in which results folders are stored.
        workers: Number of processes. Two or more take seconds to start; they help in long runs.
        progress: As for ``run_study``.
        yes: Whether a question of any length is allowed.

    Raises:
        InputError: Before anything is written, if a policy cannot act in the scenario, or the
            question would take long; or if the folder cannot be written or is in use.
        ChunkError: As for ``run_study``.
    """
    out = Path(folder) / NAME / key_of(study)
    others = [p.parent for p in paths_in(out.parent, f"*/{MANIFEST}") if p.parent != out]
    check_run(study, out, workers, reuse=others, yes=yes)
    return run_study(study, out, workers, progress=progress, reuse=others)


def fields(results: Results, names: Iterable[str]) -> pd.DataFrame:
    """Fields of the scenario in the baseline and in the variation, as a table to print."""
    before, after = (results.scenario(point) for point in (BASELINE, VARIATION))
    rows = [(name, _meaning(name), in_words(before, name), in_words(after, name)) for name in names]
    return pd.DataFrame(rows, columns=["Field", "Meaning", "Baseline", "Variation"])


def field_table(results: Results) -> pd.DataFrame:
    """The fields that the variation changes, that both sides set and that every mission draws."""
    manifest, space = results.store.manifest, results.scenario(BASELINE)
    changed, shared = manifest.points[VARIATION].values, manifest.study.set
    ranges = {name: getattr(space, name) for name in _RANGES}
    drawn = [name for name, (low, high) in ranges.items() if low < high]
    return fields(results, dict.fromkeys([*changed, *shared, *drawn]))


def settings_of(results: Results) -> tuple[list[str], list[str]]:
    """The changed fields with their values in the baseline and in the variation: ``uavs 3``."""
    table = fields(results, results.store.manifest.points[VARIATION].values)
    before, after = (table["Field"] + " " + table[side] for side in ("Baseline", "Variation"))
    return [*before], [*after]


def in_words(space: ScenarioSpace, field: str) -> str:
    """The value of a field in words: ``3``, ``10 to 50`` for a range, ``25 cells`` for nodes."""
    value = _value(space, field)
    if field in _RANGES:
        return numbers.span(value, "{:g}")
    if field == "nodes":
        return f"{len(value)} cells"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value).strip("()")


def command(results: Results) -> str:
    """The command that makes the page of a question again."""
    study, points = results.manifest["study"], results.store.manifest.points
    fixed = study["set"] | points[BASELINE].values
    parameters = {
        "baseline": f"{{{', '.join(_assignments(fixed))}}}",
        "scenario": json.dumps(study["scenario"]),
        "policies": json.dumps(study["policies"]),
        "missions": str(study["missions"]),
        "seed": str(study["seed"]),
    }
    words = [w for text in _assignments(points[VARIATION].values) for w in ("--set", text)]
    words += [w for name, text in parameters.items() for w in ("--parameter", f"{name}={text}")]
    return shlex.join(["dess", "report", NAME, *words])


def as_toml(results: Results) -> str:
    """The question as the TOML file of a study, to which rows can be added."""
    study = results.manifest["study"]
    names = ("scenario", "policies", "missions", "seed", "set", "design")
    return tomli_w.dumps({"name": "my-sweep"} | {n: study[n] for n in names if study[n] != {}})


def _check_changes(before: ScenarioSpace, after: ScenarioSpace, changed: Iterable[str]) -> None:
    """Refuse a variation that changes nothing, or sets a field to its value in the baseline."""
    for field in changed:
        if _value(before, field) == _value(after, field):
            raise InputError(
                f"settings: {field} is {in_words(before, field)} in the baseline already; "
                "allowed: another value"
            )
    if not changed:
        allowed = ", ".join(fields_of(ScenarioSpace))
        raise InputError(f"settings: none is given; allowed: one or more of {allowed}")


def _measured(values: Iterable[str]) -> dict[str, bool]:
    """The fields that measure what belongs to the sections of these fields, without those given."""
    sections = {section for section, dot, _ in (field.partition(".") for field in values) if dot}
    measuring = fields_of(ScenarioSpace).keys() & {f"{section}.measured" for section in sections}
    return dict.fromkeys(sorted(measuring - {*values}), True)


def _meaning(field: str) -> str:
    """The first part of a field's description, without details."""
    description = fields_of(ScenarioSpace)[field].description or ""
    return description.partition(";")[0].partition(":")[0]


def _assignments(values: Mapping[str, Any]) -> list[str]:
    """``field=value`` for every field, in TOML syntax."""
    return [f"{field}={json.dumps(value)}" for field, value in values.items()]


def _value(space: ScenarioSpace, field: str) -> Any:
    """The value of a field; for ``pads``, the number of pads also if it follows from the zone."""
    value = space.value(field)
    return space.zone_pads[0] if field == "pads" else value


# Further quantities per mission, in addition to the paper's metrics.
MEASURES = {
    "slots": "Mission slots",
    "collected": "Data collected",
    "collected_per_uav": "Data collected per UAV",
    "residual": "Data left",
    "charging_per_uav": "Slots charging per UAV",
    "waiting_per_uav": "Slots waiting per UAV",
    "depleted": "Depleted batteries in 100 missions",
}

# Power, for ``missions_needed``: the probability that a difference of this size is significant.
POWER = 0.8

# What is 0 where nothing can fail and no buffer is limited, which is not measured then.
_NOTHING = ("failures", "slots_grounded", "lost")

_SHORT = {SUCCESS: "Success", RATIO: "Collection ratio", PRODUCT: "Their product"}
_MISSION = ["policy", "point", "replication"]


def missions_of(results: Results) -> pd.DataFrame:
    """``results.missions`` with all of ``MEASURES``; nothing failed where nothing can fail."""
    uavs = results.uavs.assign(depleted=100 * (results.uavs["end"] == "battery"))
    sums = uavs.groupby(_MISSION)[["slots_charging", "slots_waiting", "depleted"]].sum()
    missions = results.missions.join(sums, on=_MISSION)
    fillable = [name for name in _NOTHING if name in measured(results)]
    return missions.fillna(dict.fromkeys(fillable, 0.0)).assign(
        collected_per_uav=missions["collected"] / missions["uavs"],
        charging_per_uav=missions["slots_charging"] / missions["uavs"],
        waiting_per_uav=missions["slots_waiting"] / missions["uavs"],
    )


def measured(results: Results) -> list[str]:
    """What scenarios beyond the paper measure, on at least one of both sides."""
    missions = results.missions
    return [name for name in measured_in(missions) if missions[name].notna().any()]


def means(results: Results) -> pd.DataFrame:
    """Means with intervals: rows of ``analysis.summary`` by ``policy`` and ``point``."""
    table = summary.means(replace(results, missions=missions_of(results)))
    return table[table["metric"].isin([*METRICS, *measured(results)])].reset_index(drop=True)


def answers(results: Results) -> pd.DataFrame:
    """The variation compared with the baseline, mission by mission.

    Returns:
        A row per policy and metric (those of ``METRICS``, what is ``measured``, then those of
        ``MEASURES``): ``policy``, the means ``before`` and ``after``, and the columns of
        ``analysis.compare``. Every interval has its own level of 95 %; see
        ``stats.paired.paired``. Of what only one side measures, ``n`` is 0 and all else nan but the
        mean of this side.
    """
    missions = missions_of(results)
    metrics = [*METRICS, *measured(results), *MEASURES]
    tables = []
    for policy, rows in missions.groupby("policy", sort=False):
        table = compare(rows, BASELINE, metrics, correction=None, of="point")
        table = table.set_index("metric").reindex(metrics).rename_axis("metric").reset_index()
        table["n"] = table["n"].fillna(0).astype(int)
        sides = pd.DataFrame({m: by_replication(rows, m, "point").mean() for m in metrics})
        table.insert(0, "policy", policy)
        table["before"] = table["metric"].map(sides.loc[BASELINE])
        table["after"] = table["metric"].map(sides.loc[VARIATION])
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def verdict(answer: Any) -> str:
    """Whether the variation is significantly ``ABOVE`` or ``BELOW`` the baseline.

    The complete interval has to be above or below 0. If it has no length, it tells nothing about
    the variance, so the sign test must be significant as well.

    Args:
        answer: A row of ``answers``.
    """
    known = answer.low < answer.high or answer.p <= 1 - LEVEL
    return position(answer) if known else INCONCLUSIVE


def missions_needed(answer: Any) -> float:
    """The number of missions that would show a difference of the observed size.

    It is computed by the normal approximation from the observed difference and variance, which are
    estimates themselves.

    Returns:
        The number with which the interval excludes 0 with probability ``POWER``; infinite if there
        is no difference, or its variance is unknown.
    """
    if not answer.difference or not answer.low < answer.high:
        return np.inf
    quantile = stats.norm.isf((1 - LEVEL) / 2)
    half = (answer.high - answer.low) / 2 / abs(answer.difference)
    return float(np.ceil(answer.n * (half * (1 + stats.norm.ppf(POWER) / quantile)) ** 2))


def differences(results: Results, policy: str) -> pd.Series:
    """Variation - baseline in product of a policy, by replication."""
    missions = results.missions[results.missions["policy"] == policy]
    sides = missions.pivot(index="replication", columns="point", values=PRODUCT)
    return sides[VARIATION] - sides[BASELINE]


def all_differences(results: Results) -> dict[str, pd.Series]:
    """The ``differences`` of every policy."""
    return {policy: differences(results, policy) for policy in results.policies}


def best_policy(results: Results, point: int) -> str:
    """The policy with the highest mean product on one side."""
    missions = results.missions
    return summary.best_policy(missions[missions["point"] == point])


def typical(results: Results, policy: str) -> int:
    """The replication whose difference in product is the median.

    With an even number it is the lower one of the two in the middle; among equal ones, the first.
    """
    ordered = differences(results, policy).sort_values(kind="stable")
    middle = ordered.iloc[(len(ordered) - 1) // 2]
    return int(ordered.index[ordered == middle][0])


def worst(results: Results, policy: str) -> int:
    """The replication with the lowest product in the variation.

    Among equal ones it is the one with the lowest collection ratio, then the first.
    """
    missions = results.missions.query("policy == @policy and point == @VARIATION")
    ordered = missions.sort_values([PRODUCT, RATIO], kind="stable")
    return int(ordered["replication"].iloc[0])


def sentence(results: Results, table: pd.DataFrame) -> str:
    """What the variation changes, in a sentence.

    Args:
        results: The results of the question.
        table: The ``answers``.
    """
    sides = fields(results, results.store.manifest.points[VARIATION].values).itertuples()
    new = [f"{parameter(s.Field).words(s.Variation)} instead of {s.Baseline}" for s in sides]
    parts = [
        f"that of {row.policy} by {change(row)} points"
        + " (inconclusive)" * (verdict(row) == INCONCLUSIVE)
        for row in table[table["metric"] == PRODUCT].itertuples()
    ]
    n = numbers.span(table["n"])
    return f"With {numbers.words(new)}, the product changes: {numbers.words(parts)}; n = {n} pairs."


def conclusions(table: pd.DataFrame) -> str:
    """What ``answers`` say about product: a list, an item per policy."""
    words = {
        ABOVE: "is **higher** in the variation",
        BELOW: "is **lower** in the variation",
        INCONCLUSIVE: "is **inconclusive**",
    }
    return "\n".join(
        f"- **{row.policy}**: product {words[verdict(row)]}, by "
        f"{change(row)} points: from {numbers.percent(row.before)} to "
        f"{numbers.percent(row.after)}.{_missing(row) if verdict(row) == INCONCLUSIVE else ''}"
        for row in table[table["metric"] == PRODUCT].itertuples()
    )


def _missing(answer: Any) -> str:
    """How many missions would be needed for a conclusive answer, in words."""
    needed = missions_needed(answer)
    if needed == np.inf:
        return " These missions do not tell how many would show a difference."
    return (
        " If the true difference is as large as this estimate, about "
        f"{float(f'{needed:.2g}'):,.0f} missions (instead of {answer.n:,}) show it with a "
        f"probability of {100 * POWER:g} %. Only the additional missions would be simulated."
    )


def best_of_side(results: Results, point: int) -> str:
    """The best policy of one side with its mean, as ``greedy, 95.3 % [94.5, 96.1]``."""
    policy = best_policy(results, point)
    return f"{policy}, {numbers.estimate(estimate(results, policy, point=point))}"


def winners(changes: Mapping[str, pd.Series]) -> str:
    """In words: the shares of the missions in which each policy is better or worse.

    Args:
        changes: For each policy the result of ``differences``.
    """
    shares = {policy: [(gaps > 0).mean(), (gaps < 0).mean()] for policy, gaps in changes.items()}
    return "; ".join(
        f"{policy} is better in {numbers.percent(more)} and worse in {numbers.percent(less)}"
        for policy, (more, less) in shares.items()
    )


def answer_table(table: pd.DataFrame, policy: str) -> pd.DataFrame:
    """The rows of ``answers`` of a policy, as a table to print."""
    lines = []
    for row in table[table["policy"] == policy].itertuples():
        write, unit = (numbers.percent, " points") if row.metric in METRICS else (_amount, "")
        sides = ["–" if np.isnan(mean) else write(mean) for mean in (row.before, row.after)]
        name = (_SHORT | MEASURES).get(row.metric) or metric_of(row.metric).label
        difference = f"{MARKS[verdict(row)]} {change(row)}{unit}" if row.n else ""
        lines.append([name, *sides, difference])
    heads = ["Mean per mission", "Baseline", "Variation", "Paired difference"]
    return pd.DataFrame(lines, columns=heads)


def pairing(table: pd.DataFrame) -> pd.DataFrame:
    """How much common random numbers narrow the intervals of ``answers``, as a table to print."""
    lines = []
    for row in table[table["metric"].isin([*METRICS])].itertuples():
        left = 1 - row.variance_reduction
        narrower = numbers.percent(1 - left**0.5) if left < 1 else "none"
        worth = f"{row.n / left:,.0f}" if left else "any number"
        amounts = (numbers.minus(f"{row.correlation:.2f}"), numbers.percent(left), narrower, worth)
        lines.append((row.policy, _SHORT[row.metric], *amounts))
    heads = ["Policy", "Metric", "Correlation", "Variance left", "Narrower by", "Worth"]
    return pd.DataFrame(lines, columns=heads)


def outcome(results: Results, policy: str, point: int, replication: int) -> str:
    """The outcome of a mission, in a sentence."""
    where = "policy == @policy and point == @point and replication == @replication"
    (mission,) = results.missions.query(where).itertuples()
    ends = results.uavs.query(where)["end"]
    fates = {"battery": "deplete their battery", "truncated": "run out of time"}
    failures = [
        f"{(ends == end).sum()} of {len(ends)} UAVs {fate}"
        for end, fate in fates.items()
        if (ends == end).any()
    ]
    fate = f"but {numbers.words(failures)}: it counts 0" if failures else "all quotas filled"
    return (
        f"{SIDES[point].capitalize()} ({', '.join(settings_of(results)[point])}): collection ratio "
        f"{numbers.percent(mission.collection_ratio)}, {fate}. {mission.slots} mission slots."
    )


def effect(results: Results, policy: str, replication: int) -> str:
    """By how much the variation changes a mission, in a sentence."""
    gap = numbers.difference(differences(results, policy)[replication], 0)
    return (
        f"Replication {replication} with **{policy}**: the variation changes the product "
        f"by {gap} points."
    )


def commands(results: Results, policy: str, replication: int) -> list[str]:
    """The commands that simulate a replication again, in the baseline and in the variation."""
    points = (BASELINE, VARIATION)
    return [
        line
        for point, side in zip(points, SIDES, strict=True)
        for line in (f"# {side}", results.command(policy, point, replication))
    ]


def change(answer: Any) -> str:
    """The paired difference of a row of ``answers`` with its interval, as text.

    It is in percentage points for the paper's metrics; small numbers have more digits.
    """
    ends = (answer.difference, answer.low, answer.high)
    if answer.metric not in METRICS:
        return _amount(*ends, sign="+")
    if 0 < answer.high - answer.low < 0.01:
        return _amount(*(100 * end for end in ends), sign="+")
    return numbers.points(*ends)


def _amount(value: float, *ends: float, sign: str = "") -> str:
    """A number with two decimals, or more if it is small, and its interval if it has a length."""
    digits = 2 if abs(value) >= 0.1 or not value else 4
    rounded = [round(number, digits) or 0.0 for number in (value, *ends)]  # no -0.00
    texts = [numbers.minus(f"{number:{sign if number else ''}.{digits}f}") for number in rounded]
    return f"{texts[0]} [{', '.join(texts[1:])}]" if len({*ends}) > 1 else texts[0]


if TYPE_CHECKING:  # figures need the extra reports
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Example:
    """A replication of a policy in the baseline and in the variation.

    Attributes:
        results: The results of the question.
        policy: The policy.
        replication: The replication.
    """

    results: Results
    policy: str
    replication: int

    def effect(self) -> str:
        """By how much the variation changes the mission, in a sentence of Markdown."""
        return effect(self.results, self.policy, self.replication)

    def commands(self) -> list[str]:
        """The commands that simulate both missions again."""
        return commands(self.results, self.policy, self.replication)

    def drawings(self) -> "list[tuple[Figure, str, str]]":
        """The two missions, simulated again: a figure, its alternative text and caption each."""
        return [self._drawing(point) for point in (BASELINE, VARIATION)]

    def _drawing(self, point: int) -> "tuple[Figure, str, str]":
        from analysis.figures.missions import mission_figure

        mission = resimulate(self.results, self.policy, point, self.replication)
        figure = mission_figure(mission.events, mission.scenario)
        sentence = outcome(self.results, self.policy, point, self.replication)
        alt = "Map of the mission; battery, residual data and charging"
        return figure, alt, f"{sentence} n = 1."


@dataclass(frozen=True, eq=False)
class WhatIf:
    """A what-if question and its answer.

    Attributes:
        results: The results of the question; ``results.missions`` is a tidy table of the missions.
        shown: The policy of ``typical`` and ``worst``.
    """

    results: Results
    shown: str

    def answer(self) -> str:
        """The paired differences in product, in words (Markdown)."""
        before, after = (best_of_side(self.results, p) for p in (BASELINE, VARIATION))
        return (
            f"{conclusions(self.table())}\n\n"
            f"The highest mean: in the baseline {before}; in the variation {after}."
        )

    def sentence(self) -> str:
        """What the variation changes, in a sentence."""
        return sentence(self.results, self.table())

    def _repr_markdown_(self) -> str:
        return self.answer()

    def table(self) -> pd.DataFrame:
        """The paired differences, with a row per policy and metric, as ``answer.answers``."""
        return answers(self.results)

    def plot(self) -> "Figure":
        """The paired differences of the metrics, with intervals."""
        from analysis.figures import comparison

        return comparison.gains(self.table())

    def plot_means(self, metric: str = PRODUCT) -> "Figure":
        """A metric of every policy in the baseline and in the variation, with intervals.

        Args:
            metric: One of the paper's metrics, or of what the missions measured.
        """
        from analysis.figures import comparison

        settings = settings_of(self.results)
        sides = ["\n".join((side, *words)) for side, words in zip(SIDES, settings, strict=True)]
        return comparison.means(means(self.results), metric, sides)

    def plot_spread(self) -> "Figure":
        """The distribution of the paired differences in product."""
        from analysis.figures import comparison

        return comparison.spread(all_differences(self.results))

    def typical(self) -> Example:
        """The replication that has the median of the differences."""
        replication = typical(self.results, self.shown)
        return Example(self.results, self.shown, replication)

    def worst(self) -> Example:
        """The replication with the worst mission of the variation."""
        return Example(self.results, self.shown, worst(self.results, self.shown))


def what_if(
    settings: Mapping[str, Any],
    baseline: Mapping[str, Any] | None = None,
    scenario: str | Path = "paper",
    policies: Sequence[str] | None = None,
    missions: int = 500,
    seed: int = 0,
    folder: str | Path = "results",
    workers: int = 1,
    shown: str | None = None,
    progress: Progress | None = None,
    yes: bool = False,
) -> WhatIf:
    """Simulate a baseline and a variation of it with common random numbers, and compare them.

    The missions are stored in ``FOLDER/what-if``. The same question is answered at once the next
    time; with more missions, only those that are missing are simulated.

    Args:
        settings: Fields of the scenario that the variation sets.
        baseline: Fields of the scenario that are set in both; in the variation, ``settings`` comes
            first.
        scenario: The name of a shipped scenario, or a TOML file.
        policies: Teams, each compared with itself: ``"P"`` or ``"P,P,..."``. Without any, the best
            policy that five minutes allow, and ``greedy``.
        missions: Number of missions of each policy on each side, at least 2.
        seed: Seed of the missions.
        folder: Folder in which results are stored.
        workers: Number of processes. Two or more take seconds to start; they help in long runs.
        shown: The policy of ``typical`` and ``worst``. By default the best one in the variation.
        progress: Called with the number of missions done since its last call.
        yes: Whether the question may take more than an hour.

    Raises:
        InputError: Before anything is written, if a field, a value or a policy is unknown or not
            allowed, a policy cannot act in the scenario, or the question would take long.
    """
    study = question(settings, baseline, scenario, policies, missions, seed)
    check_policy(study, shown or study.policies[0])
    results = ask(study, folder, workers, progress, yes)
    return WhatIf(results, shown or best_policy(results, VARIATION))
