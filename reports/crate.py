"""A study as a research object: an RO-Crate with all that is needed to judge and repeat the study.

The crate is a zip file with the results folder, its page, the study and its scenario as TOML files,
and ``ro-crate-metadata.json``. The last file says what each of the others is, which code made it,
and under which licence it may be used (RO-Crate 1.1,
https://www.researchobject.org/ro-crate/specification/1.1/). In the unpacked folder, the command
``dess study run study.toml --out results`` finds that all missions are present.
"""

import json
from collections.abc import Iterator, Mapping
from datetime import date
from importlib import metadata
from io import BytesIO
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import tomli_w
from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression
from rocrate.model import ContextEntity, Dataset, File
from rocrate.rocrate import ROCrate

from analysis import numbers
from analysis.results.evidence import Evidence
from analysis.results.files import BOUNDS, MANIFEST, partition
from analysis.results.parquet import files_in
from analysis.results.tables import Results
from dess import InputError
from dess.files import documents, tables
from dess.files.archives import write_zip
from dess.files.reading import read_bytes, read_text
from reports.pages.html import STUDY as EVIDENCE
from reports.pages.html import embedded
from reports.pages.index import LARGEST
from reports.pages.verify import LIMIT, is_sealed

RESULTS, STUDY, SCENARIO = "results", "study.toml", "scenario.toml"
RUN, REPORT = f"dess study run {STUDY} --out {RESULTS}", f"dess report {RESULTS}"
_SPDX = "https://spdx.org/licenses/"
_PARQUET = "application/vnd.apache.parquet"
_TABLES = {
    "missions": "The records of the missions, a row per mission.",
    "uavs": "The records of the UAVs, a row per UAV of every mission.",
    "events": "The event logs that the study stores.",
    BOUNDS: "The upper bounds of the missions, if the study has them.",
}


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
    for damaged in results.store.damaged:
        raise InputError(
            f"{damaged}: has been changed since it was written; allowed: results without damage"
        )
    crate, study = ROCrate(version="1.1"), results.manifest["study"]
    root, software = crate.root_dataset, _software(crate, results)
    root["name"], root["description"] = f"Study {study['name']}", _description(results)
    root["datePublished"] = published.isoformat()
    root["license"] = _licence(crate, licence_of(licence))
    made, asked = _results(crate, results), _documents(crate, results)
    content = read_bytes(page, LARGEST)
    html = _file(crate, content, page.name, "The page of the study, for a browser.", "text/html")
    root["mentions"] = [
        _action(crate, "run", RUN, software, asked, made),
        _action(crate, "report", REPORT, software, made, html),
    ]
    write_zip(path, _entries(crate, results))


def check_page(page: Path, results: Results) -> None:
    """Refuse a file that is not the page of the results as ``dess report`` wrote it.

    Raises:
        InputError: If the file is not a page, shows other results, or has been changed.
    """
    command = REPORT.replace(RESULTS, str(results.store.folder))
    allowed = f"their page, as {command} writes it"
    html = read_text(page, LIMIT, allowed=allowed)
    keys = [Evidence.parse(text, str(page), allowed).key for text in embedded(EVIDENCE, html)]
    if keys != [results.store.manifest.key] or not is_sealed(html):
        raise InputError(f"{page}: does not show the results of this study; allowed: {allowed}")


def licence_of(text: str) -> str:
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
            f"--license: {text!r} is unknown; allowed: an identifier of {_SPDX[:-1]}, such as "
            "MIT, CC-BY-4.0 or CC0-1.0"
        )
    return licence


