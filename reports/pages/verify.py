"""Check pages and results: their bytes, and the records of missions that are simulated again.

A page contains a checksum of its text and the evidence of its studies (``Evidence``): what they
were made with, and a sample of their missions. A results folder contains all missions, and every
file name has a hash of the file. If somebody changes both the content and the hash, simulating
missions again still shows the difference.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np
import pandas as pd
import pyarrow as pa

from dess import InputError, simulate
from dess.analysis.bound import upper_bound
from dess.analysis.execution.effort import check_missions
from dess.analysis.results import commands
from dess.analysis.results.chunks import MANIFEST
from dess.analysis.results.evidence import Evidence, SampleMission, draw_numbers, learned_files
from dess.analysis.results.parquet import EVENTS
from dess.analysis.results.resimulate import difference_in_words, record_of
from dess.analysis.results.store import Store
from dess.analysis.results.tables import Results, results_of
from dess.base.files.reading import paths_in
from dess.base.libraries import missing
from dess.model.events import PARAMETER_EVENTS
from dess.policies.registry import Policy, is_confirmed, load_team
from dess.reports.pages.page import LIMIT, PAGE_FORM, PANEL, Page
from dess.scenario.scenario import ScenarioSpace

BOUNDS_CHECKED = 3  # upper bounds that are computed again at most, since each takes seconds

_PAGE_OR_FOLDER = f"{PAGE_FORM}, or a results folder"

_Item = TypeVar("_Item")
_Drawn = Sequence[tuple[SampleMission, ScenarioSpace, list[Policy]]]


@dataclass(frozen=True)
class Check:
    """The result of a check.

    Attributes:
        what: What was checked: the name of a study, or another part of a page.
        compared: The number of missions or files that were compared, those that differ included.
        differing: A line for every mission or file that differs.
        notes: How the code and libraries differ from those that made the results.
    """

    what: str
    compared: int
    differing: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


@dataclass
class _Sampling:
    """Which missions are simulated again, and how long all of them take.

    Attributes:
        missions: The largest number of missions of every study.
        seed: Seed of the random choice.
        named: Policies and processes of Python files that the user has named.
        yes: Whether any time and memory is allowed.
        seconds: The longest time that the missions so far can take [s].
    """

    missions: int
    seed: int
    named: Collection[str] = ()
    yes: bool = False
    seconds: float = 0.0

    def draw_missions(self, missions: Sequence[_Item]) -> list[_Item]:
        """Those of some missions that are simulated again."""
        return [
            missions[number] for number in draw_numbers(len(missions), self.missions, self.seed)
        ]

    def refuse_long_checks(self, what: str, spaces: Sequence[ScenarioSpace]) -> None:
        """Refuse missions that take too much, before the first of them is simulated.

        Raises:
            InputError: If all missions may take more than an hour, or one takes too much memory.
        """
        if not self.yes:
            self.seconds = check_missions(what, spaces, self.seconds)


def verify_page(
    path: Path, missions: int, seed: int, named: Collection[str] = (), yes: bool = False
) -> list[Check]:
    """Check a page: its checksum, the learned policies, and missions of its studies.

    Args:
        path: The page.
        missions: The largest number of missions to simulate again, for every study on the page.
        seed: Seed of the random choice of these missions.
        named: Policies and processes of Python files that the user has named, which may be run.
        yes: Whether missions may take any time.

    Raises:
        InputError: If the file is not a page of dess, a policy cannot be loaded, or the missions
            may take more than an hour.
    """
    page = Page.read(path, LIMIT, _PAGE_OR_FOLDER)
    if not page.has_seal:
        raise InputError(path, "is not a page of dess", _PAGE_OR_FOLDER)
    altered = []
    if not page.is_sealed:
        altered = ["the page has been altered"]
    files = [_check_files(learned.files) for learned in page.learned]
    studies = page.evidence
    notes = []
    if not studies:
        notes = ["contains no missions to simulate again"]
    sampling = _Sampling(missions, seed, named, yes)
    drawn = [
        _draw_missions(evidence, sampling) for evidence in studies
    ]  # all, before any is simulated
    records = [_compare_missions(*pair, named) for pair in zip(studies, drawn, strict=True)]
    panels = [_check_panel(text, page, sampling) for text in page.find_hidden(PANEL)]
    return [Check("page", 1, altered, notes), *files, *panels, *records]


def verify_results(
    folder: Path, missions: int, seed: int, named: Collection[str] = (), yes: bool = False
) -> list[Check]:
    """Check results: the bytes of all files, and the records and event logs of random missions.

    If there are several results folders, one that cannot be read counts as differing, and an
    incomplete one is mentioned in a note.

    Args:
        folder: A results folder, or a folder with results folders.
        missions: The largest number of missions to simulate again, for every study.
        seed: Seed of the random choice of these missions.
        named: Policies and processes of Python files that the user has named, which may be run.
        yes: Whether missions may take any time.

    Raises:
        InputError: If there are no results, they are incomplete, or a policy cannot be loaded.
    """
    folders = [path.parent for path in paths_in(folder, f"**/{MANIFEST}")]
    if not folders:
        raise InputError(folder, "contains no results and is not a page", _PAGE_OR_FOLDER)
    sampling = _Sampling(missions, seed, named, yes)
    if folders == [folder]:
        return _check_study(Store.read(folder), sampling)
    checks = []
    for path in folders:
        try:
            if (store := Store.read(path)).manifest.complete:
                checks += _check_study(store, sampling)
            else:
                checks.append(Check(str(path), 0, notes=["incomplete, so not checked"]))
        except InputError as error:
            checks.append(Check(str(path), 1, [str(error)]))
    return checks


def _check_study(store: Store, sampling: _Sampling) -> list[Check]:
    if damaged := store.contents.damaged:
        lines = [f"{path}: has been changed since it was written" for path in damaged]
        return [Check(f"{store.manifest.study.name}, files", len(store.files), lines)]
    results = results_of(store)
    evidence = Evidence.of(results, sampling.missions, sampling.seed)
    checks = [_compare_missions(evidence, _draw_missions(evidence, sampling), sampling.named)]
    if store.contents.logged:
        checks.append(_check_logs(store, sampling))
    if results.bounds:
        checks.append(_check_bounds(results, sampling))
    return checks


def _draw_missions(evidence: Evidence, sampling: _Sampling) -> _Drawn:
    """The missions of a study that are simulated again, with their scenarios and teams."""
    study = f"study {evidence.study.name}"
    names = (team.policy for team in evidence.policies)
    teams = {name: load_team(name, run_files=is_confirmed(name, sampling.named)) for name in names}
    sample = sampling.draw_missions(evidence.sample)
    spaces = [evidence.space(mission.values) for mission in sample]
    sampling.refuse_long_checks(study, spaces)
    return [
        (mission, space, teams[mission.policy][: space.uavs[1]])
        for mission, space in zip(sample, spaces, strict=True)
    ]


def _compare_missions(evidence: Evidence, drawn: _Drawn, named: Collection[str] = ()) -> Check:
    """Simulate missions again, and compare their records."""
    lines = []
    processes = evidence.load_processes(named)
    for mission, space, team in drawn:
        record = record_of(space, team, evidence.seed, mission.replication, processes)
        if changed := difference_in_words(record, mission.record):
            coordinates = (mission.policy, mission.values, mission.replication)
            command = commands.of_fields(evidence, *coordinates)
            lines.append(f"{changed}; command: {command}")
    return Check(evidence.study.name, len(drawn), lines, evidence.changes_here(named))


def _check_logs(store: Store, sampling: _Sampling) -> Check:
    """Simulate some missions with a stored event log again, and compare the logs."""
    manifest = store.manifest
    lines = []
    logged = sampling.draw_missions(store.contents.logged)
    what = f"study {manifest.study.name}"
    sampling.refuse_long_checks(what, [manifest.scenarios[cell.point] for cell, _ in logged])
    for cell, replication in logged:
        space = manifest.scenarios[cell.point]
        policy = manifest.policies[cell.team].policy
        team = load_team(policy, space.uavs[1], run_files=is_confirmed(policy, sampling.named))
        processes = manifest.load_processes(sampling.named)
        about = (space, team, manifest.seed, replication)
        log = simulate(*about, events=True, processes=processes).events
        stored = store.contents.load_log(cell, replication)
        assert log is not None and stored is not None
        if not stored.to_pandas().equals(
            _match_stored_columns(pd.DataFrame(log.columns()), stored)
        ):
            command = commands.of_folder(store.folder, manifest, cell, replication)
            lines.append(f"the event log differs when simulated again; command: {command}")
    return Check(f"{manifest.study.name}, event logs", len(logged), lines)


def _check_bounds(results: Results, sampling: _Sampling) -> Check:
    """Compute a few upper bounds again, and compare them bit for bit."""
    drawn = sampling.draw_missions([*results.bounds])[:BOUNDS_CHECKED]
    lines = []
    for point, replication in drawn:
        stored = results.bounds[point, replication]
        seed = results.store.manifest.seed
        bound = upper_bound(results.scenario(point), seed, replication)
        if bound.ratio != stored.ratio or not np.array_equal(bound.prices, stored.prices):
            lines.append(
                f"the bound of point {point}, replication {replication} is {stored.ratio}, and "
                f"{bound.ratio} when computed again"
            )
    return Check(f"{results.study.name}, bounds", len(drawn), lines)


def _match_stored_columns(log: pd.DataFrame, stored: pa.Table) -> pd.DataFrame:
    """An event log as it was stored: logs of before lack columns and the parameters."""
    if stored.schema.equals(EVENTS):
        return log
    events = log[~log["event"].isin(PARAMETER_EVENTS)]
    return events[stored.column_names].reset_index(drop=True)


def _check_panel(text: str, page: Page, sampling: _Sampling) -> Check:
    """Make a panel again, with the missions that it is compared with."""
    # It takes the libraries that render pages, which missions do without.
    if absent := missing("reports", "a check of the panel"):
        return Check("panel", 0, notes=[f"not checked: {absent}"])
    from dess.reports.pages.panel import Panel
    from dess.reports.pages.panel_check import check_panel, is_of_another_version
    from dess.reports.pages.panel_missions import CHECKED

    panel = Panel.parse(text, page.where, page.allowed)
    sampling.refuse_long_checks("panel", [*panel.spaces])
    notes = []
    if is_of_another_version(panel):
        notes = ["made with another version of the engine, so only its missions are checked"]
    return Check("panel", CHECKED, check_panel(panel, page.text), notes)


def _check_files(files: Mapping[str, str]) -> Check:
    """Compare the hashes of the learned policies on a page with those of the files here."""
    shipped = learned_files()
    others = [name for name, digest in files.items() if shipped.get(name) != digest]
    return Check(
        "learned policies", len(files), [f"{name}: differs from the file here" for name in others]
    )
