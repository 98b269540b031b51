"""What goes with results wherever they are shown, so that anybody can check them.

A page cannot carry all missions of a study. It carries what they were made with, and a sample of
them whose records can be compared, bit for bit, with those of the same missions flown again.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pydantic import BaseModel, ConfigDict, ValidationError

import dess
from analysis.manifest import Team, fingerprint, members_of, replay_command
from analysis.replay import difference
from analysis.results import Results
from analysis.study import load_study, study_names
from dess import simulate
from dess.errors import InputError
from dess.record import MISSION_RECORD
from dess.scenario import ScenarioSpace, validation_line
from policies import load_team
from policies.registry import TRAINED

SAMPLE = 32  # missions of a study that a page carries


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Mission(_Part):
    """A mission of a study: who flew it, what its design point sets, and its record."""

    policy: str
    values: dict[str, Any]
    replication: int
    record: dict[str, int | float]


class Evidence(_Part):
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
    code: str
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
    sample: list[Mission]

    @classmethod
    def of(cls, results: Results, sample: int = SAMPLE, seed: int = 0) -> "Evidence":
        """The evidence of results.

        Args:
            results: The results.
            sample: How many missions to draw, those that check a selection among them.
            seed: Of the draw.
        """
        manifest = results.store.manifest
        counts = [n for of_team in manifest.missions for n in of_team]
        return cls(
            study=manifest.study["name"],
            key=manifest.key,
            version=manifest.version,
            code=manifest.code,
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
            sample=_sample(results, sample, seed),
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

    def replay(self, mission: Mission) -> str:
        """The command that simulates a mission of the sample again."""
        return replay_command(
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
            differing.append(f"{changed}; replay: {evidence.replay(mission)}")
    return Verdict(evidence.study, len(chosen), differing, notes)


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
    elif evidence.code != fingerprint("dess"):
        notes.append("made by other code of dess")
    changed = [team.policy for team in evidence.policies if team.members != members_of(team.policy)]
    if changed:
        notes.append(f"made by other code or weights of {', '.join(changed)}")
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
            record={name: row[name] for name in MISSION_RECORD.names or ()},
        )
        for row in rows.to_dict("records")
    ]


def _chosen(count: int, most: int, seed: int) -> Sequence[int]:
    numbers = np.random.default_rng(seed).choice(count, min(count, most), replace=False)
    return sorted(numbers.tolist())


def _budget(results: Results) -> str:
    """What part this is of the shipped study of the same name."""
    manifest = results.store.manifest
    name = manifest.study["name"]
    if name not in study_names():
        return "as asked"
    whole = load_study(name)
    teams, of = len(manifest.policies), len(whole.policies)
    parts = [] if teams == of else [f"{teams} of {of} policies"]
    if manifest.study["missions"] != whole.missions:
        parts.append(f"{manifest.study['missions']:,} of {whole.missions:,} missions")
    data = whole.model_dump(mode="json")
    rules = ("set", "design", "precision", "selection")
    parts += [f"another {rule}" for rule in rules if manifest.study[rule] != data[rule]]
    return ", ".join(parts) or "full"
