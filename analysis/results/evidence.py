"""The evidence that a page gives for a study: what it was made with, and a sample of missions."""

from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any, Self

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from dess.analysis.metrics import HOME, NODE_AGES, NODE_RATIOS, without_nodes
from dess.analysis.results.provenance import Origin
from dess.analysis.results.resimulate import stored_record
from dess.analysis.results.tables import Results
from dess.analysis.study.stopping import Text
from dess.base.files.documents import Document
from dess.base.files.reading import hash_file, paths_in
from dess.base.files.tables import LIMIT
from dess.model.record import MISSION_RECORD
from dess.policies.registry import TRAINED

SAMPLE = 32  # missions of a study that a page contains


class SampleMission(Document):
    """A mission of a study: its team, what its design point sets, and its record by field."""

    policy: Text
    values: dict[str, Any]
    replication: int
    record: dict[Text, int | float | Text]


class Evidence(Origin):
    """What the results of a study were made with, and a sample of their missions.

    Attributes:
        key: The study's key: a hash of all that its records depend on, and of their number.
        points: Number of design points.
        missions: The smallest and the largest number of missions of a policy at a design point.
        sample: The sample of missions with their records.
    """

    key: Text
    points: int
    missions: tuple[int, int]
    sample: list[SampleMission] = Field(min_length=1)

    @model_validator(mode="after")
    def _sample_is_of_the_study(self) -> Self:
        policies = [team.policy for team in self.policies]
        for mission in self.sample:
            if mission.policy not in policies:
                raise ValueError(f"sample: {mission.policy} is not a policy of the study")
            names = [name for name in MISSION_RECORD.names or () if name != HOME]
            if missing := [name for name in names if name not in mission.record]:
                raise ValueError(f"sample: a record has no {missing[0]}")
        return self

    @classmethod
    def of(cls, results: Results, sample: int = SAMPLE, seed: int | None = None) -> Self:
        """The evidence of results.

        Args:
            results: The results.
            sample: How many missions to draw. Missions that check a selection may be among them.
            seed: Seed of the draw. By default a hash of all records, so that a changed record
                leads to another sample.
        """
        manifest = results.store.manifest
        counts = [n for of_team in manifest.missions for n in of_team]
        missions = pd.concat([results.missions, results.checks], ignore_index=True)
        drawn = draw_numbers(
            len(missions), sample, _hash_of_records(results) if seed is None else seed
        )
        identities = missions.loc[drawn, ["policy", "point", "replication"]]
        return cls(
            **{name: getattr(manifest, name) for name in Origin.model_fields},
            key=manifest.key,
            points=len(manifest.points),
            missions=(min(counts), max(counts)),
            sample=[
                SampleMission(
                    policy=policy,
                    values=manifest.points[point].values,
                    replication=replication,
                    record=stored_record(results, policy, point, replication),
                )
                for policy, point, replication in identities.itertuples(index=False)
            ],
        )


def learned_files(folder: Path = TRAINED) -> dict[str, str]:
    """The files of learned policies and their curves, with the hashes of their bytes."""
    kinds = (".safetensors", ".json", ".parquet")
    paths = [path for path in paths_in(folder, "**/*") if path.suffix in kinds]
    hashes = (hash_file(path, LIMIT) for path in paths)
    return {p.relative_to(folder).as_posix(): h for p, h in zip(paths, hashes, strict=True)}


def draw_numbers(count: int, most: int, seed: int) -> Sequence[int]:
    """Draw at most ``most`` of the numbers 0..count - 1 at random; the result is sorted."""
    numbers = np.random.default_rng(seed).choice(count, min(count, most), replace=False)
    return sorted(numbers.tolist())


def _hash_of_records(results: Results) -> int:
    """A number that depends on every record."""
    tables = (results.missions, results.checks, results.uavs)
    hashes = [
        pd.util.hash_pandas_object(without_nodes(table), index=False).to_numpy() for table in tables
    ]
    hashes += [
        np.concatenate(table[name].to_numpy()).view(np.uint64)
        for table in tables
        for name in (NODE_RATIOS, NODE_AGES)
        if name in table and len(table)
    ]
    return int(sha256(np.concatenate(hashes).tobytes()).hexdigest()[:16], 16)
