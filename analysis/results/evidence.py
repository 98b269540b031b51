"""The evidence in a page: data by which anybody can check the results that the page shows.

A page cannot contain all missions of a study. It contains what they were made with (code,
libraries, seed, scenario, policies), and the records of a random sample of them. Anybody can
simulate the missions of the sample again and compare the records bit for bit (``dess verify``).
"""

from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any, Self

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from analysis.results.provenance import Count, Finite, Key, Origin, Replication
from analysis.results.resimulate import recorded
from analysis.results.tables import Results
from analysis.study.stopping import Text
from dess.files.documents import Document
from dess.files.reading import paths_in, read_bytes
from dess.files.tables import LIMIT
from dess.record import MISSION_RECORD
from policies.registry import TRAINED

SAMPLE = 32  # missions of a study that a page contains


class Mission(Document):
    """A mission of a study: its team, what its design point sets, and its record by field."""

    policy: Text
    values: dict[str, Any]
    replication: Replication
    record: dict[Text, int | Finite | Text]


class Evidence(Origin):
    """What the results of a study were made with, and a sample of their missions.

    Attributes:
        key: The study's key: a hash of all that its records depend on, and of their number.
        points: Number of design points.
        missions: The smallest and the largest number of missions of a policy at a design point.
        sample: The sample of missions with their records.
    """

    key: Key
    points: Count
    missions: tuple[Count, Count]
    sample: list[Mission] = Field(min_length=1)

    @model_validator(mode="after")
    def _sample_is_of_the_study(self) -> Self:
        policies = [team.policy for team in self.policies]
        for mission in self.sample:
            if mission.policy not in policies:
                raise ValueError(f"sample: {mission.policy} is not a policy of the study")
            if missing := [n for n in MISSION_RECORD.names or () if n not in mission.record]:
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
        drawn = chosen(len(missions), sample, _hash(results) if seed is None else seed)
        identities = missions.loc[drawn, ["policy", "point", "replication"]]
        return cls(
            **{name: getattr(manifest, name) for name in Origin.model_fields},
            key=manifest.key,
            points=len(manifest.points),
            missions=(min(counts), max(counts)),
            sample=[
                Mission(
                    policy=policy,
                    values=manifest.points[point].values,
                    replication=replication,
                    record=recorded(results, policy, point, replication),
                )
                for policy, point, replication in identities.itertuples(index=False)
            ],
        )


def learned_files(folder: Path = TRAINED) -> dict[str, str]:
    """The files of learned policies and their curves, with the hashes of their bytes."""
    kinds = (".safetensors", ".json", ".parquet")
    paths = [path for path in paths_in(folder, "**/*") if path.suffix in kinds]
    hashes = (sha256(read_bytes(path, LIMIT)).hexdigest() for path in paths)
    return {p.relative_to(folder).as_posix(): h for p, h in zip(paths, hashes, strict=True)}


def chosen(count: int, most: int, seed: int) -> Sequence[int]:
    """Draw at most ``most`` of the numbers 0..count - 1 at random; the result is sorted."""
    numbers = np.random.default_rng(seed).choice(count, min(count, most), replace=False)
    return sorted(numbers.tolist())


def _hash(results: Results) -> int:
    """A number that depends on every record."""
    tables = (results.missions, results.checks, results.uavs)
    hashes = [pd.util.hash_pandas_object(table, index=False).to_numpy() for table in tables]
    return int(sha256(np.concatenate(hashes).tobytes()).hexdigest()[:16], 16)
