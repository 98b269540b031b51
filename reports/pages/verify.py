"""Check pages and results: their bytes, and the records of missions that are simulated again.

A page contains a checksum of its text and the evidence of its studies (``Evidence``): what they
were made with, and a sample of their missions. A results folder contains all missions, and every
file name has a hash of the file. If somebody changes both the content and the hash, simulating
missions again still shows the difference.
"""

import re
from collections.abc import Collection
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

import pandas as pd
from pydantic import TypeAdapter, ValidationError

from analysis.results import commands
from analysis.results.evidence import Evidence, chosen, learned_files
from analysis.results.files import MANIFEST
from analysis.results.resimulate import difference
from analysis.results.store import Store
from analysis.results.tables import results_of
from dess import InputError, simulate
from dess.files import read_text
from policies import load_team
from policies.registry import check_no_files
from reports.pages.html import FILES, STUDY, embedded

LIMIT = 256 * 2**20  # bytes of the largest page

# The place in a page that contains the checksum of the rest of the page.
_SEAL = re.compile(r'(<meta name="dess-checksum" content=")([0-9a-f]*)(">)')
_ALLOWED = "allowed: a page of dess report, or a results folder"


@dataclass(frozen=True)
class Check:
    """The result of a check.

    Attributes:
        what: What was checked: the name of a study, or another part of a page.
        compared: The number of missions or files that were compared.
        differing: A line for every mission or file that differs.
        notes: How the code and libraries differ from those that made the results.
    """

    what: str
    compared: int
    differing: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def sealed(html: str) -> str:
    """The page with its checksum filled in."""
    checksum = sha256(_SEAL.sub(r"\g<1>\g<3>", html, count=1).encode()).hexdigest()
    return _SEAL.sub(rf"\g<1>{checksum}\g<3>", html, count=1)


def is_sealed(html: str) -> bool:
    """Whether the checksum in a page is the checksum of its text."""
    return _SEAL.search(html) is not None and sealed(html) == html


def page_text(path: Path, allowed: str) -> str:
    """The text of a page.

    Raises:
        InputError: If it cannot be read; the message says what is allowed.
    """
    try:
        return read_text(path, LIMIT)
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(f"{path}: no such file; {allowed}") from None
    except InputError as error:
        raise InputError(f"{str(error).partition('; allowed:')[0]}; {allowed}") from None


def verify_page(path: Path, missions: int, seed: int, named: Collection[str] = ()) -> list[Check]:
    """Check a page: its checksum, the learned policies, and missions of its studies.

    Args:
        path: The page.
        missions: The largest number of missions to simulate again, for every study on the page.
        seed: Seed of the random choice of these missions.
        named: Policies of Python files that the user has named, so that they may be run.

    Raises:
        InputError: If the file is not a page of dess, or a policy cannot be loaded.
    """
    html = page_text(path, _ALLOWED)
    if not _SEAL.search(html):
        raise InputError(f"{path}: is not a page of dess; {_ALLOWED}")
    altered = [] if is_sealed(html) else ["the page has been altered"]
    files = [_check_files(text, path) for text in embedded(FILES, html)]
    studies = [Evidence.parse(text, str(path), _ALLOWED) for text in embedded(STUDY, html)]
    notes = [] if studies else ["contains no missions to simulate again"]
    records = [check_records(evidence, missions, seed, named) for evidence in studies]
    return [Check("page", 1, altered, notes), *files, *records]


def verify_results(
    folder: Path, missions: int, seed: int, named: Collection[str] = ()
) -> list[Check]:
    """Check results: the bytes of all files, and the records and event logs of random missions.

    If there are several results folders, one that cannot be read counts as differing, and an
    incomplete one is mentioned in a note.

    Args:
        folder: A results folder, or a folder with results folders.
        missions: The largest number of missions to simulate again, for every study.
        seed: Seed of the random choice of these missions.
        named: Policies of Python files that the user has named, so that they may be run.

    Raises:
        InputError: If there are no results, they are incomplete, or a policy cannot be loaded.
    """
    folders = sorted(path.parent for path in folder.rglob(MANIFEST))
    if not folders:
        raise InputError(f"{folder}: contains no results and is not a page; {_ALLOWED}")
    if folders == [folder]:
        return _check_study(Store.read(folder), missions, seed, named)
    checks = []
    for path in folders:
        try:
            if (store := Store.read(path)).manifest.complete:
                checks += _check_study(store, missions, seed, named)
            else:
                checks.append(Check(str(path), 0, notes=["incomplete, so not checked"]))
        except InputError as error:
            checks.append(Check(str(path), 0, [str(error)]))
    return checks


def _check_study(store: Store, missions: int, seed: int, named: Collection[str]) -> list[Check]:
    if store.damaged:
        lines = [f"{path}: has been changed since it was written" for path in store.damaged]
        return [Check(store.manifest.study["name"], 0, lines)]
    evidence = Evidence.of(results_of(store), missions, seed)
    records = check_records(evidence, missions, seed, named)
    return [records, _check_logs(store, missions, seed)] if store.logged else [records]


def check_records(
    evidence: Evidence, missions: int, seed: int, named: Collection[str] = ()
) -> Check:
    """Simulate a random part of the sample again, with the SimPy engine, and compare the records.

    Args:
        evidence: The evidence of the study.
        missions: The largest number of missions.
        seed: Seed of the random choice.
        named: Policies of Python files that the user has named, so that they may be run.

    Raises:
        InputError: If a policy does not exist or is a file that is not named, or a scenario is not
            valid.
    """
    study = evidence.study["name"]
    check_no_files((team.policy for team in evidence.policies), f"study {study}", named)
    lines, numbers = [], chosen(len(evidence.sample), missions, seed)
    for mission in (evidence.sample[number] for number in numbers):
        policy, values, replication = mission.policy, mission.values, mission.replication
        space = evidence.space(values)
        team = load_team(policy, space.uavs[1])
        record = simulate(space, team, evidence.seed, replication)
        if changed := difference(record, mission.record):
            command = commands.of_fields(evidence, policy, values, replication)
            lines.append(f"{changed}; command: {command}")
    return Check(study, len(numbers), lines, evidence.changes_here(named))


def _check_logs(store: Store, missions: int, seed: int) -> Check:
    """Simulate some missions with a stored event log again, and compare the logs."""
    manifest, logged, lines = store.manifest, store.logged, []
    numbers = chosen(len(logged), missions, seed)
    for cell, replication in (logged[number] for number in numbers):
        space = manifest.scenarios[cell.point]
        team = load_team(manifest.policies[cell.team].policy, space.uavs[1])
        log = simulate(space, team, manifest.seed, replication, events=True).events
        stored = store.load_log(cell, replication)
        assert log is not None and stored is not None
        if not stored.to_pandas().equals(pd.DataFrame(log.columns())):
            command = commands.of_folder(store.folder, manifest, cell, replication)
            lines.append(f"the event log differs when simulated again; command: {command}")
    return Check(f"{manifest.study['name']}, event logs", len(numbers), lines)


def _check_files(text: str, path: Path) -> Check:
    """Compare the hashes of the learned policies on a page with those of the files here."""
    try:
        files = TypeAdapter(dict[str, str]).validate_json(text)
    except ValidationError:
        raise InputError(f"{path}: its list of files is not valid; {_ALLOWED}") from None
    shipped = learned_files()
    others = [name for name, digest in files.items() if shipped.get(name) != digest]
    return Check(
        "learned policies", len(files), [f"{name}: differs from the file here" for name in others]
    )
