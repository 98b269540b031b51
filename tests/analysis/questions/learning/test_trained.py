"""Trained policies in a folder: learners, courses of their trainings, settings and commands."""

import json
from pathlib import Path

import pandas as pd
import pytest

from analysis.questions.learning import trained
from analysis.questions.learning.files import CURVE
from policies.registry import TRAINED
from tests.policies.ddqn.tiny import tiny, tiny_on_seas

SHIPPED = json.loads((TRAINED / "ddqn" / "config.json").read_text("utf-8"))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two trainings of one learner, one of another, one on many seas, and one without a curve."""
    for name, config in {
        "one": tiny(seed=1),
        "two": tiny(seed=2),
        "other": tiny(seed=1, discount=0.9),
        "seas": tiny_on_seas(),
        "bare": tiny(),
    }.items():
        (tmp_path / name).mkdir()
        training = config.model_dump(mode="json")
        description = json.dumps(SHIPPED | {"training": training})
        (tmp_path / name / "config.json").write_text(description, "utf-8")
        if name == "bare":
            continue
        product = [0.0, 0.8, 0.5, 0.5]
        curve = {
            "phase": "battery",
            "updates": [250, 500, 750, 1000],
            "seconds": [60, 120, 180, 240],
        }
        curve |= {"uav_slots": [1e6, 2e6, 3e6, 4e6], trained.PRODUCT: product, "is_best": True}
        same = dict.fromkeys({*CURVE.names} - curve.keys(), 1)
        pd.DataFrame(curve | same).to_parquet(tmp_path / name / "training.parquet")
    return tmp_path


def test_trainings_that_differ_in_their_seed_are_of_one_learner(folder: Path) -> None:
    policies = trained.trained_policies(folder)
    assert [policy.name for policy in policies] == ["one", "other", "two"]
    sizes = trained.curves_by_learner(policies).groupby(["variant", "seed"]).size()
    assert sizes.to_dict() == {("one and two", 1): 4, ("one and two", 2): 4, ("other", 1): 4}


def test_the_course_of_a_training(folder: Path) -> None:
    first = trained.trained_policies(folder)[0]
    # averages 0, 0.4, 0.45 and 0.475: within 0.05 from the third evaluation on
    assert trained.course_in_words(first, 0.05) == (
        "- **one**: 47.5 % after 1,000 updates (4.0 million UAV-slots, 4 minutes); within 5 points "
        "of it from update 750 on (3 minutes)."
    )


def test_every_training_has_its_command(folder: Path) -> None:
    policies = trained.trained_policies(folder)
    assert trained.commands(policies)[-1] == "dess train tiny --seed 2 --out runs/two"
