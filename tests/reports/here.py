"""Runs the notebooks of reports in this process: the start of another takes seconds.

Errors end as those of another process do.
"""

import ast
import io
from collections.abc import Iterator, Sequence
from contextlib import chdir, contextmanager, redirect_stderr
from tempfile import TemporaryDirectory
from typing import Any

import IPython.display
import pytest
from nbformat import NotebookNode
from nbformat.v4 import new_output

from dess import InputError
from dess.reports.pages import figures, kernels, parts
from dess.reports.pages.missing import Progress
from dess.reports.pages.notebook import Report
from dess.reports.pages.parts import PART, Part

FOLDER = "notebooks-"  # what the names of the folders begin with in which notebooks run


@contextmanager
def notebooks_here(is_drawn: bool = False) -> Iterator[None]:
    """Let pages run their notebooks in this process; their figures are empty if not drawn."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernels, "run_reports", run_reports)
        if not is_drawn:
            patch.setattr(figures, "encode_figure", lambda drawing, kind: b"")
        yield


def run_reports(reports: Sequence[Report], progress: Progress | None = None) -> None:
    """Run reports, as the function of this name in ``kernels`` does in another process."""
    for report in reports:
        try:
            # As another process, not among the files of the caller, and without bars.
            with (
                TemporaryDirectory(prefix=FOLDER) as folder,
                chdir(folder),
                redirect_stderr(io.StringIO()),
            ):
                for cell, pieces in run_cells(report):
                    cell.outputs = [new_output("display_data", _data_of(p)) for p in pieces]
        except InputError as error:
            raise error.within(f"report {report.name}") from error
        except Exception as error:  # of a cell, which may raise anything
            report.failure = f"report {report.name}: {type(error).__name__}: {error}"


def run_cells(report: Report) -> Iterator[tuple[NotebookNode, list[Any]]]:
    """The cells of a report, each with the pieces that it shows when it is run."""
    scope: dict[str, Any] = {}
    shown: list[Any] = []
    with pytest.MonkeyPatch.context() as patch:
        for module in (IPython.display, parts):
            patch.setattr(module, "display", lambda *pieces: shown.extend(pieces))
        for cell in report.cells:
            tree = ast.parse(cell.source)
            last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
            exec(compile(tree, report.name, "exec"), scope)
            if isinstance(last, ast.Expr):
                shown.append(eval(compile(ast.Expression(last.value), report.name, "eval"), scope))
            yield cell, [p for p in shown if isinstance(p, IPython.display.DisplayObject)]
            shown.clear()


def _data_of(piece: Any) -> dict[str, Any]:
    """What a piece says, by the type under which a page looks for it."""
    if isinstance(piece, Part):
        return {PART: piece.values}
    kind = "text/markdown" if isinstance(piece, IPython.display.Markdown) else "text/html"
    return {kind: piece.data}
