"""A study as a research object: an RO-Crate with all that is needed to judge and repeat the study.

The crate is a zip file with the results folder, its page, the study and its scenario as TOML files,
and ``ro-crate-metadata.json``. The last file says what each of the others is, which code made it,
and under which licence it may be used (RO-Crate 1.1,
https://www.researchobject.org/ro-crate/specification/1.1/). In the unpacked folder, the command
``dess study run study.toml --out results`` finds that all missions are present.
"""

from collections.abc import Iterator, Mapping
from datetime import date
from importlib import metadata
from pathlib import Path
from typing import Any

import tomli_w
from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

from dess import InputError
from dess.analysis import numbers
from dess.analysis.results.chunks import BOUNDS, MANIFEST, partition_name
from dess.analysis.results.parquet import files_in
from dess.analysis.results.tables import Results
from dess.base.commands import command_line
from dess.base.files import documents, tables
from dess.base.files.reading import read_bytes
from dess.base.files.writing import write_zip
from dess.reports.pages.page import LARGEST, LIMIT, Page
from dess.reports.pages.templates import load_template

_TABLES = ("missions", "uavs", "events", BOUNDS)


def write_crate(results: Results, page: Path, path: Path, published: date, licence: str) -> None:
    """Write a study as a zipped RO-Crate; equal arguments give equal bytes.

    Args:
        results: The results of the study.
        page: The page of the results.
        path: The zip file to write, a temporary one.
        published: The date of the publication.
        licence: The licence of the results, an SPDX identifier (https://spdx.org/licenses).

    Raises:
        InputError: If there is no such licence, or a file of the results is damaged.
    """
    for damaged in results.store.contents.damaged:
        raise InputError(damaged, "has been changed since it was written", "results without damage")
    files = _collect_files(results, page)
    about = load_template("ro-crate-metadata.json").render(
        study=results.manifest["study"],
        manifest=results.store.manifest,
        description=_describe_crate(results),
        published=published.isoformat(),
        licence=find_licence(licence),
        sizes={name: len(content) for name, content in files.items()},
        page=page.name,
        dess=metadata.metadata("dess"),
    )
    entries = {"ro-crate-metadata.json": about.encode()} | files
    write_zip(path, [*entries.items(), *_find_tables(results)])


def check_page(page: Path, results: Results) -> None:
    """Refuse a file that is not the page of the results as ``dess report`` wrote it.

    Raises:
        InputError: If the file is not a page, shows other results, or has been changed.
    """
    allowed = f"their page, as {command_line('report', results.store.folder)} writes it"
    shown = Page.read(page, LIMIT, allowed)
    keys = [evidence.key for evidence in shown.evidence]
    if keys != [results.store.manifest.key] or not shown.is_sealed:
        raise InputError(page, "does not show the results of this study", allowed)


def find_licence(text: str) -> str:
    """The identifier of a licence, in the spelling of SPDX.

    Raises:
        InputError: If there is no such licence.
    """
    try:
        licence = str(canonicalize_license_expression(text))
    except InvalidLicenseExpression:
        licence = ""
    if not licence.replace("-", "").replace(".", "").isalnum() or "LicenseRef" in licence:
        raise InputError(
            "--license",
            f"{text!r} is unknown",
            "an identifier of https://spdx.org/licenses, such as MIT, CC-BY-4.0 or CC0-1.0",
        )
    return licence


def _collect_files(results: Results, page: Path) -> dict[str, bytes]:
    """The page, the study and its scenario as TOML files, the manifest, the licence of dess."""
    study, scenario = (_without_none(results.manifest[name]) for name in ("study", "scenario"))
    if study.keys() & {"precision", "selection"}:
        del study["missions"]  # because the rule decides the number
    study["scenario"] = "scenario.toml"
    return {
        "LICENSE": (metadata.distribution("dess").read_text("licenses/LICENSE") or "").encode(),
        "study.toml": tomli_w.dumps(study).encode(),
        "scenario.toml": tomli_w.dumps(scenario).encode(),
        page.name: read_bytes(page, LARGEST),
        f"results/{MANIFEST}": read_bytes(results.store.folder / MANIFEST, documents.LIMIT),
    }


def _find_tables(results: Results) -> Iterator[tuple[str, bytes]]:
    """The names and contents of the tables: their files, and nothing else that lies there."""
    yield from ((f"results/{name}", b"") for name in ("", *(f"{table}/" for table in _TABLES)))
    places = [Path(name, partition_name(policy)) for name in _TABLES for policy in results.policies]
    for place in (*places, Path(BOUNDS)):
        for path in files_in(results.store.folder / place):
            name = Path("results", place, path.name).as_posix()
            yield name, read_bytes(path, tables.LIMIT)


def _without_none(value: Any) -> Any:
    """The data without fields that are None, which TOML cannot represent."""
    if isinstance(value, Mapping):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    if isinstance(value, list):
        return [_without_none(item) for item in value]
    return value


def _describe_crate(results: Results) -> str:
    manifest = results.store.manifest
    asked = results.study.description
    simulated = f"{len(results.missions):,} missions of {numbers.join_words(results.policies)}"
    if asked and asked[-1] not in ".?!":
        asked += "."
    points = "1 design point"
    if len(manifest.points) > 1:
        points = f"{len(manifest.points):,} design points"
    return f"{asked} {simulated} at {points}, simulated by dess {manifest.version}.".strip()
