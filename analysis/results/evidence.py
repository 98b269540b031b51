"""What goes with results wherever they are shown, so that anybody can check them.

A page cannot carry all missions of a study. It carries what they were made with, and a sample of
them whose records can be compared, bit for bit, with those of the same missions flown again.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any, Self

import numpy as np
import pandas as pd
from pydantic import Field, ValidationError, field_validator, model_validator

import dess
from analysis.results.documents import Document
from analysis.results.manifest import simulate_command
from analysis.results.provenance import (
    Acceptance,
    Team,
    code_behind,
    differing,
    library_versions,
    team_of,
)
from analysis.results.resimulate import difference, kept
from analysis.results.store import Store
from analysis.results.tables import Results
from analysis.study.study import load_study, study_names
from dess import simulate
from dess.errors import InputError
from dess.record import MISSION_RECORD
from dess.scenario import ScenarioSpace, validation_line
from policies import load_team
from policies.registry import TRAINED

SAMPLE = 32  # missions of a study that a page carries


class Mission(Document):
    """A mission of a study: who flew it, what its design point sets, and its record.

    The record has the fields of ``MISSION_RECORD``, and those of the UAVs as ``uav 1 quota``.
    """

    policy: str
    values: dict[str, Any]
    replication: int
    record: dict[str, int | float | str]

    @field_validator("record")
    @classmethod
    def _is_whole(cls, record: dict[str, int | float | str]) -> dict[str, int | float | str]:
        if missing := [name for name in MISSION_RECORD.names or () if name not in record]:
            raise ValueError(f"has no {missing[0]}")
        return record


class Evidence(Document):
    """What the results of a study were made with, and some of their missions.

    Attributes:
        key: Of the study: a hash of all that its records depend on, and of how many there are.
        missions: The least and the most of a policy at a design point.
        points: Number of design points.
        budget: How it lies to the shipped study of its name, in words.
    """

    study: str
    key: str
    version: str
    code: dict[str, str]
    engine_code: str
    accepted: list[Acceptance]
    commit: str | None
    libraries: dict[str, str]
    seed: int
    engine: str
    scenario_name: str
    settings: dict[str, Any]
    scenario: dict[str, Any]
    policies: list[Team]
    points: int
    missions: tuple[int, int]
    budget: str
    sample: list[Mission] = Field(min_length=1)

    @model_validator(mode="after")
    def _sample_is_of_the_study(self) -> Self:
        strange = {mission.policy for mission in self.sample} - {t.policy for t in self.policies}
        if strange:
            raise ValueError(f"sample: {min(strange)} is no policy of the study")
        return self

    @classmethod
    def of(cls, results: Results, sample: int = SAMPLE, seed: int | None = None) -> "Evidence":
        """The evidence of results.

        Args:
            results: The results.
            sample: How many missions to draw, those that check a selection among them.
            seed: Of the draw. By default a hash of all records: who alters one of them draws
                others.
        """
        manifest = results.store.manifest
        counts = [n for of_team in manifest.missions for n in of_team]
        return cls(
            study=manifest.study["name"],
            key=manifest.key,
            version=manifest.version,
            code=manifest.code,
            engine_code=manifest.engine_code,
            accepted=manifest.accepted,
            commit=manifest.commit,
            libraries=manifest.libraries,
            seed=manifest.seed,
            engine=manifest.study["engine"],
            scenario_name=manifest.study["scenario"],
            settings=manifest.study["set"],
            scenario=manifest.scenario,
            policies=manifest.policies,
            points=len(manifest.points),
            missions=(min(counts), max(counts)),
            budget=_budget(results),
            sample=_sample(results, sample, _hash(results) if seed is None else seed),
        )

    @classmethod
    def parse(cls, text: str, where: str) -> "Evidence":
        """Evidence from its text.

        Raises:
            InputError: If it is none; ``where`` says where it was found.
        """
        try:
            return cls.model_validate_json(text)
        except ValidationError as error:
            raise InputError(f"{validation_line(error, where)}; allowed: a page of dess") from None

    @property
    def text(self) -> str:
        """The evidence as JSON."""
        return json.dumps(self.model_dump(mode="json", by_alias=True))

    def command(self, mission: Mission) -> str:
        """The command that simulates a mission of the sample again."""
        return simulate_command(
            self.scenario_name,
            self.settings | mission.values,
            self.space(mission),
            mission.policy,
            self.seed,
            mission.replication,
        )

    def space(self, mission: Mission) -> ScenarioSpace:
        """The scenario of a mission of the sample.

        Raises:
            InputError: If it is none.
        """
        try:
            return ScenarioSpace.of(**self.scenario | mission.values)
        except ValidationError as error:
            raise InputError(validation_line(error, f"study {self.study}")) from None


@dataclass(frozen=True)
class Verdict:
    """What came of a check.

    Attributes:
        what: Was checked: a study, by its name, or something else that goes with pages.
        compared: How many missions, or files.
        differing: A line for every one that is another than it was.
        notes: In what the code at hand is not the one that made the results.
    """

    what: str
    compared: int
    differing: list[str]
    notes: list[str]


def verify(evidence: Evidence, missions: int, seed: int) -> Verdict:
    """Fly a random part of the sample again, with the SimPy engine, and compare the records.

    Args:
        evidence: Of the study.
        missions: How many, at most.
        seed: Of the choice.

    Raises:
        InputError: If a policy is not there, or a scenario is none.
    """
    notes, differing = _notes(evidence), []
    chosen = _chosen(len(evidence.sample), missions, seed)
    for mission in (evidence.sample[number] for number in chosen):
        team = load_team(mission.policy)
        record = simulate(evidence.space(mission), team, evidence.seed, mission.replication)
        if changed := difference(record, mission.record):
            differing.append(f"{changed}; replay: {evidence.command(mission)}")
    return Verdict(evidence.study, len(chosen), differing, notes)


def verify_logs(store: Store, missions: int, seed: int) -> Verdict:
    """Fly some of the missions again whose event logs are kept, and compare the logs.

    Args:
        store: The results folder.
        missions: How many, at most.
        seed: Of the choice.
    """
    manifest, logged = store.manifest, store.logged
    differing = []
    for cell, replication in (logged[n] for n in _chosen(len(logged), missions, seed)):
        team = load_team(manifest.policies[cell.team].policy)
        space = manifest.scenarios[cell.point]
        log = simulate(space, team, manifest.seed, replication, events=True).events
        held = store.load_log(cell, replication)
        assert log is not None and held is not None
        if not held.to_pandas().equals(pd.DataFrame(log.columns())):
            line = "the event log is another one when flown again"
            differing.append(f"{line}; replay: {manifest.command(cell, replication)}")
    name = f"{manifest.study['name']}, event logs"
    return Verdict(name, min(len(logged), missions), differing, [])


def learned_files(folder: Path = TRAINED) -> dict[str, str]:
    """The files of learned policies and their curves, with the hashes of their bytes."""
    kinds = ("*.safetensors", "*.json", "*.parquet")
    paths = sorted(
        path for kind in kinds for path in (*folder.glob(kind), *folder.glob(f"*/{kind}"))
    )
    return {p.relative_to(folder).as_posix(): sha256(p.read_bytes()).hexdigest() for p in paths}


def _notes(evidence: Evidence) -> list[str]:
    """What is not as it was."""
    notes = []
    if evidence.version != dess.__version__:
        notes.append(f"made by dess {evidence.version}, not {dess.__version__}")
    elif changes := differing(
        evidence.code, code_behind(team.policy for team in evidence.policies)
    ):
        notes.append(f"made by other code of {', '.join(changes)}")
    changed = [t.policy for t in evidence.policies if t.weights != team_of(t.policy).weights]
    if changed:
        notes.append(f"made by other weights of {', '.join(changed)}")
    ours = library_versions()
    others = [name for name in ours if evidence.libraries.get(name) != ours[name]]
    if others:
        notes.append(f"made with other versions of {', '.join(others)}")
    return notes


def _sample(results: Results, sample: int, seed: int) -> list[Mission]:
    """Missions drawn at random, in the order of the study."""
    missions = pd.concat([results.missions, results.checks], ignore_index=True)
    points = results.store.manifest.points
    rows = missions.iloc[_chosen(len(missions), sample, seed)]
    return [
        Mission(
            policy=row["policy"],
            values=points[row["point"]].values,
            replication=row["replication"],
            record=kept(results, row["policy"], row["point"], row["replication"]),
        )
        for row in rows.to_dict("records")
    ]


def _chosen(count: int, most: int, seed: int) -> Sequence[int]:
    numbers = np.random.default_rng(seed).choice(count, min(count, most), replace=False)
    return sorted(numbers.tolist())


def _hash(results: Results) -> int:
    """A number that every record has a part in."""
    tables = (results.missions, results.checks, results.uavs)
    hashes = [pd.util.hash_pandas_object(table, index=False).to_numpy() for table in tables]
    return int(sha256(np.concatenate(hashes).tobytes()).hexdigest()[:16], 16)


def _budget(results: Results) -> str:
    """What part this is of the shipped study of the same name."""
    ours = dict(results.store.manifest.study)
    name = ours["name"]
    if name not in study_names():
        return "as asked"
    whole = load_study(name).model_dump(mode="json")
    parts = []
    if {*ours["policies"]} < {*whole["policies"]}:
        parts.append(f"{len(ours['policies'])} of {len(whole['policies'])} policies")
    elif {*ours["policies"]} != {*whole["policies"]}:
        parts.append("other policies")
    if ours["missions"] != whole["missions"]:
        parts.append(f"{ours['missions']:,} instead of {whole['missions']:,} missions")
    told = ("policies", "missions", "description")
    parts += [f"another {key}" for key in whole if key not in told and ours[key] != whole[key]]
    return ", ".join(parts) or "full"
