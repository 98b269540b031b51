"""The integers of a shipped policy are those that the command for them makes."""

import shutil

import pytest

from dess.policies.learner import calibration
from dess.policies.learner.trained import INTEGERS
from dess.policies.registry import TRAINED


@pytest.mark.slow
def test_the_shipped_integers_of_generalist_are_what_their_command_writes(tmp_path):
    shipped = TRAINED / "generalist"
    folder = tmp_path / "generalist"
    shutil.copytree(shipped, folder, ignore=shutil.ignore_patterns(INTEGERS))
    calibration.main(folder)
    assert (folder / INTEGERS).read_bytes() == (shipped / INTEGERS).read_bytes()
