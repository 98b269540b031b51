"""The page of a sweep says what its missions say, and its notebook runs with a changed cell."""

from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

from analysis import load_results, numbers, sweep
from reports.pages.notebook import read
from tests.analysis.small import write_scenario
from tests.reports.small import said_by

NAME = "sweep"
ASKED: dict[str, Any] = {
    "fields": {"uavs": [1, 2], "quota": [20, 40], "pads": 2},
    "policies": ["random", "greedy"],
    "missions": 12,
    "seed": 3,
}


def test_the_page_says_what_the_missions_say(tmp_path: Path) -> None:
    scenario = write_scenario(tmp_path)
    text = said_by(NAME, results=str(tmp_path), scenario=str(scenario), **ASKED)
    (folder,) = (path for path in (tmp_path / "sweeps").iterdir() if path.is_dir())
    missions = load_results(folder).missions
    means = missions.groupby(["policy", "point"])["collection_ratio"].mean()
    for mean in means:
        assert numbers.percent(mean) in text
    assert "12 per policy and design point, 96 in all" in text
    command = "dess sweep --set pads=2 --set uavs=1,2 --set quota=20,40 --policy random,greedy"
    assert f"{command} --missions 12 --seed 3 --scenario small.toml" in text


def run_changed(name: str, folder: Path, old: str, new: str, values: dict[str, Any]) -> list[str]:
    """Run the notebook in Jupyter with a change in its first cell; the text that it shows."""
    notebook = nbformat.reads(read(name).for_jupyter(folder, folder, values), as_version=4)
    cell = next(cell for cell in notebook.cells if cell.cell_type == "code")
    assert old in cell.source
    cell.source = cell.source.replace(old, new)
    NotebookClient(notebook, resources={"metadata": {"path": str(folder)}}).execute()
    outputs = [o for c in notebook.cells if c.cell_type == "code" for o in c.outputs]
    return [o.data.get("text/markdown", "") for o in outputs if o.output_type == "execute_result"]


@pytest.mark.slow
def test_the_notebook_asks_what_its_edited_cell_says(tmp_path: Path) -> None:
    """In Jupyter, from top to bottom; one field is swept in place of two."""
    scenario = write_scenario(tmp_path)
    values = {**ASKED, "scenario": str(scenario)}
    shown = run_changed(NAME, tmp_path, "[20, 40]", "30", values)
    fields = {"uavs": [1, 2], "quota": 30, "pads": 2}
    given = {name: value for name, value in ASKED.items() if name != "fields"}
    again = sweep(scenario, folder=tmp_path, progress=False, **given, **fields)
    assert any(again.command in text for text in shown)
    assert len([*(tmp_path / "sweeps").glob("*.toml")]) == 1  # that of the notebook
