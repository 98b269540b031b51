"""The faults that ``benchmarks/faults.py`` plants can still be planted."""

import ast

import pytest

from benchmarks.faults import FAULTS, ROOT


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_changes_the_code(fault):
    source = (ROOT / fault.file).read_text("utf-8")
    assert ast.dump(ast.parse(fault.change(source))) != ast.dump(ast.parse(source))
