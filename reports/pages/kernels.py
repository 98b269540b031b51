"""Run notebooks, each in a process of its own, after the missions that only its page needs."""

import json
import logging
import os
import subprocess
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile, gettempdir
from typing import IO, Any

from nbformat import from_dict

import dess
from dess import InputError
from dess.analysis.results.tables import load_results
from dess.base.files.writing import temporary_folder
from dess.reports.pages import ASKED, cells
from dess.reports.pages.cells import kill_group
from dess.reports.pages.notebook import Report

log = logging.getLogger(__name__)

# Called after every cell, with the number of cells run so far and of all cells, and the report.
Progress = Callable[[int, int, str], None]

HOME = "dess-pages-"  # beginning of the name of the folder in which the notebooks run
PACKAGES = Path(dess.__file__).parents[1]  # the folder from which this package was imported


def run_reports(
    reports: Sequence[Report], progress: Progress | None = None, shared: Sequence[Path] = ()
) -> None:
    """Run reports. If one fails, the error is stored in it and the others are still run.

    Args:
        reports: The reports, which get the outputs of their cells.
        progress: Called after every cell.
        shared: Results folders that several of them read, and that are loaded once.

    Raises:
        InputError: If a notebook refuses its parameters or results.
    """
    if not reports:
        return
    total = sum(len(report.cells) for report in reports)
    codes = [[cell.source for cell in report.cells] for report in reports]
    work = {"cells": codes, "folders": [str(folder.absolute()) for folder in shared]}
    with temporary_folder(Path(gettempdir()), HOME) as home, TemporaryFile() as errors:
        formats = dict.fromkeys(kind for report in reports for kind in report.formats)
        with _start_process(home, errors, formats) as (asked, answers):
            with suppress(BrokenPipeError):
                asked.write(json.dumps(work).encode() + b"\n")
                asked.flush()
            for number, outputs, error in map(json.loads, answers):
                report = reports[number]
                report.cells[report.done].outputs = [from_dict(output) for output in outputs]
                for warning in (output for output in outputs if output.get("name") == "stderr"):
                    log.warning(warning["text"].rstrip())
                if error:
                    _store_error(report, error)
                    continue
                report.done += 1
                if progress:
                    progress(sum(report.done for report in reports), total, report.name)
        for report in reports:
            if report.done < len(report.cells) and not report.failure:
                errors.seek(0)
                last = errors.read().decode("utf-8", "replace").strip().splitlines()[-1:]
                report.failure = ": ".join([_describe_cell(report), "its process ended", *last])


def _store_error(report: Report, error: dict[str, Any]) -> None:
    """Store the error of a cell in its report, or raise it if the notebook refuses its input."""
    if error["refusal"]:
        raise InputError(*error["refusal"]).within(f"report {report.name}")
    report.failure = f"{_describe_cell(report)}: {error['text']}"
    report.traceback = error["traceback"]


def _describe_cell(report: Report) -> str:
    """The cell that was begun last: its number among the cells with code, and its first line."""
    first_line = report.cells[report.done].source.strip().partition("\n")[0]
    return f"report {report.name}: cell {report.done + 1} of {len(report.cells)} ({first_line})"


@contextmanager
def _start_process(
    home: Path, errors: IO[bytes], formats: Iterable[str]
) -> Iterator[tuple[IO[bytes], IO[bytes]]]:
    """Input and output of the process that runs notebooks in a folder; it is killed at the end.

    Its figures are files as well, in some formats.

    A session of its own keeps Ctrl-C from it and its children, and makes them a group to kill.
    """
    process = subprocess.Popen(
        [sys.executable, "-m", cells.__name__],
        cwd=home,
        env=_process_environment(home) | {ASKED: ",".join(formats)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=errors,
        start_new_session=True,
    )
    assert process.stdin
    assert process.stdout
    try:
        yield process.stdin, process.stdout
    finally:
        kill_group(process.pid)
        process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout):
            with suppress(BrokenPipeError):
                stream.close()


def _process_environment(home: Path) -> dict[str, str]:
    """The environment of a process that writes to ``home`` only.

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


COMPARISON = "comparison"  # the name of the page and of its study
# The pages that show times of decisions, and their studies.
TIMED = {COMPARISON: COMPARISON, "planner": "planning", "seas": "seas"}


def simulate_missing(
    pages: Collection[str],
    results: Path,
    parameters: Mapping[str, Any],
    progress: Progress | None = None,
) -> None:
    """Simulate the missions that are missing.

    Args:
        pages: Names of reports; those that need no missions are ignored.
        results: The folder that contains a results folder per study.
        parameters: Values for the parameters of the notebooks.
        progress: Called after every mission.

    Raises:
        InputError: If results are damaged, a parameter is refused or nothing can be written.
    """
    if not {COMPARISON, *TIMED} & {*pages}:
        return  # what follows takes its time to import
    from dess.analysis.answers.missions import keep_logs
    from dess.analysis.answers.policies.decision_times import ensure_decision_times
    from dess.analysis.answers.policies.pairs import missions_to_draw, pair_missions, pair_of

    def show(done: int, total: int) -> None:
        if progress:
            progress(done, total, "missions")

    if COMPARISON in pages:
        study = load_results(results / COMPARISON)
        pair = pair_of(study, parameters.get("learned"), parameters.get("heuristic"))
        drawn = missions_to_draw(pair_missions(study, pair), pair)
        keep_logs(study, drawn, show)
    for page in TIMED.keys() & {*pages}:
        ensure_decision_times(load_results(results / TIMED[page]), show)
