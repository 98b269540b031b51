"""A what-if question: a baseline and a variation of a scenario, with common random numbers.

A question is a study of two design points, ``BASELINE`` and ``VARIATION``. Both have the same
replications, so they have the same initial data, arrivals, shadowing and drawn parameters, except
what the variation sets:

    results = ask(question({"uavs": 5}, baseline={"quota": 300}), "results")

``questions.what_if.answer`` has the answer, and ``analysis.what_if`` does both.
"""

import json
import shlex
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import tomli_w

from analysis import numbers
from analysis.execution.dry_run import check_run
from analysis.execution.jobs import Progress
from analysis.execution.runner import run_study
from analysis.results.chunks import short_hash
from analysis.results.files import MANIFEST
from analysis.results.manifest import Manifest
from analysis.results.tables import Results
from analysis.study.best import policies_for
from analysis.study.study import Study, study_from
from dess.errors import InputError, one_of
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
    without_number = {name: v for name, v in manifest.study.items() if name != "missions"}
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


def listed(results: Results) -> pd.DataFrame:
    """The fields that the variation changes, that both sides set and that every mission draws."""
    manifest, space = results.store.manifest, results.scenario(BASELINE)
    changed, shared = manifest.points[VARIATION].values, manifest.study["set"]
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
    """The question as the TOML file of a study, to which rows can be added."""
    study = results.store.manifest.study
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
