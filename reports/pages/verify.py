"""Whether pages and results are what they were: their bytes, and missions flown again."""

import json
import re
from hashlib import sha256
from pathlib import Path

from analysis.results.evidence import Evidence, Verdict, learned_files, verify, verify_logs
from analysis.results.store import MANIFEST, Store
from analysis.results.tables import results_of
from dess.errors import InputError
from reports.pages.html import FILES, STUDY, embedded

# Where a page carries the checksum of all the rest of it.
_SEAL = re.compile(r'(<meta name="dess-checksum" content=")([0-9a-f]*)(">)')


def sealed(html: str) -> str:
    """A page with its checksum filled in."""
    return _SEAL.sub(rf"\g<1>{_checksum(html)}\g<3>", html, count=1)


def is_sealed(html: str) -> bool:
    """Whether a page has a checksum, and it is that of the page."""
    seal = _SEAL.search(html)
    return seal is not None and seal[2] == _checksum(html)


def verify_page(path: Path, missions: int, seed: int) -> list[Verdict]:
    """Check a page: its checksum, the learned policies, and missions of its studies.

    Args:
        path: The page.
        missions: How many to fly again, at most, of every study that it shows.
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
    carried = [_files(text, path) for text in embedded(FILES, html)]
    studies = [Evidence.parse(text, str(path)) for text in embedded(STUDY, html)]
    notes = [] if studies else ["carries no missions to fly again"]
    flown = [verify(evidence, missions, seed) for evidence in studies]
    return [Verdict("page", 1, altered, notes), *carried, *flown]


def verify_results(folder: Path, missions: int, seed: int) -> list[Verdict]:
    """Check results: the bytes of all files, and missions drawn at random, with logs and without.

    Args:
        folder: A results folder, or one that holds such.
        missions: How many to fly again, at most, of every study.
        seed: Of their choice.

    Raises:
        InputError: If there are no results, they are incomplete, or a policy is not there.
    """
    found = sorted(path.parent for path in folder.rglob(MANIFEST))
    if not found:
        raise InputError(f"{folder}: holds no results and is no page; {_ALLOWED}")
    if found == [folder]:
        return _verify_study(folder, missions, seed)
    return [verdict for each in found for verdict in _verify_one_of(each, missions, seed)]


_ALLOWED = "allowed: a page of dess report, or a results folder"


def _verify_one_of(folder: Path, missions: int, seed: int) -> list[Verdict]:
    """Check one of several: what cannot be read differs, what is incomplete is noted."""
    try:
        if not Store.read(folder).manifest.complete:
            return [Verdict(str(folder), 0, [], ["incomplete, so not checked"])]
        return _verify_study(folder, missions, seed)
    except InputError as error:
        return [Verdict(str(folder), 0, [str(error)], [])]


def _verify_study(folder: Path, missions: int, seed: int) -> list[Verdict]:
    store = Store.read(folder)
    if store.damaged:
        lines = [f"{path}: is not what was written" for path in store.damaged]
        return [Verdict(store.manifest.study["name"], 0, lines, [])]
    flown = verify(Evidence.of(results_of(store), missions, seed), missions, seed)
    return [flown, verify_logs(store, missions, seed)] if store.logged else [flown]


def _files(text: str, path: Path) -> Verdict:
    try:
        files = {str(name): str(digest) for name, digest in json.loads(text).items()}
    except (ValueError, AttributeError):
        raise InputError(f"{path}: its list of files is none; {_ALLOWED}") from None
    ours = learned_files()
    differing = [f"{name}: is another one here" for name in files if ours.get(name) != files[name]]
    return Verdict("learned policies", len(files), differing, [])


def _checksum(html: str) -> str:
    return sha256(_SEAL.sub(r"\g<1>\g<3>", html, count=1).encode()).hexdigest()
