"""The notebooks of reports: read from their files, with values for their parameters.

A notebook is a Python file in jupytext's percent format. Its heading and first paragraph are the
title and the description of the page. Its metadata name the studies that it reads, and tell whether
its page has scripts. One of its cells is tagged ``parameters``. Other packages may have further
ones (``outside.py``).

    >>> report = read_report("what-if")
    >>> report.set_parameters({"missions": 500})
"""

import ast
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jupytext
import nbformat
from nbformat import NotebookNode

from dess.analysis.results.chunks import MANIFEST
from dess.base.errors import InputError, shown, unknown_name
from dess.base.files.reading import paths_in, read_text
from dess.policies.registry import is_path
from dess.reports.pages.outside import find_outside_notebooks

SHIPPED = Path(__file__).parents[1] / "notebooks"
SCORECARD = "scorecard"
# The reports in the order of the index, by what people ask.
GROUPS = {
    "Our sea, our fleet": ("own-sea", "sweep", "what-if", "pads", "failures", "age"),
    "The policies": ("seas", "planner", "comparison", "mission", "learning"),
    "The paper": ("performance", SCORECARD, "parameters"),
}
NAMES = tuple(name for names in GROUPS.values() for name in names)
OTHERS = "Other pages"  # the group of a notebook of another package that names none
LARGEST = 512 * 2**20  # bytes of a notebook with its outputs
PARAMETERS = "parameters"  # the tag of the cell with the parameters

_HINT = """

*To ask another question, change the values in the next cell, then run all cells (in the menu Run).
Below are the outputs of the page beside this file.*"""
_KERNEL = {"name": "python3", "display_name": "Python 3", "language": "python"}


@dataclass
class Report:
    """A notebook and its progress.

    Attributes:
        name: Its name on the command line.
        title: Its heading.
        description: The paragraph below the heading.
        studies: Names of the results folders that it reads.
        optional: Patterns of the names of further ones, which it reads if they are there.
        scripts: Whether the page has scripts, such as those of sliders.
        original: The complete notebook, as in its file.
        notebook: The cells of the page, with values for the parameters.
        results: The results folders that it reads, by the names that the page has for them; those
            that ``find_results`` has found.
        formats: Formats of the files with its figures that are asked for.
        key: What its page depends on; empty if it has other parameters than by default.
        is_current: Whether its page is there, and has this key.
        done: Number of cells that have been run.
        failure: The cell that failed and its error, if one did.
        traceback: The traceback of the error.
    """

    name: str
    title: str
    description: str
    studies: list[str]
    optional: list[str]
    scripts: bool
    original: NotebookNode
    notebook: NotebookNode
    results: dict[str, Path] = field(default_factory=dict)
    formats: tuple[str, ...] = ()
    key: str = ""
    is_current: bool = False
    done: int = 0
    failure: str = ""
    traceback: str = ""

    @property
    def page(self) -> str:
        """File name of the page; a failed report gets another name, to keep an older page."""
        return f"{self.name}{'.partial' if self.failure else ''}.html"

    @property
    def folder(self) -> str:
        """The name of the folder with its figures, beside the page."""
        return f"{self.name}-figures"

    @property
    def cells(self) -> list[NotebookNode]:
        """The cells with code."""
        return [cell for cell in self.notebook.cells if cell.cell_type == "code"]

    @property
    def parameters(self) -> dict[str, Any]:
        """The names that the cell tagged ``parameters`` assigns, with their values."""
        return assigned_values(_parameters_cell(self.notebook).source)

    @property
    def code(self) -> list[str]:
        """The code of every cell; absolute paths are shortened, since they are of this machine."""
        names = {name: replace_paths(v, os.path.basename) for name, v in self.parameters.items()}
        names |= {"results": "."}
        changed = _parameters_cell(self.notebook)
        return [replace_values(c.source, names) if c is changed else c.source for c in self.cells]

    def find_results(self, folder: Path) -> None:
        """Find the results that it reads, and those of the optional ones that are there.

        Args:
            folder: The folder that holds a results folder per study.

        Raises:
            InputError: If the folder cannot be read.
        """
        manifests = [
            path for name in self.optional for path in paths_in(folder, f"{name}/{MANIFEST}")
        ]
        names = [*self.studies, *(path.parent.name for path in manifests)]
        self.results = {name: folder / name for name in names}

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        """Set parameters to other values; parameters of other notebooks are ignored."""
        _write_parameters(self.notebook, values)

    def for_jupyter(self, results: Path, out: Path, values: Mapping[str, Any]) -> str:
        """The notebook, after its cells have been run, as a file that Jupyter opens in ``out``.

        It has the values and the outputs of that run, but neither counters nor times. Its first
        text says what may be changed.
        """
        notebook = deepcopy(self.original)
        moved = {
            name: replace_paths(v, lambda path: _relative_path(path, out))
            for name, v in values.items()
        }
        _write_parameters(notebook, {**moved, "results": _relative_path(str(results), out)})
        outputs = {cell.id: cell.outputs for cell in self.cells}
        for cell in notebook.cells:
            if cell.cell_type == "code":
                cell.outputs = [*filter(None, map(_output_for_jupyter, outputs.get(cell.id, [])))]
        notebook.cells[0].source += _HINT
        notebook.metadata = {"kernelspec": _KERNEL}
        return nbformat.writes(notebook) + "\n"

    def is_in(self, out: Path, results: Path) -> bool:
        """Whether the notebook for Jupyter is in ``out``, and names the folder of the results.

        The notebook of a report that reads no results names none.
        """
        try:
            text = read_text(out / f"{self.name}.ipynb", LARGEST)
        except InputError:
            return False
        if "results" not in self.parameters:
            return True
        cell = _parameters_cell(self.original).source
        expected = replace_values(cell, {"results": _relative_path(str(results), out)})
        line = next(line for line in expected.splitlines() if line.startswith("results"))
        return json.dumps(line, ensure_ascii=False)[1:-1] in text


