"""What scripts of pages write (numbers, commands, CSV) is what Python writes."""

import csv
import io
import shlex

import numpy as np
import pandas as pd
import pytest

from dess.analysis import numbers
from dess.base.commands import command_line
from dess.reports.pages.templates import load_template

# Of two numbers that are equally near, the even one; what a decimal ends before a tie; small ones.
TIES = [0.25, 0.75, 0.15, 0.45, 84.25, 12.35, 1000.5, 1001.5, 100.25, 999.96, 0.0, -0.04, -2.5]
SMALL = [1e-13, 5e-5, 0.00012345, -1.5e-7, 0.09995]
TEXTS = ["", "a b", "it's", 'say "no"', "a,b", "two\nlines", "é", "$x"]
TEXTS += ["=1+1", "-2", "+3", "@x", "\tx"]


@pytest.fixture
def script(chromium):
    """A tab with the functions of the templates of numbers and commands."""
    tab = chromium.new_page()
    for name in ("panel_numbers.js", "panel_commands.js"):
        tab.add_script_tag(content=load_template(name).render())
    yield tab
    tab.close()


def test_numbers_are_those_of_python(script):
    """A script has its digits from Python; a number is rounded, not its decimals."""
    rng = np.random.default_rng(1)
    drawn = rng.normal(size=3000) * 10.0 ** rng.integers(-6, 7, 3000)
    values = [*TIES, *SMALL, *np.round(drawn[:1500] * 8) / 8, *drawn]
    assert script.evaluate("values => values.map(quantity)", values) == [
        numbers.format_quantity(value) for value in values
    ]
    shares = [value / 100 for value in values]
    written = "shares => shares.map((share) => written({percent: true}, share))"
    assert script.evaluate(written, shares) == [numbers.format_percent(share) for share in shares]


def test_commands_are_quoted_as_in_python(script):
    options = {"set": [f"name={text}" for text in TEXTS], "policy": "a,b", "seed": 3}
    command = script.evaluate("options => commandLine('sweep', options)", options)
    assert command == command_line("sweep", **options)
    assert shlex.split(command)[3::2][: len(TEXTS)] == options["set"]


def test_tables_are_those_of_python(script):
    """No cell of text is a formula of a spreadsheet; numbers stay numbers."""
    frame = pd.DataFrame({"text": TEXTS, "number": np.linspace(-1.1, 1.3, len(TEXTS))})
    rows = [[*frame], *frame.values.tolist()]
    written = script.evaluate("rows => csvOf(rows, 'dess sweep')", rows)
    first, second, table = written.split("\n", 2)
    assert (first, second) == ("# exploration, not verified", "# dess sweep")
    assert table == numbers.write_csv(frame)
    cells = [row[0] for row in csv.reader(io.StringIO(table))][1:]
    assert not any(cell.startswith(("=", "+", "-", "@", "\t", "\r")) for cell in cells)
