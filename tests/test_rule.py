"""The rule that ``docs/how-to/rule.md`` adds: its lines fit the code, and it does what it says.

The changes of the page are made in a copy of the code.
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "how-to" / "rule.md").read_text("utf-8")
BLOCKS = re.findall(r'^```(\w+) title="(.+?)"\n(.*?)^```', PAGE, re.M | re.S)
COPIED = ("dess", "tests/__init__.py", "tests/test_sections.py", "tests/dess/model/auditor")
SETTINGS = re.findall(r"Scenario\.of\((.*?)\)  # fmt", PAGE, re.S)[0]

# The slots of the case by hand, without an engine: the rules are called in plain Python.
SLOTS = f"""
import numpy as np
from dess.model import rules
from dess.model.state import HOVER, constants_of, types_of
from dess.scenario.scenario import ScenarioSpace

space = ScenarioSpace.of({SETTINGS})
mission = constants_of(space).view(np.recarray)[0]
uavs = types_of(space).view(np.recarray)
mission.active = mission.uavs
for uav in uavs:
    uav.active = uav.latch = True
    uav.battery, uav.zone = 60, 0
while mission.active:
    rules.grant_pads(mission, uavs)
    on_pad = uavs.charging.nonzero()[0].tolist()
    rules.spend(mission, uavs)
    rules.settle(mission, uavs)
    print(*on_pad, *uavs.battery.tolist())
"""
# The UAV on the pad in each slot, if any, and the batteries of both after the slot.
BY_HAND = """\
0 70 59
0 80 58
0 90 57
0 90 56
0 90 55
1 89 65
1 88 75
1 87 85
1 86 90
1 85 90
1 84 90
83 89
"""
# The row of the page holds, and the section is not overlooked where the row is missing.
TABLE = """
from tests import test_sections as table

table.test_every_section_of_a_scenario_is_listed()
for part in table.PARTS:
    table.test_a_section_is_treated_as_its_row_says("turnaround", part)
del table.SECTIONS["turnaround"]
try:
    table.test_every_section_of_a_scenario_is_listed()
except AssertionError:
    print("found")
"""


def apply(change: str, source: str) -> str:
    """A source text after a change, whose old lines must stand in it exactly once."""
    for hunk in change.split("@@\n"):
        lines = hunk.splitlines(keepends=True)
        old = "".join(line[1:] for line in lines if line[0] in " -")
        new = "".join(line[1:] for line in lines if line[0] in " +")
        assert source.count(old) == 1, f"the page has lines that the code has not:\n{old}"
        source = source.replace(old, new)
    return source


@pytest.fixture
def copy(tmp_path):
    """A copy of the code with the changes of the page."""
    without = shutil.ignore_patterns("__pycache__", "trained")
    for name in COPIED:
        target = tmp_path / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, target, ignore=without)
        else:
            shutil.copy(ROOT / name, target)
    for language, title, text in BLOCKS:
        target = tmp_path / title
        if language == "diff":
            text = apply(text, target.read_text("utf-8"))
        target.write_text(text, encoding="utf-8")
    return tmp_path


def run(copy: Path, *arguments: str) -> "subprocess.CompletedProcess[str]":
    """Run Python in the copy."""
    return subprocess.run([sys.executable, *arguments], cwd=copy, capture_output=True, text=True)


def test_the_case_worked_by_hand_is_what_the_rules_do(copy):
    done = run(copy, "-c", SLOTS)
    assert done.stdout == BY_HAND, done.stderr


def test_a_section_without_a_row_in_the_table_of_sections_is_found(copy):
    done = run(copy, "-c", TABLE)
    assert done.stdout == "found\n", done.stderr


@pytest.mark.slow
def test_both_engines_and_the_auditor_agree_on_the_case(copy):
    """About half a minute: the copy is compiled."""
    name = "test_a_charged_uav_keeps_its_pad_for_its_turnaround"
    done = run(copy, "-c", f"from tests.dess.model.test_turnaround import {name}; {name}()")
    assert done.returncode == 0, done.stderr