def _relative_path(path: str, out: Path) -> str:
    """A path as a notebook in the folder ``out`` names it."""
    return Path(os.path.relpath(path, out)).as_posix()


def _output_for_jupyter(output: NotebookNode) -> NotebookNode | None:
    """An output of a cell as Jupyter shows it; none for a warning."""
    if output.get("name") == "stderr":
        return None
    shown = deepcopy(output)
    if "text/html" in shown.get("data", {}):
        shown.data = NotebookNode({"text/html": shown.data["text/html"]})
    return shown


def report_names(folder: Path = SHIPPED) -> list[str]:
    """The names of the reports whose notebooks are in a folder, in the order of the index.

    To those that are shipped, the reports of other packages are added.
    """
    names = [name for name in NAMES if _find_notebook(folder, name).exists()]
    if folder == SHIPPED:
        names += find_outside_notebooks(NAMES)
    return names


def find_groups() -> dict[str, list[str]]:
    """The headings of the index with the names of their reports, those of other packages last."""
    groups = {heading: [*names] for heading, names in GROUPS.items()}
    for name in find_outside_notebooks(NAMES):
        about = parse_notebook(name).metadata.get("dess", {})
        groups.setdefault(str(about.get("group", OTHERS)), []).append(name)
    return groups


def read_report(name: str, folder: Path = SHIPPED) -> Report:
    """Read the notebook of a report.

    Raises:
        InputError: If the folder has no report of that name.
    """
    if name not in (names := report_names(folder)):
        raise unknown_name("report", f"{shown(name)} is unknown", name, names)
    return make_report(name, parse_notebook(name, folder))


def parse_notebook(name: str, folder: Path = SHIPPED) -> NotebookNode:
    """The notebook of a report, all of it."""
    notebook = jupytext.reads(read_text(_find_notebook(folder, name)), fmt="py:percent")
    for number, cell in enumerate(notebook.cells):
        cell.id = f"cell-{number}"
    return notebook


def make_report(name: str, original: NotebookNode) -> Report:
    """The report of a notebook, which begins with its heading.

    Raises:
        InputError: If the notebook is no report.
    """
    _check_notebook(name, original)
    title, description = original.cells[0].source.removeprefix("# ").split("\n\n", 1)
    notebook = deepcopy(original)
    del notebook.cells[0]  # the header of the page shows them
    about = original.metadata["dess"]
    results = (about["studies"], about.get("optional", []))
    scripts = about.get("scripts", False)
    description = " ".join(description.split())
    return Report(name, title, description, *results, scripts, original, notebook)


