"""The notebooks of reports, read from their files, with values for their parameters.

A notebook is a Python file in jupytext's percent format. Its heading and the paragraph below are
the title and the description of its page, its metadata name the studies that it reads, and one of
its cells is tagged ``parameters``:

    report = read("what-if")
    report.set({"missions": 500})
"""

import ast
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jupytext
import nbformat
from nbformat import NotebookNode

from dess import InputError

SHIPPED = Path(__file__).parents[1] / "notebooks"
SCORECARD = "scorecard"  # the index shows all of it
NAMES = (  # in the order of the index
    "mission",
    "performance",
    "learning",
    "parameters",
    "comparison",
    "what-if",
    "verification",
    SCORECARD,
)
VALUES = "cell-parameters"  # id of the cell that sets parameters to other values

_KERNEL = {"name": "python3", "display_name": "Python 3", "language": "python"}


@dataclass
class Report:
    """A notebook, and how far it has been run.

    Attributes:
        name: Its name on the command line.
        title: Its heading.
        description: The paragraph below the heading.
        studies: Names of the results folders that it reads.
        source: The text of its file.
        notebook: The cells without the heading, with values for parameters.
        begun: Id of the cell that was begun last.
        done: Number of cells that have been run.
        failure: The cell that failed and its error, if one did.
        traceback: The traceback of the error.
    """

    name: str
    title: str
    description: str
    studies: list[str]
    source: str
    notebook: NotebookNode
    begun: str = ""
    done: int = 0
    failure: str = ""
    traceback: str = ""

    @property
    def page(self) -> str:
        """File name of the page; a failed report has another one, so the complete page stays."""
        return f"{self.name}{'.partial' if self.failure else ''}.html"

    @property
    def cells(self) -> list[NotebookNode]:
        """The cells with code."""
        return [cell for cell in self.notebook.cells if cell.cell_type == "code"]

    @property
    def parameters(self) -> set[str]:
        """The names that the cell tagged ``parameters`` assigns."""
        source = self.notebook.cells[_parameters_cell(self.notebook)].source
        targets = (n.targets[0] for n in ast.parse(source).body if isinstance(n, ast.Assign))
        return {target.id for target in targets if isinstance(target, ast.Name)}

    def set(self, values: Mapping[str, Any]) -> None:
        """Set parameters to other values; parameters of other notebooks are ignored."""
        _set(self.notebook, self._of_parameters(values))

    def for_jupyter(self, results: Path, out: Path, values: Mapping[str, Any]) -> str:
        """The notebook as a file that Jupyter opens in ``out``, with the values it ran with."""
        notebook = _parsed(self.source)
        folder = {"results": Path(os.path.relpath(results, out)).as_posix()}
        _set(notebook, self._of_parameters({**values, **folder}))
        notebook.metadata = {"kernelspec": _KERNEL}
        return nbformat.writes(notebook) + "\n"

    def _of_parameters(self, values: Mapping[str, Any]) -> dict[str, Any]:
        return {name: value for name, value in values.items() if name in self.parameters}


def names_in(folder: Path = SHIPPED) -> list[str]:
    """The names of the reports whose notebooks are in a folder, in the order of the index."""
    return [name for name in NAMES if _file(folder, name).exists()]


def read(name: str, folder: Path = SHIPPED) -> Report:
    """Read the notebook of a report.

    Raises:
        InputError: If the folder has no report of that name.
    """
    if name not in (names := names_in(folder)):
        raise InputError(f"report: {name!r} is unknown; allowed: {', '.join(names)}")
    source = _file(folder, name).read_text("utf-8")
    notebook = _parsed(source)
    title, description = notebook.cells[0].source.removeprefix("# ").split("\n\n", 1)
    del notebook.cells[0]  # the header of the page shows them
    studies = notebook.metadata["dess"]["studies"]
    return Report(name, title, " ".join(description.split()), studies, source, notebook)


def check_parameters(reports: Iterable[Report], names: Iterable[str]) -> None:
    """Refuse parameters that no report has, and ``results``, which has an option of its own.

    Raises:
        InputError: If there is one.
    """
    reports = [*reports]
    known = set().union(*(report.parameters for report in reports)) - {"results"}
    for name in names:
        if name not in known:
            raise InputError(
                f"parameter: {name!r} is unknown to {', '.join(r.name for r in reports)}; "
                f"allowed: {', '.join(sorted(known)) or 'none'}"
            )


def _file(folder: Path, name: str) -> Path:
    return folder / f"{name.replace('-', '_')}.py"


def _parsed(source: str) -> NotebookNode:
    notebook = jupytext.reads(source, fmt="py:percent")
    for number, cell in enumerate(notebook.cells):
        cell.id = f"cell-{number}"
    return notebook


def _parameters_cell(notebook: NotebookNode) -> int:
    """The number of the cell tagged ``parameters``."""
    tagged = ("parameters" in cell.metadata.get("tags", []) for cell in notebook.cells)
    return list(tagged).index(True)


def _set(notebook: NotebookNode, values: Mapping[str, Any]) -> None:
    """Insert a cell with the values after the cell tagged ``parameters``."""
    if values:
        source = "\n".join(f"{name} = {value!r}" for name, value in values.items())
        cell = nbformat.v4.new_code_cell(source, id=VALUES)
        notebook.cells.insert(_parameters_cell(notebook) + 1, cell)
