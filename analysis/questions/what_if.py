"""What if: a variation of a scenario beside its baseline, mission by mission on the same seas.

A question is a study of two design points, ``BASELINE`` and ``VARIATION``. Both have the same
replications: initial data, arrivals, shadowing and all that is drawn are equal as far as the
variation does not set them (common random numbers).
"""

import json
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import tomli_w
from pydantic import ValidationError
from scipy import stats

from analysis.execution.runner import run_study
from analysis.names import METRICS, PRODUCT
from analysis.questions import summary as findings
from analysis.results.chunks import short_hash
from analysis.results.manifest import Manifest
from analysis.results.tables import Results
from analysis.stats.intervals import LEVEL, summary
from analysis.stats.paired import compare
from analysis.stats.verdict import INCONCLUSIVE
from analysis.study.study import Study
from dess import simulate_batch
from dess.errors import InputError
from dess.scenario import SAMPLED, ScenarioSpace, load_scenario, validation_line
from policies import load_team

NAME = "what-if"
BASELINE, VARIATION = 0, 1  # the design points
SIDES = ("baseline", "variation")

# What an engineer wants to know beside the paper's metrics: means per mission.
MEASURES = {
    "slots": "Mission slots",
    "collected": "Data collected",
    "collected_per_uav": "Data collected per UAV",
    "residual": "Data left",
    "charging_per_uav": "Slots charging per UAV",
    "waiting_per_uav": "Slots waiting per UAV",
    "dry": "UAVs run dry in 100 missions",
}

HIGHER, LOWER = "higher", "lower"

# Probability of telling a difference of the size that was seen, for ``missions_to_tell``.
POWER = 0.8

_MISSION = ["policy", "point", "replication"]
_RANGES = (*SAMPLED, "initial_data")  # fields that hold [low, high]


class Change(NamedTuple):
    """A field that the variation changes, with its values in words."""

    field: str
    description: str
    before: str
    after: str


def question(
    settings: Mapping[str, Any],
    baseline: Mapping[str, Any] | None = None,
    scenario: str | Path = "paper",
    policies: Sequence[str] = ("ddqn", "greedy"),
    missions: int = 500,
    seed: int = 0,
) -> Study:
    """The study that answers: what if the baseline had these settings?

    Args:
        settings: Fields of the scenario that the variation sets.
        baseline: Fields of the scenario that are set in both, where ``settings`` does not.
        scenario: A shipped scenario, or a TOML file.
        policies: Teams, each compared with itself.
        missions: How many of each, at least 2.
        seed: Of the missions.

    Raises:
        InputError: If a field, a value or a policy is unknown or not allowed, or a setting is none.
    """
    for name, values in (("settings", settings), ("baseline", baseline or {})):
        if not isinstance(values, Mapping):
            raise InputError(f"{name}: {values!r}; allowed: fields and values, such as {{uavs=5}}")
    fixed, rows = dict(baseline or {}), dict(settings)
    before = load_scenario(scenario, **fixed)
    after = load_scenario(scenario, **fixed | rows)
    if not rows:
        allowed = ", ".join(ScenarioSpace.model_fields)
        raise InputError(f"settings: none is given; allowed: one or more of {allowed}")
    for field in rows:
        if _value(before, field) == _value(after, field):
            raise InputError(
                f"settings: {field} is {told(before, field)} in the baseline already; "
                "allowed: another value"
            )
    if isinstance(missions, int) and missions < 2:
        raise InputError(f"missions: {missions} is too few; allowed: 2 or more")
    data = {
        "name": NAME,
        "description": "a variation beside its baseline, on the same missions",
        "scenario": str(scenario),
        "set": {field: value for field, value in fixed.items() if field not in rows},
        "design": {"kind": "table", "rows": [{f: fixed[f] for f in rows if f in fixed}, rows]},
        "policies": policies,
        "missions": missions,
        "seed": seed,
    }
    try:
        return Study.model_validate(data)
    except ValidationError as error:
        raise InputError(validation_line(error, "question", Study)) from None


