"""Runs the notebooks of reports in the process of a case: the start of another takes seconds.

Errors end as those of another process do. A share of the cases has other processes.
"""

import ast
import io
from collections.abc import Sequence
from contextlib import chdir, redirect_stderr
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import IPython.display
from nbformat.v4 import new_output

from dess import InputError
from dess.reports.pages import html, kernels
from dess.reports.pages.html import PART, Part
from dess.reports.pages.kernels import Progress
from dess.reports.pages.notebook import Report

HTML = "text/html"


def run_here() -> None:
    """Let the commands of this process run notebooks in it."""
    kernels.run_reports = _run
    html.encode_figure = lambda drawing, kind: b""


def _run(
    reports: Sequence[Report], progress: Progress | None = None, shared: Sequence[Path] = ()
) -> None:
    for report in reports:
        try:
            # As another process, not among the files of the case, and without bars and drawings.
            with TemporaryDirectory() as folder, chdir(folder), redirect_stderr(io.StringIO()):
                _execute(report)
        except InputError as error:
            raise error.within(f"report {report.name}") from error
        except Exception as error:  # of a cell, which may raise anything
            report.failure = f"report {report.name}: {type(error).__name__}: {error}"


def _execute(report: Report) -> None:
    shown: list[Any] = []
    IPython.display.display = lambda *pieces: shown.extend(pieces)
    scope: dict[str, Any] = {}
    for cell in report.cells:
        tree = ast.parse(cell.source)
        last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, report.name, "exec"), scope)
        if isinstance(last, ast.Expr):
            shown.append(eval(compile(ast.Expression(last.value), report.name, "eval"), scope))
        pieces = [piece for piece in shown if isinstance(piece, IPython.display.DisplayObject)]
        cell.outputs = [
            new_output("display_data", {PART: p.values} if isinstance(p, Part) else {HTML: p.data})
            for p in pieces
        ]
        shown.clear()
