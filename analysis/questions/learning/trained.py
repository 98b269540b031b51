"""The trained policies in a folder: how each was trained, and where more training stops paying.

policies = trained_policies(Path("policies/trained"))
curves_by_learner(policies)["variant"].unique()  # "ddqn, ddqn-2 and ddqn-3" and "ddqn-paper"
"""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from analysis import numbers
from analysis.questions.learning.curves import PRODUCT, last_phase, settled, smoothed
from analysis.questions.learning.files import read_curve
from dess.files.reading import paths_in
from policies.ddqn.config import TrainingConfig, learner_of
from policies.ddqn.description import read_description


class Trained(NamedTuple):
    """A trained policy.

    Attributes:
        name: The policy.
        config: Its training.
        curve: A row per evaluation while training.
    """

    name: str
    config: TrainingConfig
    curve: pd.DataFrame


def trained_policies(folder: Path) -> list[Trained]:
    """The trained policies in a folder that come with the curve of their training, by name.

    Curves on many seas are left out: they do not compare with those on one.

    Raises:
        InputError: If a policy or a curve is damaged.
    """
    paths = paths_in(folder, "*/training.parquet")
    found = [(path, read_description(path.parent).training) for path in paths]
    return [
        Trained(path.parent.name, config, read_curve(path))
        for path, config in found
        if not config.seas
    ]


def curves_by_learner(policies: Iterable[Trained]) -> pd.DataFrame:
    """The curves of trainings, as in ``learning.curves``.

    A variant is a learner, the trainings that differ in their seed alone, by its policies' names.
    """
    learners: dict[str, list[Trained]] = {}
    for policy in policies:
        learners.setdefault(learner_of(policy.config), []).append(policy)
    return pd.concat(
        policy.curve.assign(variant=numbers.words([p.name for p in group]), seed=policy.config.seed)
        for group in learners.values()
        for policy in group
    )


def course_in_words(policy: Trained, margin: float) -> str:
    """Where a training ends, and since when it has stayed within a margin: a Markdown item."""
    end = policy.curve.iloc[-1]
    averages = last_phase(smoothed(curves_by_learner([policy]), PRODUCT), policy.name)[
        policy.config.seed
    ]
    near = policy.curve.iloc[settled(averages, margin) - len(averages)]
    return (
        f"- **{policy.name}**: {numbers.percent(averages.iloc[-1])} after {end['updates']:,} "
        f"updates ({end['uav_slots'] / 1e6:.1f} million UAV-slots, {end['seconds'] / 60:.0f} "
        f"minutes); within {numbers.margin(margin)} of it from update {near['updates']:,} on "
        f"({near['seconds'] / 60:.0f} minutes)."
    )


def commands(policies: Iterable[Trained]) -> list[str]:
    """The commands that train the policies again."""
    return [
        f"dess train {policy.config.name} --seed {policy.config.seed} --out runs/{policy.name}"
        for policy in policies
    ]
