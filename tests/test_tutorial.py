"""The tutorial: its commands run from an installed wheel in an empty home, and print what it says.

Files have their name as the title of their block. The output of a command stands in the ``text``
block after it, where ``...`` is anything.
"""

import doctest
import os
import re
import subprocess
import time
from pathlib import Path

import pytest

from tests.installed import environment

ROOT = Path(__file__).parents[1]
TUTORIAL = (ROOT / "docs/tutorial.md").read_text("utf-8")
LIMIT = 600  # seconds
SAME = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE

pytestmark = pytest.mark.slow

# Language, title and text of each block. The fixture `installed` stands for the first one.
BLOCKS = re.findall(r'^```(\w+)(?: title="(.+?)")?\n(.*?)^```$', TUTORIAL, re.M | re.S)
INSTALLATION, *STEPS = BLOCKS
PRINTED = [
    number for number, (language, _, _) in enumerate(STEPS[1:], start=1) if language == "text"
]


@pytest.fixture(scope="module")
def printed(installed: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[int, str]:
    """What the commands of the tutorial print, by the number of their block."""
    home, place = tmp_path_factory.mktemp("home"), tmp_path_factory.mktemp("tutorial")
    path = os.pathsep.join([str(installed.parent), os.environ["PATH"]])
    variables = environment(home) | {"PATH": path}
    outputs, begin = {}, time.monotonic()
    for number, (language, title, text) in enumerate(STEPS):
        if title:
            (place / title).write_text(text, encoding="utf-8")
        elif language == "sh":
            left = LIMIT - (time.monotonic() - begin)
            command = ["bash", "-e", "-c", text]
            done = subprocess.run(
                command, cwd=place, env=variables, capture_output=True, text=True, timeout=left
            )
            assert done.returncode == 0, f"{text}{done.stdout}{done.stderr}"
            outputs[number] = done.stdout
    return outputs


def test_the_tutorial_begins_with_an_installation_of_everything() -> None:
    assert re.search(r"pip install .*\.\[all\]", INSTALLATION[2])


def test_every_command_that_prints_has_its_output_in_the_tutorial(printed: dict[int, str]) -> None:
    assert {number + 1 for number, output in printed.items() if output.strip()} == {*PRINTED}


@pytest.mark.parametrize("number", PRINTED)
def test_commands_print_what_the_tutorial_says(printed: dict[int, str], number: int) -> None:
    want, got = STEPS[number][2], printed[number - 1]
    assert doctest.OutputChecker().check_output(want, got, SAME), f"{STEPS[number - 1][2]}\n{got}"


def test_the_policy_that_the_tutorial_trains_is_better_than_greedy(printed: dict[int, str]) -> None:
    product = r"collection_ratio_and_communication +(\S+) +(\S+) +(\S+)"
    (output,) = (text for text in printed.values() if text.lstrip().startswith("runs/sea  "))
    (_, low, _), (_, _, high) = re.findall(product, output)
    assert float(low) > float(high)
