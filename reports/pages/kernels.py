"""Runs notebooks in kernels of their own, some at once."""

import atexit
import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock
from typing import Any

import matplotlib as mpl
from jupyter_client.kernelspec import NATIVE_KERNEL_NAME, KernelSpecManager
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from nbconvert.filters import strip_ansi
from nbformat import NotebookNode

from dess.errors import InputError
from reports.pages.notebook import Report

# Called with the cells done and the cells in all, of all reports, and the name of this one.
Progress = Callable[[int, int, str], None]

AT_ONCE = 2


class Kernels:
    """Runs reports in the folder that holds their results."""

    def __init__(self, results: Path, progress: Progress | None = None):
        self.results, self.progress = results, progress
        self._clients: list[NotebookClient] = []
        self._lock, self._stopped = Lock(), False

    def run(self, reports: Sequence[Report]) -> None:
        """Run reports; one that fails notes it, the others go on.

        Raises:
            InputError: If a notebook refuses what it was given.
        """
        # In threads: in this one, nbclient would take Ctrl-C for itself.
        with ThreadPoolExecutor(AT_ONCE) as pool:
            running = [pool.submit(self._execute, report, reports) for report in reports]
            try:
                for future in running:
                    future.result()
            except BaseException:
                self._stop(running)
                raise

    def _stop(self, running: Sequence[Future]) -> None:
        self._stopped = True
        for future in running:
            future.cancel()
        while any(not future.done() for future in running):
            for client in self._clients:
                kernel: Any = client.km
                if kernel.has_kernel:
                    kernel.provisioner.process.kill()
            wait(running, timeout=0.2)

    def _execute(self, report: Report, reports: Sequence[Report]) -> None:
        """Run a report; once more if its kernel dies before the first cell."""

        def begin(cell: NotebookNode, **_: Any) -> None:
            report.begun = cell.id

        def count(**_: Any) -> None:
            with self._lock:
                report.done += 1
                if self.progress:
                    done, total = sum(r.done for r in reports), sum(len(r.cells) for r in reports)
                    self.progress(done, total, report.name)

        for attempt in (1, 2):
            try:
                with TemporaryDirectory() as home:
                    folder = self.results if "results" in report.parameters else Path(home)
                    client = _client(report.notebook, folder, Path(home), begin, count)
                    self._clients.append(client)
                    _run(client, _environment(Path(home)))
                return
            except CellExecutionError as error:
                if error.ename == InputError.__name__:
                    raise InputError(f"report {report.name}: {error.evalue}") from error
                report.failure = f"{_cell(report)}: {error.ename}: {error.evalue}"
                report.traceback = strip_ansi(error.traceback)
                return
            except RuntimeError as error:  # the kernel did not start, or died
                if report.done or attempt == 2 or self._stopped:
                    report.failure = f"{_cell(report)}: {error}"
                    return


def _cell(report: Report) -> str:
    """The cell that failed, the last that was begun, by its number among those that are run."""
    number = [cell.id for cell in report.cells].index(report.begun) if report.begun else 0
    first = report.cells[number].source.strip().partition("\n")[0]
    return f"report {report.name}: cell {number + 1} of {len(report.cells)} ({first})"


def _run(client: NotebookClient, environment: dict[str, str]) -> None:
    try:
        client.execute(env=environment, cleanup_kc=True)
    finally:  # nbclient leaves its exit handler behind when a kernel dies at its start
        atexit.unregister(client._cleanup_kernel)


def _client(
    notebook: NotebookNode, folder: Path, home: Path, begin: Any, count: Any
) -> NotebookClient:
    # No kernel specs but the built-in one: an installed "python3" may be another interpreter's.
    kernel = AsyncKernelManager(
        kernel_name=NATIVE_KERNEL_NAME,
        kernel_spec_manager=KernelSpecManager(kernel_dirs=[]),
        connection_file=str(home / "kernel.json"),
    )
    sockets = home / "kernel"
    if os.name == "posix" and len(str(sockets)) < 90:  # no ports to clash on; paths must be short
        kernel.transport, kernel.ip = "ipc", str(sockets)
    return NotebookClient(
        notebook,
        km=kernel,
        resources={"metadata": {"path": str(folder)}},
        on_cell_execute=begin,
        on_cell_complete=count,
        timeout=None,
        record_timing=False,
        coalesce_streams=True,
    )


def _environment(home: Path) -> dict[str, str]:
    """The kernel imports what this process imports and leaves nothing in the user's home.

    It computes in one thread: those of two kernels would be in each other's way.
    """
    own = {name: str(home) for name in ("IPYTHONDIR", "JUPYTER_CONFIG_DIR", "JUPYTER_RUNTIME_DIR")}
    path = os.pathsep.join(os.path.abspath(entry) for entry in sys.path)
    return {
        **os.environ,
        **own,
        "PYTHONPATH": path,
        "OMP_NUM_THREADS": "1",
        "MPLBACKEND": "agg",
        "MPLCONFIGDIR": mpl.get_cachedir(),
    }
