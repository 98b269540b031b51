"""The faults that ``benchmarks/faults.py`` plants can still be planted."""

import ast

import pandas as pd
import pytest

from benchmarks.faults import FAULTS, ORACLES, ROOT


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_changes_the_code(fault):
    source = (ROOT / fault.file).read_text("utf-8")
    assert ast.dump(ast.parse(fault.change(source))) != ast.dump(ast.parse(source))


def test_what_was_found_is_of_faults_that_are_planted():
    found = pd.read_csv(ROOT / "benchmarks/faults.csv")
    files = {fault.name: fault.file for fault in FAULTS}
    assert dict(zip(found["fault"], found["file"], strict=True)).items() <= files.items()
    assert {*found} <= {"fault", "file", *ORACLES}
