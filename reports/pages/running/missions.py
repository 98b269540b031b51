"""Missions that pages need in addition to the results of their studies.

The notebooks of these pages do not simulate. Before they run, some missions are simulated again and
stored in the folder ``cross-check`` beside the results. Missions that are already there and belong
to the same results are not simulated again::

    make(["verification"], Path("results"), {})
"""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from analysis.questions import decision_times, head_to_head
from analysis.questions.missions import keep_logs
from analysis.results.tables import load_results
from analysis.verification import measurements
from reports.pages.running.kernels import Progress

COMPARISON, VERIFICATION = "comparison", "verification"  # names of the pages and of their studies
# The pages that show times of decisions, and their studies.
TIMED = {COMPARISON: COMPARISON, "planner": "gap", "seas": "seas"}


def make(
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

    def show(done: int, total: int) -> None:
        if progress:
            progress(done, total, "missions")

    if COMPARISON in pages:
        study = load_results(results / COMPARISON)
        pair = head_to_head.pair_of(study, parameters.get("learned"), parameters.get("heuristic"))
        drawn = head_to_head.drawn(head_to_head.duels(study, pair), pair)
        keep_logs(study, drawn, results, show)
    for page in TIMED.keys() & {*pages}:
        decision_times.make(results, load_results(results / TIMED[page]), show)
    if VERIFICATION in pages:
        measurements.make(results, load_results(results / VERIFICATION), show)
