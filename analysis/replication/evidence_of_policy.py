"""The evidence for judging the paper's claims: results of one policy in one study, and trainings.

If results lack something, ``MissingError`` is raised, and the claim has no results.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pandas as pd

from analysis.questions import main_effects, summary
from analysis.questions.learning import curves as learning
from analysis.replication.paper import CROSSING
from analysis.results.tables import Results


class MissingError(Exception):
    """Results that a claim needs are missing."""


class Pairs(NamedTuple):
    """The values of a parameter, compared with each other.

    Attributes:
        changes: The result of ``main_effects.changes``.
        positions: The position of every value, by its text.
    """

    changes: pd.DataFrame
    positions: Mapping[str, int]

    def position(self, value: str) -> int:
        """The position of a value."""
        if value not in self.positions:
            raise MissingError(f"the study lacks the value {value}")
        return self.positions[value]

    def leads(self, *values: str) -> pd.DataFrame:
        """How much higher the metric is at these values than at every other value (``other``)."""
        chosen = [self.position(value) for value in values]
        first, second = (self.changes[end].isin(chosen) for end in ("first", "second"))
        up, down = self.changes[second & ~first], self.changes[first & ~second]
        down = negated(down).assign(other=down["second"])
        return pd.concat([up.assign(other=up["first"]), down])

    def change(self, first: str, second: str) -> pd.Series:
        """How much the metric changes from one value to another."""
        return self.leads(second).set_index("other").loc[self.position(first)]


def negated(changes: pd.DataFrame) -> pd.DataFrame:
    """The differences with the opposite sign."""
    turned = {"difference": "difference", "low": "high", "high": "low"}
    turned |= {"wide_low": "wide_high", "wide_high": "wide_low"}
    return changes.assign(**{end: -changes[other] for end, other in turned.items()})


@dataclass(frozen=True, eq=False)
class EvidenceOfPolicy:
    """The results of one policy in one study."""

    results: Results
    policy: str

    @property
    def study(self) -> str:
        """The name of the study."""
        return str(self.results.manifest["study"]["name"])

    @cached_property
    def effects(self) -> pd.DataFrame:
        """The result of ``main_effects.effects``."""
        return main_effects.effects(self.results)

    def missions(self, uavs: int | None = None) -> pd.DataFrame:
        """The missions of the policy, or only those with a number of UAVs.

        For a study that selects a setting, these are the missions that check it, which were not
        used for the selection.
        """
        selects = self.results.manifest["study"]["selection"] is not None
        missions = self.results.checks if selects else self.results.missions
        chosen = missions["policy"] == self.policy
        if uavs is not None:
            chosen &= missions["uavs"] == uavs
        if not chosen.any():
            raise MissingError(f"the study {self.study} has no such mission")
        return missions[chosen]

    def pairs(self, field: str, metric: str, fewest_uavs: int = 1) -> Pairs:
        """The values of a parameter, compared mission by mission."""
        values = self.effects[self.effects["field"] == field].drop_duplicates("position")
        if len(values) < 2:
            raise MissingError(f"the study {self.study} does not vary {field}")
        changes = main_effects.changes(
            self.results, self.effects, self.policy, field, metric, fewest_uavs
        )
        return Pairs(changes, dict(zip(values["value"], values["position"], strict=True)))

    def logs(self, uavs: int) -> list[tuple[pd.DataFrame, np.ndarray]]:
        """The stored event logs of missions with a number of UAVs, each with the (K, 2) nodes."""
        missions, logged = self.missions(uavs), self.results.manifest["study"]["logged"]
        missions = missions[missions["replication"] < logged]
        if missions.empty:
            raise MissingError(f"the study {self.study} stores no event logs")
        return [
            (
                self.results.events(self.policy, point, replication),
                np.array(self.results.scenario(point).nodes),
            )
            for point, replication in missions[["point", "replication"]].itertuples(index=False)
        ]


def evidence_of_policy(
    studies: Mapping[str, Results], study: str, learner: str = "", policy: str = ""
) -> EvidenceOfPolicy:
    """The results of one policy of a study, by default of its best learned policy.

    Args:
        studies: Results by the name of the study.
        study: The study.
        learner: A learner, to take its best policy.
        policy: A policy, to take this one.
    """
    if study not in studies:
        raise MissingError(f"the study {study} has not been run")
    if policy:
        if policy not in studies[study].policies:
            raise MissingError(f"the study {study} has no policy {policy}")
        return EvidenceOfPolicy(studies[study], policy)
    learners = summary.learners(studies[study])
    wanted = [learner] if learner else [*learners]
    among = [trained for name in wanted for trained in learners.get(name, [])]
    if not among:
        which = f"policy {learner}" if learner else "learned policy"
        raise MissingError(f"the study {study} has no {which}")
    return EvidenceOfPolicy(studies[study], summary.best_policy(studies[study].missions, among))


class EvidenceOfTrainings(NamedTuple):
    """Learning curves, and the names of the variants with and without transfer learning."""

    trainings: pd.DataFrame
    using: str
    without: str

    def curves(self, metric: str) -> pd.DataFrame:
        """Smoothed curves of a metric."""
        return learning.smoothed(self.trainings, metric)

    def transfer(self, metric: str) -> learning.Transfer:
        """The trainings with transfer learning, compared with those without."""
        curves = self.curves(metric)
        return learning.transfer(curves, self.using, self.without, shortest=CROSSING)


def evidence_of_trainings(
    trainings: pd.DataFrame, variants: tuple[str, str] | None
) -> EvidenceOfTrainings:
    """The trainings of two variants, with transfer learning and without."""
    if variants is None:
        raise MissingError("no trainings of this policy with and without transfer learning")
    if trainings.empty or not {*variants} <= {*trainings["variant"]}:
        raise MissingError(f"no trainings {' and '.join(variants)}")
    return EvidenceOfTrainings(trainings, *variants)