def key_of(study: Study) -> str:
    """A hash of a question: of all that its records depend on, but not of how many there are.

    So the same question with more missions tops up what is there.
    """
    manifest = Manifest.of(study)
    asked = {name: value for name, value in manifest.study.items() if name != "missions"}
    cells = [cell.key for of_team in manifest.cells for cell in of_team]
    return short_hash(json.dumps([asked, cells], sort_keys=True).encode())


def check_policy(study: Study, policy: str) -> None:
    """Refuse a policy that a question is not about.

    Raises:
        InputError: If it is none of the study's.
    """
    if policy not in study.policies:
        allowed = ", ".join(study.policies)
        raise InputError(f"shown: {policy!r} is not asked about; allowed: {allowed}")


def ask(study: Study, folder: str | Path, workers: int = 1) -> Results:
    """Run a question, as far as it has not been, into ``FOLDER/what-if/KEY``.

    Args:
        study: As of ``question``.
        folder: Where results folders are kept.
        workers: Processes. Two or more take seconds to start, and pay for long runs only.

    Raises:
        InputError: If a policy cannot fly in the scenario, before anything is written; if the
            folder cannot be written or is in use.
        ChunkError: As of ``run_study``.
    """
    for policy in study.policies:
        for point in study.points:
            simulate_batch(point.scenario, load_team(policy), study.seed, 1)
    return run_study(study, Path(folder) / NAME / key_of(study), workers)


def changes(results: Results) -> list[Change]:
    """What the variation changes, in the order of the settings."""
    before, after = (results.scenario(point) for point in (BASELINE, VARIATION))
    fields = ScenarioSpace.model_fields
    return [
        Change(field, fields[field].description or "", told(before, field), told(after, field))
        for field in results.store.manifest.points[VARIATION].values
    ]


def drawn(results: Results) -> dict[str, str]:
    """The fields that every mission draws for itself, in baseline and variation alike."""
    changed = results.store.manifest.points[VARIATION].values
    space = results.scenario(BASELINE)
    ranges = {field: getattr(space, field) for field in _RANGES if field not in changed}
    return {field: told(space, field) for field, (low, high) in ranges.items() if low < high}


def shared(results: Results) -> dict[str, str]:
    """The fields that are set in baseline and variation alike."""
    space = results.scenario(BASELINE)
    return {field: told(space, field) for field in results.store.manifest.study["set"]}


def told(space: ScenarioSpace, field: str) -> str:
    """The value of a field in words: ``3``, ``10 to 50`` of a range, ``25 cells`` of nodes."""
    value = _value(space, field)
    if field in _RANGES:
        return " to ".join(dict.fromkeys(f"{end:g}" for end in value))
    if field == "nodes":
        return f"{len(value)} cells"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value).strip("()")


def missions_of(results: Results) -> pd.DataFrame:
    """``results.missions`` with all of ``MEASURES``."""
    uavs = results.uavs.assign(dry=100 * (results.uavs["end"] == "battery"))
    sums = uavs.groupby(_MISSION)[["slots_charging", "slots_waiting", "dry"]].sum()
    missions = results.missions.join(sums, on=_MISSION)
    return missions.assign(
        collected_per_uav=missions["collected"] / missions["uavs"],
        charging_per_uav=missions["slots_charging"] / missions["uavs"],
        waiting_per_uav=missions["slots_waiting"] / missions["uavs"],
    )


def means(results: Results) -> pd.DataFrame:
    """Means with intervals: rows of ``analysis.summary`` by ``policy`` and ``point``."""
    table = summary(results.missions, by=["policy", "point"])
    return table[table["metric"].isin([*METRICS])].reset_index(drop=True)


