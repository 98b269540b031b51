"""The page of the verification refuses results that its checks of logs do not know."""

from pathlib import Path

import pytest

from analysis import run_study
from analysis.verification.measurements import STUDY
from analysis.verification.suite import Suite
from dess import InputError
from tests.analysis.small import small_study


def test_a_study_with_failures_is_refused(tmp_path: Path) -> None:
    study = small_study(tmp_path, set={"failures.node_rate": 0.1})
    run_study(study, tmp_path / STUDY)
    with pytest.raises(InputError, match="verification: its scenario has failures.*; allowed: "):
        Suite.load(tmp_path)
