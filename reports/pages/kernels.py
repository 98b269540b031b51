"""Run notebooks with nbclient, each in a Jupyter kernel of its own, two at a time.

A kernel listens in a folder that only this user can read, and on no network.
"""

import asyncio
import logging
import os
import sys
from collections.abc import Callable, Coroutine, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryFile, gettempdir
from typing import IO, Any

from jupyter_client.kernelspec import KernelSpecManager
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from nbformat import NotebookNode
from nbformat.v4 import new_output

import dess
from dess import InputError
from dess.base.files.locks import temporary_folder
from dess.reports.pages import ASKED
from dess.reports.pages.missing import Progress
from dess.reports.pages.notebook import Report

log = logging.getLogger(__name__)

AT_ONCE = 2
STARTUP = 600  # for which a kernel is waited for on a busy machine [s]
_FOLDER = "dess-pages-"  # beginning of the name of the folder in which the notebooks run
# The path of a socket may have 104 characters, of which those in ``_FOLDER`` need some 30.
LONGEST = 70
PACKAGES = Path(dess.__file__).parents[1]  # the folder from which this package was imported
# What a library writes to the streams of the process is no output of a cell.
_OPTIONS = ["--IPKernelApp.capture_fd_output=False", "--InteractiveShell.colors=nocolor"]


def run_reports(reports: Sequence[Report], progress: Progress | None = None) -> None:
    """Run reports. If one fails, the error is stored in it and the others are still run.

    Args:
        reports: The reports, which get the outputs of their cells.
        progress: Called after every cell.

    Raises:
        InputError: If a notebook refuses its parameters or results.
    """
    total = sum(len(report.cells) for report in reports)

    def show(report: Report) -> None:
        if progress:
            progress(sum(report.done for report in reports), total, report.name)

    with temporary_folder(_parent_of_sockets(), _FOLDER) as home:
        runs = [
            _Run(report, home, home / f"{number}.json") for number, report in enumerate(reports)
        ]
        _wait_for(_run_all(runs, show))


def _parent_of_sockets() -> Path:
    """The folder for temporary files; ``/tmp`` if its path is too long for a socket in it."""
    folder = gettempdir()
    return Path(folder if len(os.fsencode(folder)) <= LONGEST else "/tmp")  # noqa: S108 - see above


def _wait_for(work: Coroutine[Any, Any, None]) -> None:
    """Run a coroutine in another thread, and cancel it if this one is interrupted.

    This thread may have a loop of events that runs, such as that of Jupyter.
    """
    loop = asyncio.new_event_loop()

    def cancel_all() -> None:
        for task in asyncio.all_tasks(loop):
            task.cancel()

    with closing(loop), ThreadPoolExecutor(1) as thread:
        try:
            thread.submit(loop.run_until_complete, work).result()
        except KeyboardInterrupt:
            loop.call_soon_threadsafe(cancel_all)
            raise


async def _run_all(runs: Sequence["_Run"], show: Callable[[Report], None]) -> None:
    gate = asyncio.Semaphore(AT_ONCE)

    async def run_in_turn(run: _Run) -> None:
        async with gate:
            await run.run_cells(show)

    try:
        async with asyncio.TaskGroup() as group:
            for run in runs:
                group.create_task(run_in_turn(run))
    except ExceptionGroup as errors:
        raise errors.exceptions[0] from None


