"""What goes with results wherever they are shown, so that anybody can check them.

A page cannot carry all missions of a study. It carries what they were made with, and a sample of
them, whose records can be compared, bit for bit, with those of the same missions simulated again.
"""

import json
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any, Self

import numpy as np
import pandas as pd
from pydantic import Field, ValidationError, field_validator, model_validator

from analysis.results.documents import Document
from analysis.results.manifest import simulate_command
from analysis.results.provenance import Origin
from analysis.results.resimulate import recorded
from analysis.results.tables import Results
from analysis.study.study import load_study, study_names
from dess import InputError
from dess.record import MISSION_RECORD
from dess.scenario import ScenarioSpace, validation_line
from policies.registry import TRAINED

SAMPLE = 32  # missions of a study that a page carries


class Mission(Document):
    """A mission of a study: its team, what its design point sets, and its record.

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


class Evidence(Origin):
    """What the results of a study were made with, and some of their missions.

    Attributes:
        key: Of the study: a hash of all that its records depend on, and of how many there are.
        missions: The least and the most of a policy at a design point.
        points: Number of design points.
        budget: How it lies to the shipped study of its name, in words.
    """

    study: str
    key: str
    engine: str
    scenario_name: str
    settings: dict[str, Any]
    points: int
    missions: tuple[int, int]
    budget: str
    sample: list[Mission] = Field(min_length=1)

    @model_validator(mode="after")
    def _sample_is_of_the_study(self) -> Self:
        unknown = {mission.policy for mission in self.sample} - {t.policy for t in self.policies}
        if unknown:
            raise ValueError(f"sample: {min(unknown)} is no policy of the study")
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
            **{name: getattr(manifest, name) for name in Origin.model_fields},
            study=manifest.study["name"],
            key=manifest.key,
            engine=manifest.study["engine"],
            scenario_name=manifest.study["scenario"],
            settings=manifest.study["set"],
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
        return json.dumps(self.data)

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


def learned_files(folder: Path = TRAINED) -> dict[str, str]:
    """The files of learned policies and their curves, with the hashes of their bytes."""
    kinds = ("*.safetensors", "*.json", "*.parquet")
    paths = sorted(
        path for kind in kinds for path in (*folder.glob(kind), *folder.glob(f"*/{kind}"))
    )
    return {p.relative_to(folder).as_posix(): sha256(p.read_bytes()).hexdigest() for p in paths}


def _sample(results: Results, sample: int, seed: int) -> list[Mission]:
    """Missions drawn at random, in the order of the study."""
    missions = pd.concat([results.missions, results.checks], ignore_index=True)
    points = results.store.manifest.points
    rows = missions.iloc[chosen(len(missions), sample, seed)]
    return [
        Mission(
            policy=row["policy"],
            values=points[row["point"]].values,
            replication=row["replication"],
            record=recorded(results, row["policy"], row["point"], row["replication"]),
        )
        for row in rows.to_dict("records")
    ]


def chosen(count: int, most: int, seed: int) -> Sequence[int]:
    """Some of the numbers 0..count - 1, ``most`` or all of them, drawn at random, in order."""
    numbers = np.random.default_rng(seed).choice(count, min(count, most), replace=False)
    return sorted(numbers.tolist())


def _hash(results: Results) -> int:
    """A number that every record has a part in."""
    tables = (results.missions, results.checks, results.uavs)
    hashes = [pd.util.hash_pandas_object(table, index=False).to_numpy() for table in tables]
    return int(sha256(np.concatenate(hashes).tobytes()).hexdigest()[:16], 16)


def _budget(results: Results) -> str:
    """The share of the shipped study of the same name, in words."""
    run = results.store.manifest.study
    if run["name"] not in study_names():
        return "as asked"
    shipped = load_study(run["name"]).model_dump(mode="json")
    differences = []
    if {*run["policies"]} < {*shipped["policies"]}:
        count, of = len(run["policies"]), len(shipped["policies"])
        differences.append(f"{count} of {of} policies")
    elif {*run["policies"]} != {*shipped["policies"]}:
        differences.append("other policies")
    if run["missions"] != shipped["missions"]:
        differences.append(f"{run['missions']:,} instead of {shipped['missions']:,} missions")
    others = shipped.keys() - {"policies", "missions", "description"}
    differences += [f"another {k}" for k in shipped if k in others and run[k] != shipped[k]]
    return ", ".join(differences) or "full"
