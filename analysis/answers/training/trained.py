"""Folders of trained policies that come with the curves of their trainings."""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers.training.curves import (
    LEARNED_PRODUCT,
    SHOWN,
    last_phase,
    plot_trainings,
    read_curve,
    settling_position,
    smooth_curves,
)
from dess.analysis.figures import Drawing
from dess.base.commands import command_line
from dess.base.files.reading import paths_in
from dess.policies.learner.config import TrainingConfig, learner_identifier
from dess.policies.learner.description import read_description


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
    trainings = [(path, read_description(path.parent).training) for path in paths]
    return [
        Trained(path.parent.name, config, read_curve(path))
        for path, config in trainings
        if not config.seas
    ]


def curves_by_learner(policies: Iterable[Trained]) -> pd.DataFrame:
    """The curves of trainings, as ``read_curves`` returns them.

    A variant is a learner, the trainings that differ in their seed alone, by its policies' names.
    """
    learners: dict[str, list[Trained]] = {}
    for policy in policies:
        learners.setdefault(learner_identifier(policy.config), []).append(policy)
    return pd.concat(
        policy.curve.assign(
            variant=numbers.join_words([p.name for p in group]), seed=policy.config.seed
        )
        for group in learners.values()
        for policy in group
    )


def shipped_drawings(policies: Iterable[Trained]) -> list[Drawing]:
    """The trainings of policies: their curves in the metrics that are evaluated."""
    curves = curves_by_learner(policies)
    labels = {name: name for name in curves["variant"].unique()}
    return [
        Drawing(plot_trainings(curves, metric, labels), f"{SHOWN[metric]} of the shipped policies")
        for metric in SHOWN
    ]


def course_in_words(policy: Trained, margin: float) -> str:
    """Where a training ends, and since when it has stayed within a margin: a Markdown item."""
    end = policy.curve.iloc[-1]
    averages = last_phase(smooth_curves(curves_by_learner([policy]), LEARNED_PRODUCT), policy.name)[
        policy.config.seed
    ]
    near = policy.curve.iloc[settling_position(averages, margin) - len(averages)]
    return (
        f"- **{policy.name}**: {numbers.format_percent(averages.iloc[-1])} after "
        f"{end['updates']:,} updates ({end['uav_slots'] / 1e6:.1f} million UAV-slots, "
        f"{end['seconds'] / 60:.0f} minutes); within {numbers.format_margin(margin)} of it from "
        f"update {near['updates']:,} on ({near['seconds'] / 60:.0f} minutes)."
    )


def training_commands(policies: Iterable[Trained]) -> list[str]:
    """The commands that train the policies again."""
    return [
        command_line(
            "train", policy.config.name, seed=policy.config.seed, out=f"runs/{policy.name}"
        )
        for policy in policies
    ]