def answers(results: Results) -> pd.DataFrame:
    """The variation against the baseline, mission by mission.

    Returns:
        A row per policy and metric (those of ``METRICS``, then of ``MEASURES``): ``policy``, the
        means ``before`` and ``after``, and the columns of ``analysis.compare``. Every interval
        stands by itself, at 95 %; that of Student or, for shares, as of ``stats.paired.paired``.
    """
    missions = missions_of(results)
    metrics = [*METRICS, *MEASURES]
    tables = []
    for policy, own in missions.groupby("policy", sort=False):
        table = compare(own, BASELINE, metrics, correction=None, of="point")
        sides = own.groupby("point")[metrics].mean()
        table.insert(0, "policy", policy)
        table["before"] = table["metric"].map(sides.loc[BASELINE])
        table["after"] = table["metric"].map(sides.loc[VARIATION])
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def verdict(answer: Any) -> str:
    """What a row of ``answers`` says: by the whole interval, or that it cannot be told."""
    # An interval without length says nothing of the spread: there the sign test decides.
    known = answer.low < answer.high or answer.p <= 1 - LEVEL
    if known and answer.low > 0:
        return HIGHER
    return LOWER if known and answer.high < 0 else INCONCLUSIVE


def missions_to_tell(answer: Any, power: float = POWER) -> float:
    """How many missions it takes to tell a difference of the size that a row of ``answers`` saw.

    By the normal approximation, with the spread that was seen: both are estimates themselves.

    Args:
        answer: The row.
        power: Probability that the interval of that many missions leaves out 0.

    Returns:
        The number; infinite if no difference was seen, or nothing of the spread.
    """
    if not answer.difference or answer.low == answer.high:
        return np.inf
    quantile = stats.norm.isf((1 - LEVEL) / 2)
    half = (answer.high - answer.low) / 2 / abs(answer.difference)
    return float(np.ceil(answer.n * (half * (1 + stats.norm.ppf(power) / quantile)) ** 2))


def differences(results: Results, policy: str, metric: str = PRODUCT) -> pd.Series:
    """Variation - baseline of a metric of a policy, by replication."""
    own = results.missions[results.missions["policy"] == policy]
    sides = own.pivot(index="replication", columns="point", values=metric)
    return sides[VARIATION] - sides[BASELINE]


def best_policy(results: Results, point: int) -> str:
    """The policy with the highest mean of collection ratio and communication on a side."""
    missions = results.missions
    return findings.best_policy(missions[missions["point"] == point])


def typical(results: Results, policy: str) -> int:
    """The replication whose difference in collection ratio and communication is the median.

    Of an even number it is the lower one in the middle, of those alike the first.
    """
    ordered = differences(results, policy).sort_values(kind="stable")
    middle = ordered.iloc[(len(ordered) - 1) // 2]
    return int(ordered.index[ordered == middle][0])


def worst(results: Results, policy: str) -> int:
    """The replication with the lowest collection ratio and communication in the variation.

    Of those alike it is the one that collected the smallest part, then the first.
    """
    own = results.missions.query("policy == @policy and point == @VARIATION")
    ordered = own.sort_values([PRODUCT, "collection_ratio"], kind="stable")
    return int(ordered["replication"].iloc[0])


def command(results: Results) -> str:
    """The command that makes the page of a question again."""
    study, points = results.store.manifest.study, results.store.manifest.points
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
    """The question as the TOML file of a study, to add rows to."""
    study = results.store.manifest.study
    names = ("scenario", "policies", "missions", "seed", "set", "design")
    return tomli_w.dumps({"name": "my-sweep"} | {n: study[n] for n in names if study[n] != {}})


def _assignments(values: Mapping[str, Any]) -> list[str]:
    """``field=value`` for every field, in TOML syntax."""
    return [f"{field}={json.dumps(value)}" for field, value in values.items()]


def _value(space: ScenarioSpace, field: str) -> Any:
    """The value of a field; the number of pads where it follows from the zone."""
    value = getattr(space, field)
    return space.zone_cells if field == "pads" and value is None else value