def study_files(manifest: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The contents of the TOML files of a study and of its scenario.

    Args:
        manifest: The manifest of the results, as plain data.

    Returns:
        The study, whose scenario is the file ``scenario.toml`` in the same folder, and the
        scenario.
    """
    study, scenario = _without_none(manifest["study"]), _without_none(manifest["scenario"])
    if study.keys() & {"precision", "selection"}:
        del study["missions"]  # because the rule decides the number
    return study | {"scenario": SCENARIO}, scenario


def _without_none(value: Any) -> Any:
    """The data without fields that are None, which TOML cannot represent."""
    if isinstance(value, Mapping):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    return [_without_none(item) for item in value] if isinstance(value, list) else value


def _description(results: Results) -> str:
    manifest, study = results.store.manifest, results.manifest["study"]
    made = f"{len(results.missions):,} missions of {numbers.words(results.policies)}"
    points = f"{len(manifest.points):,} design point{'s' if len(manifest.points) > 1 else ''}"
    simulated = f"{made} at {points}, simulated by dess {manifest.version}."
    return " ".join(filter(None, [_sentence(study["description"]), simulated]))


def _sentence(text: str) -> str:
    return f"{text}." if text and text[-1] not in ".?!" else text


def _licence(crate: ROCrate, identifier: str) -> ContextEntity:
    """The licence of the results."""
    about = {"name": identifier, "description": f"{identifier} of the SPDX License List"}
    return crate.add_jsonld({"@id": f"{_SPDX}{identifier}", "@type": "CreativeWork", **about})


def _software(crate: ROCrate, results: Results) -> ContextEntity:
    """The version of dess that made the results, and the libraries that it used."""
    manifest, about = results.store.manifest, metadata.metadata("dess")
    authors = {"@id": "#authors", "@type": "Organization", "name": about["Author"]}
    dess: dict[str, Any] = {
        "@id": "#dess",
        "@type": "SoftwareApplication",
        "name": "dess",
        "description": about["Summary"],
        "version": manifest.version,
        "author": crate.add_jsonld(authors),
        "license": f"{_SPDX}{about['License-Expression']}",
        "softwareRequirements": [_library(crate, *pair) for pair in manifest.libraries.items()],
    }
    if manifest.commit:
        commit = {"name": "Commit of the source", "propertyID": "git", "value": manifest.commit}
        dess["identifier"] = crate.add_jsonld(
            {"@id": "#commit", "@type": "PropertyValue", **commit}
        )
    return crate.add_jsonld(dess)


def _library(crate: ROCrate, name: str, version: str) -> ContextEntity:
    about = {"@type": "SoftwareApplication", "name": name, "version": version}
    return crate.add_jsonld({"@id": f"#{name}", **about})


def _results(crate: ROCrate, results: Results) -> Dataset:
    """Add the results folder; its tables are read when the crate is written."""
    folder = results.store.folder
    about = {"name": "Results", "description": "A results folder, as dess study show reads it."}
    whole = crate.add_dataset(dest_path=f"{RESULTS}/", properties=about)
    manifest = "The manifest: the study, and what the results were made with."
    content = read_bytes(folder / MANIFEST, documents.LIMIT)
    parts = [_file(crate, content, f"{RESULTS}/{MANIFEST}", manifest, "application/json")]
    for name, description in _TABLES.items():
        about = {"name": name, "description": description, "encodingFormat": _PARQUET}
        parts.append(crate.add_dataset(dest_path=f"{RESULTS}/{name}/", properties=about))
    whole["hasPart"] = parts
    return whole


def _entries(crate: ROCrate, results: Results) -> Iterator[tuple[str, bytes]]:
    """The names and contents of a crate: of the results their files, and nothing else in them."""
    about = json.dumps(crate.metadata.generate(), indent=4, sort_keys=True, ensure_ascii=False)
    yield crate.metadata.id, about.encode()
    for entity in crate.data_entities:
        is_file = isinstance(entity, File)
        yield unquote(entity.id), entity.source.getvalue() if is_file else b""
    places = [Path(name, partition(policy)) for name in _TABLES for policy in results.policies]
    for place in (*places, Path(BOUNDS)):
        for path in files_in(results.store.folder / place):
            name = Path(RESULTS, place, path.name).as_posix()
            yield name, read_bytes(path, tables.LIMIT)


def _documents(crate: ROCrate, results: Results) -> list[File]:
    """The study and its scenario as TOML files, and the licence of dess."""
    study, scenario = (tomli_w.dumps(data).encode() for data in study_files(results.manifest))
    licence = metadata.distribution("dess").read_text("licenses/LICENSE") or ""
    _file(crate, licence.encode(), "LICENSE", "The licence of dess.", "text/plain")
    return [
        _file(crate, study, STUDY, "The study.", "application/toml"),
        _file(crate, scenario, SCENARIO, "Its scenario.", "application/toml"),
    ]


def _file(crate: ROCrate, content: bytes, path: str, description: str, kind: str) -> File:
    about = {"name": Path(path).name, "description": description, "encodingFormat": kind}
    size = {"contentSize": str(len(content))}
    return crate.add_file(BytesIO(content), path, properties=about | size)


def _action(
    crate: ROCrate,
    name: str,
    command: str,
    software: ContextEntity,
    used: list[File] | Dataset,
    made: File | Dataset,
) -> ContextEntity:
    """Add a command that makes a part of the crate, to be run in the unpacked folder."""
    about = {"name": command, "description": f"In the unpacked folder: {command}"}
    return crate.add_action(software, f"#{name}", used, made, about)
