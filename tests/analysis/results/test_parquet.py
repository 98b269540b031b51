"""Parquet files that anybody may have written: what is no record counts as damaged."""

import json
import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from dess import InputError
from dess.analysis import load_results, run_study
from dess.analysis.results import event_log, parquet
from dess.analysis.results.chunks import name_of
from dess.analysis.results.store import Store
from dess.model.events import PARAMETER_EVENTS
from dess.reports.cli import main
from tests.analysis.small import files_of, small_study

Forge = Callable[[pa.Table], pa.Table]


@pytest.fixture(scope="module")
def sound(studied):
    """Small results with an event log."""
    return studied(logged=1, policies=["greedy"]).store.folder


def forged(sound: Path, out: Path, kinds: str, forge: Forge) -> Path:
    """A copy of the results in which tables are other ones, in files that have their hashes."""
    shutil.copytree(sound, out)
    for kind in kinds.split():
        path = sorted((out / kind).rglob("*.parquet"))[0]
        table = forge(pq.ParquetFile(path).read())
        path.unlink()
        name = path.stem.rpartition("-")[0]
        # An event log has no parts.
        with suppress(ValueError, RecursionError, TypeError, KeyError):
            name = name_of(json.loads((table.schema.metadata or {})[b"dess.parts"]))
        parquet.write(path.parent, name, table)
    return out


def parts(text: Any) -> Forge:
    content = text if isinstance(text, bytes) else json.dumps(text).encode()
    return lambda table: table.replace_schema_metadata({"dess.parts": content})


def column(name: str, change: Callable[[np.ndarray], Any]) -> Forge:
    def forge(table: pa.Table) -> pa.Table:
        place = table.schema.get_field_index(name)
        values = pa.array(change(np.array(table[name].to_pylist())))
        return table.set_column(place, name, values)

    return forge


KEY = "0123456789abcdef"
# A file is damaged if it is of another schema, of other missions, or has an index out of range.
WRONG: dict[str, tuple[str, Forge]] = {
    "no parts": ("missions uavs", parts(b"{")),
    "other parts": ("missions uavs", parts([[KEY, 0, 4]])),
    "parts without end": ("missions uavs", parts([[KEY, 0, 2**32]])),
    "no number": ("missions", column("collected", lambda v: v * np.nan)),
    "another column": ("missions", lambda table: table.rename_columns({"slots": "x"})),
    "other words": ("uavs", column("end", lambda v: ["<script>"] * len(v))),
    "a UAV less": ("uavs", lambda table: table[:-1]),
    "a node that there is not": ("events", column("node", lambda v: v + 10**4)),
    "a time without end": ("events", column("time", lambda v: v + 1e15)),
}


@pytest.mark.parametrize(("kind", "forge"), WRONG.values(), ids=[*WRONG])
def test_a_table_that_is_no_record_is_damaged_and_computed_anew(
    kind, forge, sound, tmp_path, capsys
):
    folder = forged(sound, tmp_path / "out", kind, forge)
    damaged = Store.read(folder).contents.damaged
    assert damaged and all(path.is_relative_to(folder / "") for path in damaged)
    assert main(["verify", str(folder)]) == 1
    if kind != "events":
        with pytest.raises(InputError, match="damaged: "):
            load_results(folder)
    again = run_study(small_study(tmp_path, logged=1, policies=["greedy"]), folder)
    assert again.missions.equals(load_results(sound).missions)
    assert again.uavs.equals(load_results(sound).uavs)
    assert not load_results(folder).store.contents.damaged


def test_event_logs_of_before_are_read_and_verified(sound, tmp_path):
    """Logs had the first seven columns only, and no rows of parameters."""

    def former(table: pa.Table) -> pa.Table:
        rows = [name not in PARAMETER_EVENTS for name in table["event"].to_pylist()]
        return table.filter(pa.array(rows)).select(parquet.SCHEMAS["events"][1].names)

    folder = forged(sound, tmp_path / "out", "events", former)
    log = load_results(folder).events("greedy")
    assert [*log] == ["time", "event", "uav", "node", "value", "x", "y"]
    assert len(event_log.uav_slots(log)) == (log["event"] == "move").sum()
    assert main(["verify", str(folder)]) == 0
    changed = forged(folder, tmp_path / "changed", "events", column("value", lambda v: v + 1))
    assert main(["verify", str(changed)]) == 1


def test_what_only_has_the_name_of_a_chunk_is_left_alone(sound, tmp_path):
    folder = shutil.copytree(sound, tmp_path / "out")
    places = [path.parent for path in sorted(folder.rglob("*.parquet"))]
    outside = tmp_path / "outside"
    outside.write_text("mine")
    for place in places:
        os.mkfifo(place / f"{'a' * 16}-{'1' * 16}.parquet")
        (place / f"{'a' * 16}-{'2' * 16}.parquet").mkdir()
        (place / f"{'a' * 16}-{'3' * 16}.parquet").symlink_to(outside)
        (place / f"{'a' * 16}-{'4' * 16}.parquet").symlink_to("/dev/zero")
        (place / ".x.tmp").mkdir()
    (folder / "failures" / "x.json").mkdir()
    assert len(load_results(folder).missions) == 10
    run_study(small_study(tmp_path, logged=1, policies=["greedy"], missions=12), folder)
    assert outside.read_text() == "mine"


@pytest.mark.parametrize("name", [".lock", "missions", "failures", "uavs/policy=greedy"])
def test_a_run_does_not_write_or_delete_where_a_link_leads(name, sound, tmp_path, capsys):
    folder, outside = shutil.copytree(sound, tmp_path / "out"), tmp_path / "outside"
    place = folder / name
    if place.exists():
        shutil.move(place, outside)
    else:
        outside.write_text("mine")
    place.symlink_to(outside)
    (outside / "x.json").write_text("mine") if outside.is_dir() else None
    before = files_of(tmp_path)
    small_study(tmp_path)
    command = ["study", "run", str(tmp_path / "trial.toml"), "--policy", "greedy"]
    assert main([*command, "--out", str(folder)]) == 2
    assert f"{place}: is a link" in capsys.readouterr().err
    assert {**files_of(tmp_path), **before} == files_of(tmp_path)
