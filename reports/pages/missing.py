"""The missions and times that pages show beside the results of studies, simulated if missing."""

from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

from dess.analysis.results.tables import load_results

# Called with the number of steps done, of all steps, and what they are: missions or a report.
Progress = Callable[[int, int, str], None]

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
