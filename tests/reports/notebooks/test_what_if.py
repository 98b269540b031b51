"""The page of a question says what its missions say."""

import re
from html import unescape
from pathlib import Path
from typing import Any

import nbformat
import pandas as pd
import pytest
from nbclient import NotebookClient

from analysis import load_results, numbers
from analysis import what_if as ask
from analysis.ask import what_if as what_if_answer
from analysis.names import METRICS, PRODUCT
from analysis.stats.differences import paired
from reports.pages.notebook import read
from tests.analysis.small import write_scenario
from tests.reports.small import said_by

NAME = "what-if"
ASKED: dict[str, Any] = {
    "settings": {"uavs": 5, "pads": 2},
    "baseline": {"uavs": 2, "quota": 50},
    "policies": ["random", "greedy"],
    "missions": 12,
    "seed": 3,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("asked")


@pytest.fixture(scope="module")
def text(folder: Path) -> str:
    """What the page says, its missions simulated into ``results``."""
    scenario = str(write_scenario(folder))
    return said_by(NAME, results=str(folder / "results"), scenario=scenario, **ASKED)


@pytest.fixture(scope="module")
def results(folder: Path, text: str) -> Any:
    (made,) = (folder / "results" / NAME).iterdir()
    return load_results(made)


def test_the_difference_is_computed_anew_from_the_files(text: str, results: Any) -> None:
    """The mean paired difference of a policy, with its interval."""
    missions = pd.read_parquet(results.store.folder / "missions").astype({"policy": str})
    sides = {cell.key: cell.point for cell in results.store.manifest.cells[1]}  # of greedy
    greedy = missions[missions["policy"] == "greedy"]
    table = greedy.assign(point=greedy["cell"].map(sides)).pivot(
        index="replication", columns="point", values="collection_ratio_and_communication"
    )
    pair = paired(table[1].to_numpy(), table[0].to_numpy(), metric=PRODUCT)
    values = pair.difference, pair.low, pair.high
    mean, low, high = (f"{100 * v:+.1f}".replace("-", "−") for v in values)
    assert f"by {mean} [{low}, {high}] points: from {100 * table[0].mean():.1f} %" in text


def test_the_page_says_what_the_missions_say(text: str, results: Any) -> None:
    for field, before, after in (("uavs", 2, 5), ("pads", 6, 2), ("quota", 50, 50)):
        assert re.search(rf"\b{field} [^.]*? {before} {after}\b", text)
    answers = what_if_answer.answers(results)
    for answer in answers.itertuples():
        assert what_if_answer.change(answer) in text
        if answer.metric in METRICS:
            assert numbers.percent(answer.before) in text and numbers.percent(answer.after) in text
    for line in what_if_answer.conclusions(answers).replace("**", "").splitlines():
        assert line in text
    assert what_if_answer.command(results) in text


@pytest.mark.slow  # test_render.py runs a smaller notebook in Jupyter
def test_the_notebook_asks_what_its_edited_cell_says(tmp_path: Path) -> None:
    """In Jupyter, from top to bottom."""
    values = {"scenario": str(write_scenario(tmp_path)), **ASKED}
    text = read(NAME).for_jupyter(tmp_path / "results", tmp_path, values)
    notebook = nbformat.reads(text, as_version=4)
    cell = next(cell for cell in notebook.cells if cell.cell_type == "code")
    assert "settings = {'uavs': 5, 'pads': 2}  # fields of the scenario" in cell.source
    assert "scenario = 'small.toml'" in cell.source
    cell.source = cell.source.replace("{'uavs': 5, 'pads': 2}", "{'quota': 30}")
    NotebookClient(notebook, resources={"metadata": {"path": str(tmp_path)}}).execute()
    given = {name: value for name, value in ASKED.items() if name != "settings"}
    asked = ask(
        {"quota": 30}, scenario=tmp_path / "small.toml", folder=tmp_path / "results", **given
    )
    outputs = [o for c in notebook.cells if c.cell_type == "code" for o in c.outputs]
    shown = [output.data for output in outputs if output.output_type == "execute_result"]
    assert asked.answer() in [unescape(data.get("text/markdown", "")) for data in shown]
