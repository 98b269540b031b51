"""Run notebooks in Jupyter kernels, two at a time.

A kernel imports the same modules as this process, computes in one thread and writes nothing into
the user's home folder. It works in a new folder of its own, so it never imports or reads a file
that merely lies beside results, such as ``pandas.py`` or ``matplotlibrc``. A kernel that dies
before its first cell is started a second time.
"""

import atexit
import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from pathlib import Path
from tempfile import TemporaryFile, gettempdir
from threading import Lock
from typing import Any

import matplotlib as mpl
from jupyter_client.kernelspec import NATIVE_KERNEL_NAME, KernelSpecManager
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from nbconvert.filters import strip_ansi
from nbformat import NotebookNode

from dess import InputError
from dess.files.locks import temporary_folder
from reports.pages.notebook import Report

# Called after every cell, with the number of cells run so far and of all cells, and the report.
Progress = Callable[[int, int, str], None]

AT_ONCE = 2
HOME = "dess-kernel-"  # beginning of the names of the kernels' folders
PACKAGES = Path(__file__).parents[2]  # the folder from which this package was imported
LONGEST_SOCKET_PATH = 90  # characters; systems allow about 100


class Kernels:
    """Runs reports, each in a kernel of its own."""

    def __init__(self, progress: Progress | None = None):
        self.progress = progress
        self._clients: list[NotebookClient] = []
        self._lock, self._stopped = Lock(), False

    def run(self, reports: Sequence[Report]) -> None:
        """Run reports. If one fails, the error is stored in it and the others are still run.

        Raises:
            InputError: If a notebook refuses its parameters or results.
        """
        # In threads: in the main thread, nbclient would handle Ctrl-C itself.
        with ThreadPoolExecutor(AT_ONCE) as pool:
            futures = [pool.submit(self._execute, report, reports) for report in reports]
            try:
                for future in futures:
                    future.result()
            except BaseException:
                self._stop(futures)
                raise

    def _stop(self, futures: Sequence[Future]) -> None:
        """Kill the kernels until no report is running."""
        self._stopped = True
        for future in futures:
            future.cancel()
        while any(not future.done() for future in futures):
            for client in self._clients:
                kernel: Any = client.km
                # A kernel that ends meanwhile takes its process away: look at it once only.
                if process := getattr(kernel.provisioner, "process", None):
                    process.kill()
            wait(futures, timeout=0.2)

    def _execute(self, report: Report, reports: Sequence[Report]) -> None:
        """Run a report; start a second kernel if the first one dies before the first cell."""
        for is_last in (False, True):
            try:
                with temporary_folder(Path(gettempdir()), HOME) as home:
                    client = self._client(report, reports, home)
                    self._clients.append(client)
                    _run(client, home)
                return
            except CellExecutionError as error:
                if error.ename == InputError.__name__:
                    raise InputError(f"report {report.name}: {error.evalue}") from error
                report.failure = f"{_cell(report)}: {error.ename}: {error.evalue}"
                report.traceback = strip_ansi(error.traceback)
                return
            except RuntimeError as error:  # the kernel did not start, or died
                if report.done or is_last or self._stopped:
                    report.failure = f"{_cell(report)}: {error}"
                    return

    def _client(self, report: Report, reports: Sequence[Report], home: Path) -> NotebookClient:
        """A client that runs a report in a folder and stores its progress in the report."""

        def begin(cell: NotebookNode, **_: Any) -> None:
            report.begun = cell.id

        def count(**_: Any) -> None:
            with self._lock:
                report.done += 1
                if self.progress:
                    done, total = sum(r.done for r in reports), sum(len(r.cells) for r in reports)
                    self.progress(done, total, report.name)

        return NotebookClient(
            report.notebook,
            km=_manager(home),
            resources={"metadata": {"path": str(home)}},
            on_cell_execute=begin,
            on_cell_complete=count,
            timeout=None,
            record_timing=False,
            coalesce_streams=True,
        )


def _cell(report: Report) -> str:
    """The cell that was begun last: its number among the cells with code, and its first line."""
    number = [cell.id for cell in report.cells].index(report.begun) if report.begun else 0
    first_line = report.cells[number].source.strip().partition("\n")[0]
    return f"report {report.name}: cell {number + 1} of {len(report.cells)} ({first_line})"


def _run(client: NotebookClient, home: Path) -> None:
    """Run a notebook; what the kernel itself reports does not go to the user's terminal.

    Raises:
        RuntimeError: If the kernel does not start or dies, with the last line that it reported.
    """
    with TemporaryFile() as log:
        try:
            client.execute(env=_environment(home), cleanup_kc=True, stdout=log, stderr=log)
        except RuntimeError as error:
            log.seek(0)
            reported = log.read().decode("utf-8", "replace").strip().splitlines()
            raise RuntimeError(": ".join([str(error), *reported[-1:]])) from error
        finally:  # nbclient leaves its exit handler behind when a kernel dies at its start
            atexit.unregister(client._cleanup_kernel)


def _manager(home: Path) -> AsyncKernelManager:
    """A manager of kernels of this interpreter; a kernel "python3" may use another interpreter."""
    manager = AsyncKernelManager(
        kernel_name=NATIVE_KERNEL_NAME,
        kernel_spec_manager=KernelSpecManager(kernel_dirs=[]),
        connection_file=str(home / "kernel.json"),
    )
    sockets = str(home / "kernel")
    if os.name == "posix" and len(sockets) < LONGEST_SOCKET_PATH:  # sockets need no free ports
        manager.transport, manager.ip = "ipc", sockets
    return manager


def _environment(home: Path) -> dict[str, str]:
    """The environment of a kernel that writes to ``home`` only.

    An empty entry of the path means the working directory of this process, where anything may lie.
    """
    folders = ("IPYTHONDIR", "JUPYTER_CONFIG_DIR", "JUPYTER_RUNTIME_DIR")
    path = [*(os.path.abspath(entry) for entry in sys.path if entry), str(PACKAGES)]
    return {
        **os.environ,
        **dict.fromkeys(folders, str(home)),
        "PYTHONPATH": os.pathsep.join(path),
        "PYTHONSAFEPATH": "1",  # do not put the working directory in front of it
        "OMP_NUM_THREADS": "1",
        "TQDM_DISABLE": "1",  # a page shows no progress bar
        "MPLBACKEND": "agg",
        "MPLCONFIGDIR": mpl.get_cachedir(),
    }
