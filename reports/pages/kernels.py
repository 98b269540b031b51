"""Run notebooks, two at a time: one process imports what they import, and forks a child for each.

The process imports the same modules as this one, computes in one thread and writes nothing into the
user's home folder. It works in a new folder of its own, so it never imports or reads a file that
merely lies beside results, such as ``pandas.py`` or ``matplotlibrc``. It gets the code of all
cells, and answers with a line for every cell that has been run.
"""

import ast
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from io import StringIO
from itertools import islice
from multiprocessing import Pipe, Process, set_start_method
from multiprocessing.connection import Connection, wait
from pathlib import Path
from tempfile import TemporaryFile, gettempdir
from threading import Thread
from traceback import format_exception
from typing import IO, NoReturn

import matplotlib as mpl
from IPython.core.displayhook import CapturingDisplayHook
from IPython.core.displaypub import CapturingDisplayPublisher
from IPython.core.interactiveshell import InteractiveShell
from nbformat import from_dict
from traitlets.config import Config

from dess import InputError
from dess.files.locks import temporary_folder
from reports.pages.notebook import Report

# Called after every cell, with the number of cells run so far and of all cells, and the report.
Progress = Callable[[int, int, str], None]

AT_ONCE = 2
HOME = "dess-pages-"  # beginning of the name of the folder in which the notebooks run
PACKAGES = Path(__file__).parents[2]  # the folder from which this package was imported


def run(reports: Sequence[Report], progress: Progress | None = None) -> None:
    """Run reports. If one fails, the error is stored in it and the others are still run.

    Args:
        reports: The reports, which get the outputs of their cells.
        progress: Called after every cell.

    Raises:
        InputError: If a notebook refuses its parameters or results.
    """
    if not reports:
        return
    total = sum(len(report.cells) for report in reports)
    codes = [[cell.source for cell in report.cells] for report in reports]
    with temporary_folder(Path(gettempdir()), HOME) as home, TemporaryFile() as log:
        with _process(home, log) as (asked, answers):
            with suppress(BrokenPipeError):
                asked.write(json.dumps(codes).encode() + b"\n")
                asked.flush()
            for number, outputs, error in map(json.loads, answers):
                report = reports[number]
                report.cells[report.done].outputs = [from_dict(output) for output in outputs]
                if error:
                    _fail(report, *error)
                    continue
                report.done += 1
                if progress:
                    progress(sum(report.done for report in reports), total, report.name)
        for report in reports:
            if report.done < len(report.cells) and not report.failure:
                log.seek(0)
                last = log.read().decode("utf-8", "replace").strip().splitlines()[-1:]
                report.failure = ": ".join([_cell(report), "its process ended", *last])


def _fail(report: Report, kind: str, message: str, traceback: str) -> None:
    """Store the error of a cell in its report, or raise it if the notebook refuses its input."""
    if kind == InputError.__name__:
        raise InputError(f"report {report.name}: {message}")
    report.failure, report.traceback = f"{_cell(report)}: {kind}: {message}", traceback


def _cell(report: Report) -> str:
    """The cell that was begun last: its number among the cells with code, and its first line."""
    first_line = report.cells[report.done].source.strip().partition("\n")[0]
    return f"report {report.name}: cell {report.done + 1} of {len(report.cells)} ({first_line})"


@contextmanager
def _process(home: Path, log: IO[bytes]) -> Iterator[tuple[IO[bytes], IO[bytes]]]:
    """Input and output of the process that runs notebooks in a folder; it is killed at the end.

    A session of its own keeps Ctrl-C from it and its children, and makes them a group to kill.
    """
    process = subprocess.Popen(
        [sys.executable, "-m", __name__],
        cwd=home,
        env=_environment(home),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=log,
        start_new_session=True,
    )
    assert process.stdin
    assert process.stdout
    try:
        yield process.stdin, process.stdout
    finally:
        _kill(process.pid)
        process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout):
            with suppress(BrokenPipeError):
                stream.close()


