"""The README and the docs say what their commands print, from an installed wheel in an empty home.

A file has its name as the title of its block. The output of a command stands in a ``text`` block
directly below it, where ``...`` is anything. All commands of the tutorial but the installation run,
and of other pages those with an output. With ``DESS_WRITE_PINS=1`` the pages quote anew what is
printed: read the difference before it is committed.
"""

import doctest
import os
import re
import subprocess
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.installed import environment

ROOT = Path(__file__).parents[1]
TUTORIAL = "docs/tutorial.md"
LIMIT = 600  # seconds of a command
SAME = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
BLOCK = r'^```(\w+)(?: title="(.+?)")?\n(.*?)^```\n(?:\n^```text\n(.*?)^```$)?'

pytestmark = pytest.mark.slow


class Step(NamedTuple):
    """A fenced block: its language, the name of its file, its text, and the output below it."""

    language: str
    title: str
    text: str
    output: str

    @property
    def prints(self) -> bool:
        """Whether it is a command with an output."""
        return self.language == "sh" and bool(self.output)


def steps_of(path: Path) -> list[Step]:
    """The blocks of a page, each with its output."""
    return [Step(*found) for found in re.findall(BLOCK, path.read_text("utf-8"), re.M | re.S)]


STEPS = {
    path.relative_to(ROOT).as_posix(): steps_of(path)
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
}


def output_of(step: Step, place: Path, variables: dict[str, str]) -> str:
    """What the commands of a step print in a folder."""
    done = subprocess.run(
        ["bash", "-e", "-c", step.text],
        cwd=place,
        env=variables,
        capture_output=True,
        text=True,
        timeout=LIMIT,
    )
    assert done.returncode == 0, f"{step.text}{done.stdout}{done.stderr}"
    return done.stdout


def test_the_tutorial_begins_with_an_installation_of_everything():
    assert re.search(r"pip install .*\.\[all\]", STEPS[TUTORIAL][0].text)


@pytest.mark.parametrize("page", [p for p, steps in STEPS.items() if any(s.prints for s in steps)])
def test_commands_print_what_the_page_says(page, installed, tmp_path):
    home, place = tmp_path / "home", tmp_path / "place"
    home.mkdir(), place.mkdir()
    path = os.pathsep.join([str(installed.parent), os.environ["PATH"]])
    variables, wrong = environment(home) | {"PATH": path}, []
    for step in STEPS[page][page == TUTORIAL :]:
        if step.title:
            (place / step.title).write_text(step.text, encoding="utf-8")
        elif step.prints or (page == TUTORIAL and step.language == "sh"):
            output = output_of(step, place, variables)
            if not is_same(step.output, output):
                wrong.append(f"{step.text}{output}")
                if os.environ.get("DESS_WRITE_PINS"):
                    quote_anew(ROOT / page, step, output)
            if output.lstrip().startswith("runs/sea  "):
                check_training(output)
    assert not wrong, "\n".join(wrong)


def is_same(said: str, printed: str) -> bool:
    """Whether a text is what is printed, where ``...`` is anything."""
    return doctest.OutputChecker().check_output(said, printed, SAME)


def quote_anew(path: Path, step: Step, output: str) -> None:
    """Put what is printed now into a page; lines that still hold stay, with what they leave open.

    A line that is ``...`` alone is lost: it may stand for any number of lines.
    """
    said = [line for line in step.output.splitlines() if line.strip() != "..."]
    printed = [
        next((old for old in said if is_same(old, line)), line) for line in output.splitlines()
    ]
    text = path.read_text("utf-8")
    assert text.count(step.output) == 1, f"{path}: the same output stands there twice"
    quoted = "".join(f"{line.rstrip()}\n" for line in printed)
    path.write_text(text.replace(step.output, quoted), "utf-8")


def check_training(output: str) -> None:
    """The policy that the tutorial trains is better than greedy: their intervals are apart."""
    product = r"collection_ratio_and_communication +(\S+) +(\S+) +(\S+)"
    (_, low, _), (_, _, high) = re.findall(product, output)
    assert float(low) > float(high)
