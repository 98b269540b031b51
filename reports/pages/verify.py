"""Checks of pages and results: their bytes, and the records of missions simulated again.

A page has a checksum of the rest of it, and the evidence of its studies (``Evidence``): what they
were made with, and some of their missions. Results have all missions, and a hash in every file's
name. Whoever forges both is found by simulating missions again.
"""

import re
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

import pandas as pd
from pydantic import TypeAdapter, ValidationError

from analysis.results.evidence import Evidence, chosen, learned_files
from analysis.results.resimulate import difference
from analysis.results.store import MANIFEST, Store
from analysis.results.tables import results_of
from dess import InputError, simulate
from policies import load_team
from reports.pages.html import FILES, STUDY, embedded

# Where a page carries the checksum of all the rest of it.
_SEAL = re.compile(r'(<meta name="dess-checksum" content=")([0-9a-f]*)(">)')
_ALLOWED = "allowed: a page of dess report, or a results folder"


@dataclass(frozen=True)
class Check:
    """What came of a check.

    Attributes:
        what: Was checked: a study, by its name, or something else that goes with pages.
        compared: The number of missions, or files.
        differing: A line for every one that differs.
        notes: How the code and libraries differ from those that made the results.
    """

    what: str
    compared: int
    differing: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def sealed(html: str) -> str:
    """A page with its checksum filled in."""
    checksum = sha256(_SEAL.sub(r"\g<1>\g<3>", html, count=1).encode()).hexdigest()
    return _SEAL.sub(rf"\g<1>{checksum}\g<3>", html, count=1)


def is_sealed(html: str) -> bool:
    """Whether a page has a checksum, and it is that of the page."""
    return _SEAL.search(html) is not None and sealed(html) == html


def verify_page(path: Path, missions: int, seed: int) -> list[Check]:
    """Check a page: its checksum, the learned policies, and missions of its studies.

    Args:
        path: The page.
        missions: How many to simulate again, at most, of every study that it shows.
        seed: Of their choice.

    Raises:
        InputError: If it is no page of dess, or a policy is not there.
    """
    try:
        html = path.read_bytes().decode()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {error}; {_ALLOWED}") from None
    if not _SEAL.search(html):
        raise InputError(f"{path}: is no page of dess; {_ALLOWED}")
    altered = [] if is_sealed(html) else ["the page has been altered"]
    files = [_check_files(text, path) for text in embedded(FILES, html)]
    studies = [Evidence.parse(text, str(path), _ALLOWED) for text in embedded(STUDY, html)]
    notes = [] if studies else ["carries no missions to simulate again"]
    records = [check_records(evidence, missions, seed) for evidence in studies]
    return [Check("page", 1, altered, notes), *files, *records]


def verify_results(folder: Path, missions: int, seed: int) -> list[Check]:
    """Check results: the bytes of all files, and missions drawn at random, with logs and without.

    Of several folders, one that cannot be read differs, and an incomplete one is noted.

    Args:
        folder: A results folder, or one that holds such.
        missions: How many to simulate again, at most, of every study.
        seed: Of their choice.

    Raises:
        InputError: If there are no results, they are incomplete, or a policy is not there.
    """
    folders = sorted(path.parent for path in folder.rglob(MANIFEST))
    if not folders:
        raise InputError(f"{folder}: holds no results and is no page; {_ALLOWED}")
    if folders == [folder]:
        return _check_study(Store.read(folder), missions, seed)
    checks = []
    for path in folders:
        try:
            if (store := Store.read(path)).manifest.complete:
                checks += _check_study(store, missions, seed)
            else:
                checks.append(Check(str(path), 0, notes=["incomplete, so not checked"]))
        except InputError as error:
            checks.append(Check(str(path), 0, [str(error)]))
    return checks


def _check_study(store: Store, missions: int, seed: int) -> list[Check]:
    if store.damaged:
        lines = [f"{path}: is not what was written" for path in store.damaged]
        return [Check(store.manifest.study["name"], 0, lines)]
    records = check_records(Evidence.of(results_of(store), missions, seed), missions, seed)
    return [records, _check_logs(store, missions, seed)] if store.logged else [records]


def check_records(evidence: Evidence, missions: int, seed: int) -> Check:
    """Simulate a random part of the sample again, with the SimPy engine, and compare the records.

    Args:
        evidence: Of the study.
        missions: How many, at most.
        seed: Of the choice.

    Raises:
        InputError: If a policy does not exist, or a scenario is not valid.
    """
    lines, numbers = [], chosen(len(evidence.sample), missions, seed)
    for mission in (evidence.sample[number] for number in numbers):
        policy, values, replication = mission.policy, mission.values, mission.replication
        record = simulate(evidence.space(values), load_team(policy), evidence.seed, replication)
        if changed := difference(record, mission.record):
            command = evidence.simulate_command(policy, values, replication)
            lines.append(f"{changed}; command: {command}")
    return Check(evidence.study["name"], len(numbers), lines, evidence.changes_here)


def _check_logs(store: Store, missions: int, seed: int) -> Check:
    """Simulate some of the missions again whose event logs are kept, and compare the logs."""
    manifest, logged, lines = store.manifest, store.logged, []
    numbers = chosen(len(logged), missions, seed)
    for cell, replication in (logged[number] for number in numbers):
        team = load_team(manifest.policies[cell.team].policy)
        space = manifest.scenarios[cell.point]
        log = simulate(space, team, manifest.seed, replication, events=True).events
        stored = store.load_log(cell, replication)
        assert log is not None and stored is not None
        if not stored.to_pandas().equals(pd.DataFrame(log.columns())):
            command = manifest.command(cell, replication)
            lines.append(f"the event log is another one when simulated again; command: {command}")
    return Check(f"{manifest.study['name']}, event logs", len(numbers), lines)


def _check_files(text: str, path: Path) -> Check:
    """Compare the hashes of the learned policies on a page with those of the files here."""
    try:
        files = TypeAdapter(dict[str, str]).validate_json(text)
    except ValidationError:
        raise InputError(f"{path}: its list of files is none; {_ALLOWED}") from None
    shipped = learned_files()
    others = [name for name, digest in files.items() if shipped.get(name) != digest]
    return Check(
        "learned policies", len(files), [f"{name}: is another one here" for name in others]
    )
