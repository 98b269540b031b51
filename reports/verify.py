"""Whether pages and results are what they were: their bytes, and missions flown again."""

import json
import re
from hashlib import sha256
from pathlib import Path

from analysis.evidence import Evidence, Verdict, learned_files, verify
from analysis.results import results_of
from analysis.store import MANIFEST, Store
from dess.errors import InputError
from reports.page import FILES, STUDY, embedded

# Where a page carries the checksum of all the rest of it.
_SEAL = re.compile(r'(<meta name="dess-checksum" content=")([0-9a-f]*)(">)')


def sealed(html: str) -> str:
    """A page with its checksum filled in."""
    return _SEAL.sub(rf"\g<1>{_checksum(html)}\g<3>", html, count=1)


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
        html = path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {error}; {_ALLOWED}") from None
    seal = _SEAL.search(html)
    if not seal:
        raise InputError(f"{path}: is no page of dess; {_ALLOWED}")
    altered = [] if seal[2] == _checksum(html) else ["the page has been altered"]
    verdicts = [Verdict("page", 1, altered, [])]
    for text in embedded(FILES, html):
        verdicts.append(_files(text, path))
    for text in embedded(STUDY, html):
        verdicts.append(verify(Evidence.parse(text, str(path)), missions, seed))
    return verdicts


def verify_results(folder: Path, missions: int, seed: int) -> list[Verdict]:
    """Check results: the bytes of all their files, and missions drawn at random.

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
    return [_verify_study(each, missions, seed) for each in found]


_ALLOWED = "allowed: a page of dess report, or a results folder"


def _verify_study(folder: Path, missions: int, seed: int) -> Verdict:
    store = Store.read(folder)
    if store.damaged:
        name = store.manifest.study["name"]
        lines = [f"{path}: is not what was written" for path in store.damaged]
        return Verdict(name, 0, lines, [])
    return verify(Evidence.of(results_of(store), missions, seed), missions, seed)


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