def _check_notebook(name: str, notebook: NotebookNode) -> None:
    """Refuse a notebook that lacks what a report must have.

    Raises:
        InputError: If it does.
    """
    start = notebook.cells[0].source if notebook.cells else ""
    studies = notebook.metadata.get("dess", {}).get("studies")
    if not start.startswith("# ") or "\n\n" not in start:
        problem = "its notebook does not begin with a heading and a paragraph"
    elif not isinstance(studies, list) or not all(isinstance(study, str) for study in studies):
        problem = "the metadata of its notebook have no list of studies"
    elif not any(PARAMETERS in cell_tags(cell) for cell in notebook.cells):
        problem = f"its notebook has no cell tagged {PARAMETERS}"
    else:
        return
    raise InputError(f"report {name}", problem, "a notebook as those of dess are")


OF_EXAMPLE = ("fields", "prices", "requirements")


def check_parameters(reports: Iterable[Report], names: Iterable[str]) -> None:
    """Refuse parameters that no report has, and ``results``, which has an option of its own.

    A sea of one's own has no answer with the prices of the example.

    Raises:
        InputError: If there is one, or ``own-sea`` lacks some that belong to its scenario.
    """
    reports = [*reports]
    names = [*names]
    lacking = [name for name in OF_EXAMPLE if name not in names]
    if "scenario" in names and lacking and any(r.name == "own-sea" for r in reports):
        raise InputError(
            "parameter",
            f"own-sea has the {', '.join(lacking)} of its example, bay",
            "those of the scenario, each by --parameter",
        )
    allowed = set().union(*(report.parameters for report in reports)) - {"results"}
    for name in names:
        if name not in allowed:
            raise unknown_name(
                "parameter",
                f"{name!r} is unknown to {', '.join(r.name for r in reports)}",
                name,
                sorted(allowed),
            )


def _find_notebook(folder: Path, name: str) -> Path:
    """The file of a notebook, in the folder or in one of its folders, or in another package."""
    file = f"{name.replace('-', '_')}.py"
    path = next(iter(paths_in(folder, f"*/{file}")), folder / file)
    if folder != SHIPPED or path.exists():
        return path
    return find_outside_notebooks(NAMES).get(name, path)


def cell_tags(cell: NotebookNode) -> list[str]:
    """The tags of a cell."""
    return cell.metadata.get("tags", [])


def _parameters_cell(notebook: NotebookNode) -> NotebookNode:
    return next(cell for cell in notebook.cells if PARAMETERS in cell_tags(cell))


def _write_parameters(notebook: NotebookNode, values: Mapping[str, Any]) -> None:
    """Write values into the cell tagged ``parameters``."""
    cell = _parameters_cell(notebook)
    cell.source = replace_values(cell.source, values)


def assigned_values(source: str) -> dict[str, Any]:
    """The parameters that a cell assigns, with their values."""
    return {name: ast.literal_eval(value) for name, value in _find_assignments(source)}


def replace_values(source: str, values: Mapping[str, Any]) -> str:
    """The source of a cell with other values for its parameters; comments and layout are kept.

    Args:
        source: The source of the cell.
        values: Values by name; names that the cell does not assign are ignored.
    """
    before = assigned_values(source)
    lines = source.encode().split(b"\n")  # columns of a syntax tree count bytes
    for name, node in reversed([*_find_assignments(source)]):
        if name in values and values[name] != before[name]:
            first = node.lineno - 1
            last = (node.end_lineno or node.lineno) - 1
            head = lines[first][: node.col_offset]
            tail = lines[last][node.end_col_offset :]
            lines[first : last + 1] = [head + repr(values[name]).encode() + tail]
    return b"\n".join(lines).decode()


def replace_paths(value: Any, write: Callable[[str], str]) -> Any:
    """The value of a parameter with its paths replaced, such as relative by absolute ones.

    A path is a word with a path separator, one that ends with ``.toml``, or a policy of a folder or
    a Python file. It may be a part of a team: with ``os.path.abspath``, ``greedy,mine`` becomes
    ``greedy,/home/me/mine``.
    """
    if isinstance(value, list):
        return [replace_paths(item, write) for item in value]
    if not isinstance(value, str):
        return value
    return ",".join(
        write(word) if os.sep in word or word.endswith(".toml") or is_path(word) else word
        for word in value.split(",")
    )


def _find_assignments(source: str) -> Iterator[tuple[str, ast.expr]]:
    """The name and the value of every assignment, in the order of the source."""
    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            yield node.targets[0].id, node.value
