"""The trained policies in a folder: how each was trained, and where more training stops paying.

policies = trained_policies(Path("policies/trained"))
several_trainings(policies)  # {"ddqn": ["ddqn", "ddqn-2", "ddqn-3"]}
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

    Raises:
        InputError: If a policy or a curve is damaged.
    """
    return [
        Trained(path.parent.name, read_description(path.parent).training, read_curve(path))
        for path in paths_in(folder, "*/training.parquet")
    ]


def several_trainings(policies: Iterable[Trained]) -> list[list[Trained]]:
    """The policies of each learner of several trainings, which differ in their seed alone."""
    learners: dict[str, list[Trained]] = {}
    for policy in policies:
        learners.setdefault(learner_of(policy.config), []).append(policy)
    return [trainings for trainings in learners.values() if len(trainings) > 1]


def curves_of(trainings: Iterable[Trained], variant: str) -> pd.DataFrame:
    """The curves of trainings as those of one variant, as in ``learning.curves``."""
    return pd.concat(t.curve.assign(variant=variant, seed=t.config.seed) for t in trainings)


def course_in_words(policy: Trained, margin: float) -> str:
    """Where a training ends, and since when it has stayed within a margin: a Markdown item."""
    end = policy.curve.iloc[-1]
    averages = last_phase(smoothed(curves_of([policy], ""), PRODUCT), "")[policy.config.seed]
    near = policy.curve.iloc[settled(averages, margin) - len(averages)]
    return (
        f"- **{policy.name}**: {numbers.percent(averages.iloc[-1])} after {end['updates']:,} "
        f"updates ({end['uav_slots'] / 1e6:.1f} million UAV-slots, {end['seconds'] / 60:.0f} "
        f"minutes); within {numbers.margin(margin)} of it from update {near['updates']:,} on "
        f"({near['seconds'] / 60:.0f} minutes)."
    )


def settings_table(policies: Iterable[Trained]) -> pd.DataFrame:
    """How policies were trained, a row each."""
    return pd.DataFrame(
        {
            "Policy": policy.name,
            "Observation": policy.config.observation,
            "Phases": ", ".join(f"{p.name} ({p.ticks:,} ticks)" for p in policy.config.phases),
            "Seed": policy.config.seed,
            "Discount": f"{policy.config.discount:g}",
            "Steps of return": policy.config.n_step,
        }
        for policy in policies
    )


def commands(policies: Iterable[Trained]) -> list[str]:
    """The commands that train the policies again."""
    return [
        f"dess train {policy.config.name} --seed {policy.config.seed} --out runs/{policy.name}"
        for policy in policies
    ]