def _kill(group: int) -> None:
    """Kill a group of processes, where the system has groups."""
    if hasattr(os, "killpg"):
        with suppress(ProcessLookupError):
            os.killpg(group, signal.SIGKILL)


def _environment(home: Path) -> dict[str, str]:
    """The environment of a process that writes to ``home`` only.

    An empty entry of the path means the working directory of this process, where anything may lie.
    """
    path = [*(os.path.abspath(entry) for entry in sys.path if entry), str(PACKAGES)]
    return {
        **os.environ,
        "IPYTHONDIR": str(home),
        "PYTHONPATH": os.pathsep.join(path),
        "PYTHONSAFEPATH": "1",  # do not put the working directory in front of it
        "OMP_NUM_THREADS": "1",
        "TQDM_DISABLE": "1",  # a page shows no progress bar
        "MPLBACKEND": "agg",
        "MPLCONFIGDIR": mpl.get_cachedir(),
    }


# --- in the process ---


def _serve() -> None:
    """Run the notebooks that a line of standard input has; print what becomes of every cell.

    The line is a list of notebooks, each a list of cells. An answer is a list of the number of the
    notebook, the outputs of its next cell, and its error. A notebook whose child dies has no more.
    """
    codes = json.loads(sys.stdin.readline())
    Thread(target=_end_with_parent, daemon=True).start()
    _import_all(cell for cells in codes for cell in cells)
    set_start_method("fork" if hasattr(os, "fork") else "spawn")
    waiting, running = iter(enumerate(codes)), set[Connection]()
    while True:
        for number, cells in islice(waiting, AT_ONCE - len(running)):
            here, there = Pipe(duplex=False)
            Process(target=_run_cells, args=(number, cells, there)).start()
            there.close()
            running.add(here)
        if not running:
            return
        ready = wait(running)
        for child in [child for child in running if child in ready]:
            try:
                print(child.recv(), flush=True)
            except EOFError:
                running.remove(child)


def _end_with_parent() -> NoReturn:
    """Wait for the end of standard input, which the parent keeps open, then end the children."""
    os.read(0, 1)
    _kill(0)
    os._exit(1)


def _import_all(cells: Iterator[str]) -> None:
    """Run the cells that only import, so that it is not done in every child."""
    for cell in cells:
        with suppress(Exception):  # will be that of the notebook
            if all(isinstance(node, ast.Import | ast.ImportFrom) for node in ast.parse(cell).body):
                exec(cell, {})


def _run_cells(number: int, cells: Sequence[str], parent: Connection) -> None:
    """Run the cells of a notebook up to the first that fails, and send the answers."""
    os.dup2(2, 1)  # what a library prints is no answer
    shell = InteractiveShell.instance(config=Config(HistoryManager={"enabled": False}))
    for cell in cells:
        outputs, error = _run_cell(shell, cell)
        parent.send(json.dumps([number, outputs, error]))
        if error:
            return


def _run_cell(shell: InteractiveShell, cell: str) -> tuple[list[dict], list[str] | None]:
    """Run a cell: its outputs as Jupyter stores them, and the name, text and place of its error."""
    shell.display_pub = CapturingDisplayPublisher()
    shell.display_trap.hook = CapturingDisplayHook(shell, shell.display_pub.outputs)
    streams = {"stdout": StringIO(), "stderr": StringIO()}
    with redirect_stdout(streams["stdout"]), redirect_stderr(streams["stderr"]):
        result = shell.run_cell(cell)
    if error := result.error_before_exec or result.error_in_exec:
        return [], [type(error).__name__, str(error), "".join(format_exception(error))]
    outputs: list[dict] = [
        {"output_type": "stream", "name": name, "text": stream.getvalue()}
        for name, stream in streams.items()
        if stream.getvalue()
    ]
    for shown in shell.display_pub.outputs:
        kind = "display_data" if "transient" in shown else "execute_result"
        counted = {} if "transient" in shown else {"execution_count": None}
        parts = {"data": shown["data"], "metadata": shown["metadata"]}
        outputs.append({"output_type": kind, **parts, **counted})
    return outputs, None


if __name__ == "__main__":
    _serve()
