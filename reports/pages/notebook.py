"""Notebooks: the shipped reports as they are read, with their parameters."""

import ast
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import jupytext
import nbformat
from nbformat import NotebookNode

from dess.errors import InputError

GIVEN = "cell-parameters"  # the cell with the values that a report was asked with
SCORECARD = "scorecard"  # the index shows all of it
NAMES = (
    "mission",
    "performance",
    "learning",
    "parameters",
    "comparison",
    "what-if",
    "verification",
    SCORECARD,
)

_KERNEL = {"name": "python3", "display_name": "Python 3", "language": "python"}


@dataclass
class Report:
    """A notebook: what the index says of it, and the studies whose results it reads.

    Attributes:
        name: By which it is asked for.
        title: Its heading.
        description: The paragraph below.
        studies: Names of the results folders that it needs.
        source: The notebook as it is shipped.
        notebook: What is run: without the heading, with the parameters.
        begun: Id of the cell that was last begun.
        done: Number of cells that have been run.
        failure: Which cell failed and how, if one did.
        traceback: Where it did.
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
        """File name of the page; that of a failed report is another, and spoils no whole one."""
        return f"{self.name}{'.partial' if self.failure else ''}.html"

    @property
    def cells(self) -> list[NotebookNode]:
        """The cells that are run."""
        return [cell for cell in self.notebook.cells if cell.cell_type == "code"]

    @property
    def parameters(self) -> set[str]:
        """The names that the cell tagged ``parameters`` assigns."""
        source = self.notebook.cells[_tagged(self.notebook)].source
        targets = (n.targets[0] for n in ast.parse(source).body if isinstance(n, ast.Assign))
        return {target.id for target in targets if isinstance(target, ast.Name)}

    def set(self, values: Mapping[str, Any]) -> None:
        """Have it run with other values of its parameters; those of others are left aside."""
        _set(self.notebook, {k: v for k, v in values.items() if k in self.parameters})

    def for_jupyter(self, results: Path, out: Path, values: Mapping[str, Any]) -> str:
        """The notebook as a file that Jupyter opens in ``out``, with the parameters it ran with."""
        notebook = _parsed(self.source)
        own = {k: v for k, v in values.items() if k in self.parameters}
        if "results" in self.parameters:
            own |= {"results": Path(os.path.relpath(results, out)).as_posix()}
        _set(notebook, own)
        notebook.metadata = {"kernelspec": _KERNEL}
        return nbformat.writes(notebook) + "\n"


def read(name: str) -> Report:
    """A shipped report: the heading of its notebook is its title, the paragraph below describes it.

    Raises:
        InputError: If there is none of that name.
    """
    if name not in NAMES:
        raise InputError(f"report: {name!r} is unknown; allowed: {', '.join(NAMES)}")
    file = resources.files("reports").joinpath(f"notebooks/{name.replace('-', '_')}.py")
    source = file.read_text("utf-8")
    notebook = _parsed(source)
    title, description = notebook.cells[0].source.removeprefix("# ").split("\n\n", 1)
    del notebook.cells[0]  # the page has them in its header
    studies = notebook.metadata["dess"]["studies"]
    return Report(name, title, " ".join(description.split()), studies, source, notebook)


def check_parameters(reports: Iterable[Report], names: Iterable[str]) -> None:
    """Refuse parameters that no report has, and the results, which have an option of their own.

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


def _parsed(source: str) -> NotebookNode:
    notebook = jupytext.reads(source, fmt="py:percent")
    for number, cell in enumerate(notebook.cells):
        cell.id = f"cell-{number}"
    return notebook


def _tagged(notebook: NotebookNode) -> int:
    """The number of the cell tagged ``parameters``."""
    tagged = ("parameters" in cell.metadata.get("tags", []) for cell in notebook.cells)
    return list(tagged).index(True)


def _set(notebook: NotebookNode, values: Mapping[str, Any]) -> None:
    """Insert a cell with the values after the tagged one."""
    if values:
        source = "\n".join(f"{name} = {value!r}" for name, value in values.items())
        cell = nbformat.v4.new_code_cell(source, id=GIVEN)
        notebook.cells.insert(_tagged(notebook) + 1, cell)