class _Run:
    """A run of a report in a kernel, which writes to the folder ``home`` only.

    The sockets of the kernel stand beside ``file``, which has their names.
    """

    def __init__(self, report: Report, home: Path, file: Path):
        self.report = report
        self.home = home
        self.kernel = AsyncKernelManager(
            kernel_spec_manager=KernelSpecManager(kernel_dirs=[]),  # none but this Python
            transport="ipc",
            connection_file=str(file),
        )
        self.client = NotebookClient(
            report.notebook,
            km=self.kernel,
            startup_timeout=STARTUP,
            extra_arguments=_OPTIONS,
            coalesce_streams=True,
            record_timing=False,
            store_widget_state=False,
        )

    async def run_cells(self, show: Callable[[Report], None]) -> None:
        """Run the cells up to the first that fails; ``show`` is called after each.

        Raises:
            InputError: If a cell refuses its input.
        """
        with TemporaryFile() as errors:
            try:
                await self._start_kernel(errors)
                for number, cell in enumerate(self.client.nb.cells):
                    if cell.cell_type == "code":
                        await self._run_cell(cell, number)
                        show(self.report)
            except CellExecutionError as error:
                self._store_error(error)
            except RuntimeError:
                errors.seek(0)
                last = errors.read().decode("utf-8", "replace").strip().splitlines()[-1:]
                place = _describe_cell(self.report)
                self.report.failure = ": ".join([place, "its process ended", *last])
            finally:
                await self._end_kernel()

    async def _start_kernel(self, errors: IO[bytes]) -> None:
        """Start the kernel in a session of its own, which keeps Ctrl-C from it.

        Args:
            errors: What the process reports is written to it.
        """
        environment = _process_environment(self.home)
        environment[ASKED] = ",".join(self.report.formats)
        streams = {"stdout": errors, "stderr": errors}
        await self.client.async_start_new_kernel(cwd=self.home, env=environment, **streams)
        await self.client.async_start_new_kernel_client()

    async def _run_cell(self, cell: NotebookNode, number: int) -> None:
        cell.outputs = []
        await self.client.async_execute_cell(cell, number)
        cell.outputs = [_without_counter(output) for output in cell.outputs]
        for warning in (output for output in cell.outputs if output.get("name") == "stderr"):
            log.warning(warning["text"].rstrip())
        self.report.done += 1

    async def _end_kernel(self) -> None:
        """Kill the kernel and its children."""
        if self.client.kc:
            self.client.kc.stop_channels()
        if self.kernel.has_kernel:
            await self.kernel.shutdown_kernel(now=True)

    def _store_error(self, error: CellExecutionError) -> None:
        """Store the error of a cell in its report.

        Raises:
            InputError: If the cell refuses its input.
        """
        from nbconvert.filters.ansi import strip_ansi

        if error.ename == InputError.__name__:
            problem, _, allowed = error.evalue.partition("; allowed: ")
            raise InputError(f"report {self.report.name}", problem, allowed) from None
        self.report.cells[self.report.done].outputs = []
        self.report.failure = f"{_describe_cell(self.report)}: {error.ename}: {error.evalue}"
        self.report.traceback = strip_ansi(error.traceback)


def _without_counter(output: NotebookNode) -> NotebookNode:
    """The output of a cell; its last value without the number of the cell."""
    if output.output_type == "execute_result":
        return new_output("display_data", output.data, metadata=output.metadata)
    return output


def _describe_cell(report: Report) -> str:
    """The cell that was begun last: its number among the cells with code, and its first line."""
    first_line = report.cells[report.done].source.strip().partition("\n")[0]
    return f"report {report.name}: cell {report.done + 1} of {len(report.cells)} ({first_line})"


def _process_environment(home: Path) -> dict[str, str]:
    """The environment of a kernel that writes to ``home`` only.

    An empty entry of the path means the working directory of this process, where anything may lie.
    """
    from matplotlib import get_cachedir

    path = [*(os.path.abspath(entry) for entry in sys.path if entry), str(PACKAGES)]
    return {
        **os.environ,
        "IPYTHONDIR": str(home),
        "PYTHONPATH": os.pathsep.join(path),
        "PYTHONSAFEPATH": "1",  # do not put the working directory in front of it
        "OMP_NUM_THREADS": "1",
        "TQDM_DISABLE": "1",  # a page shows no progress bar
        "MPLBACKEND": "agg",
        "MPLCONFIGDIR": get_cachedir(),
    }
