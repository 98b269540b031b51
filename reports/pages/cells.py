"""Runs the cells of notebooks, two notebooks at a time, in a child that is forked for each.

The process imports what the notebooks import, once for all. It is the other end of ``kernels``, and
imports nothing that only rendering needs::

    python -m dess.reports.pages.cells < notebooks.json
"""

import ast
import json
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import redirect_stderr, redirect_stdout, suppress
from io import StringIO
from itertools import islice
from multiprocessing import Pipe, Process, set_start_method
from multiprocessing.connection import Connection, wait
from threading import Thread
from traceback import format_exception
from typing import TYPE_CHECKING, Any, NoReturn

from dess.analysis.results.tables import keep_results
from dess.base.errors import InputError

if TYPE_CHECKING:  # the process that only starts this one needs no shell
    from IPython.core.interactiveshell import InteractiveShell

AT_ONCE = 2


def _serve_notebooks() -> None:
    """Run the notebooks that a line of standard input has; print what becomes of every cell.

    The line has a list of notebooks, each a list of cells, and the results folders that several of
    them read. An answer is a list of the number of the notebook, the outputs of its next cell, and
    its error. A notebook whose child dies has no more.
    """
    import IPython.core.interactiveshell  # noqa: F401 - here and not in every child

    work = json.loads(sys.stdin.readline())
    codes = work["cells"]
    Thread(target=_end_with_parent, daemon=True).start()
    _import_all(cell for cells in codes for cell in cells)
    for folder in work["folders"]:
        with suppress(InputError):  # will be that of the notebook
            keep_results(folder)
    set_start_method("fork" if hasattr(os, "fork") else "spawn")
    waiting = iter(enumerate(codes))
    running = set[Connection]()
    while True:
        for number, cells in islice(waiting, AT_ONCE - len(running)):
            receiver, sender = Pipe(duplex=False)
            Process(target=_run_cells, args=(number, cells, sender)).start()
            sender.close()
            running.add(receiver)
        if not running:
            return
        ready = wait(running)
        for child in [child for child in running if child in ready]:
            try:
                print(child.recv(), flush=True)
            except EOFError:
                running.remove(child)


def kill_group(group: int) -> None:
    """Kill a group of processes, where the system has groups."""
    if hasattr(os, "killpg"):
        with suppress(ProcessLookupError):
            os.killpg(group, signal.SIGKILL)


def _end_with_parent() -> NoReturn:
    """Wait for the end of standard input, which the parent keeps open, then end the children."""
    os.read(0, 1)
    kill_group(0)
    os._exit(1)


def _import_all(cells: Iterator[str]) -> None:
    """Run the cells that only import, so that it is not done in every child."""
    for cell in cells:
        with suppress(Exception):  # will be that of the notebook
            if all(isinstance(node, ast.Import | ast.ImportFrom) for node in ast.parse(cell).body):
                exec(cell, {})


def _run_cells(number: int, cells: Sequence[str], parent: Connection) -> None:
    """Run the cells of a notebook up to the first that fails, and send the answers."""
    from IPython.core.interactiveshell import InteractiveShell
    from traitlets.config import Config

    os.dup2(2, 1)  # what a library prints is no answer
    shell = InteractiveShell.instance(config=Config(HistoryManager={"enabled": False}))
    for cell in cells:
        outputs, error = _run_cell(shell, cell)
        parent.send(json.dumps([number, outputs, error]))
        if error:
            return


def _run_cell(shell: "InteractiveShell", cell: str) -> tuple[list[dict], dict[str, Any] | None]:
    """Run a cell: its outputs as Jupyter stores them, and the text and place of its error.

    An ``InputError`` has its parts as well, under ``refusal``.
    """
    from IPython.core.displayhook import CapturingDisplayHook
    from IPython.core.displaypub import CapturingDisplayPublisher

    shell.display_pub = CapturingDisplayPublisher()
    shell.display_trap.hook = CapturingDisplayHook(shell, shell.display_pub.outputs)
    streams = {"stdout": StringIO(), "stderr": StringIO()}
    with redirect_stdout(streams["stdout"]), redirect_stderr(streams["stderr"]):
        result = shell.run_cell(cell)
    if error := result.error_before_exec or result.error_in_exec:
        refusal = None
        if type(error) is InputError:
            refusal = error.args
        text = f"{type(error).__name__}: {error}"
        traceback = "".join(format_exception(error))
        return [], {"text": text, "traceback": traceback, "refusal": refusal}
    outputs: list[dict] = [
        {"output_type": "stream", "name": name, "text": stream.getvalue()}
        for name, stream in streams.items()
        if stream.getvalue()
    ]
    for shown in shell.display_pub.outputs:
        parts = {"data": shown["data"], "metadata": shown["metadata"]}
        outputs.append({"output_type": "display_data", **parts})
    return outputs, None


if __name__ == "__main__":
    _serve_notebooks()
