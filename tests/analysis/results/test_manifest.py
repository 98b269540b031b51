"""A manifest that anybody may have written is refused in one line, or it can be used."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from analysis import run_study
from analysis.results.manifest import Manifest
from dess import InputError
from reports.cli import main
from tests.analysis.small import grid, small_study

# What stands in the place of each value, one after the other.
BAD: list[Any] = [
    None,
    5,
    -1,
    1e300,
    10**400,
    True,
    "",
    "x",
    "../x",
    "a\nb",
    [],
    {},
    [[]],
    {"x": 1},
]


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results with a selection, a design and prices."""
    folder = tmp_path_factory.mktemp("sound")
    rule = {
        "procedure": "kn",
        "metric": "collection_ratio",
        "indifference": 0.2,
        "first": 5,
        "check": 3,
        "budget": 40,
    }
    changes = {"selection": rule, "design": grid(uavs=[1, 2]), "costs": {"uav": 10.0}, "logged": 1}
    run_study(small_study(folder, **changes), folder / "out")
    return folder / "out"


def changed(document: Any) -> Iterator[tuple[str, Any]]:
    """The document with each of its values replaced by each of the bad ones, or left out."""
    for path in _paths(document):
        for bad in [*BAD, KeyError]:
            copy = json.loads(json.dumps(document))
            *above, last = path
            place = copy
            for key in above:
                place = place[key]
            if bad is not KeyError:
                place[last] = bad
            else:
                del place[last]
            yield f"{'.'.join(map(str, path))}: {bad!r:.20}", copy


def _paths(document: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    items: Any = []
    if isinstance(document, dict):
        are_hashes = path == ("code",) or "members" in path  # which are all checked alike
        items = [*document.items()][: 2 if are_hashes else None]
    elif isinstance(document, list):
        items = enumerate(document[:2])
    for key, value in items:
        yield (*path, key)
        yield from _paths(value, (*path, key))


def test_every_value_of_a_manifest_is_checked_when_it_is_read(sound: Path, tmp_path: Path) -> None:
    """What is read has what every use of a manifest takes from it."""
    document, path = json.loads((sound / "manifest.json").read_text()), tmp_path / "manifest.json"
    refused = 0
    for what, forged in changed(document):
        path.write_text(json.dumps(forged))
        try:
            manifest = Manifest.read(path)
        except InputError as error:
            refused += 1
            assert str(error).startswith(f"{path}: ") and "\n" not in str(error), what
        else:
            assert manifest.cells and manifest.values and manifest.key and manifest.text, what
            assert manifest.selection and (manifest.costs is None or manifest.settings), what
    assert refused > 500


@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000,
        '{"version": ' + "9" * 5000 + "}",
        '{"version": "\\ud800"}',
        "5",
        "",
        "\0",
    ],
)
def test_a_text_that_is_no_manifest_is_one_line(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "manifest.json").write_text(text)
    for command in (["study", "show"], ["simulate", "--of"], ["verify"], ["study", "diff", "."]):
        assert main([*command, str(tmp_path)]) in (1, 2)
        assert "Traceback" not in (line := capsys.readouterr().err) and len(line) < 700


@pytest.mark.parametrize("rule", [True, False])
def test_more_missions_than_the_study_asks_for_are_refused(
    rule: bool, sound: Path, tmp_path: Path
) -> None:
    if not rule:
        run_study(small_study(tmp_path), tmp_path / "out")
    folder, most = (sound, 40) if rule else (tmp_path / "out", 10)
    document = json.loads((folder / "manifest.json").read_text())
    for count, refused in ((most, False), (most + 1, True), (10**9, True)):
        forged = [[count] * len(of_team) for of_team in document["missions"]]
        try:
            Manifest.parse(json.dumps(document | {"missions": forged}), "manifest", "allowed: less")
        except InputError as error:
            assert refused and "fewer or more than those of the study" in str(error)
        else:
            assert not refused
