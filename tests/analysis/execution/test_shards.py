"""Shards: however a study is divided, and whatever is lost on the way, the bytes are the same."""

import pytest

from dess import InputError
from dess.analysis import run_study, sweep
from dess.analysis.execution.jobs import MissionsJob
from dess.analysis.execution.runner import CHUNK, run_shard
from dess.analysis.results import shards
from dess.analysis.results.manifest import Manifest
from dess.analysis.results.merge import merge_shards
from dess.analysis.results.shards import Shard
from dess.analysis.results.store import Store
from dess.reports import cli
from tests.analysis.small import files_of, grid, small_study

FOUR = [Shard(number, 4) for number in (1, 2, 3, 4)]


def test_shards_of_one_folder_leave_the_bytes_of_a_single_run(study, expected, tmp_path):
    folder = tmp_path / "shared"
    for shard in [*FOUR[::-1], Shard(2, 3)]:  # in any order, and some chunks twice
        run_shard(study, folder, shard)
    results = merge_shards([folder])
    assert files_of(folder) == expected
    assert len(results.missions) == 60
    assert files_of(merge_shards([folder]).store.folder) == expected  # once more changes nothing


def test_shards_of_several_folders_are_joined_in_another(study, expected, tmp_path):
    folders = [tmp_path / str(shard.number) for shard in FOUR]
    for shard, folder in zip(FOUR, folders, strict=True):
        run_shard(study, folder, shard)
    before = [*map(files_of, folders)]
    with pytest.raises(InputError, match="shard 4/4 missing or incomplete"):
        merge_shards(folders[:3], tmp_path / "joined")
    assert not (tmp_path / "joined").exists()
    merge_shards(folders, tmp_path / "joined")
    assert files_of(tmp_path / "joined") == expected
    assert [*map(files_of, folders)] == before


def test_lost_shards_are_named_and_run_again_alone(study, expected, tmp_path):
    folder = tmp_path / "shared"
    for shard in FOUR[:2]:
        run_shard(study, folder, shard)
    lines = {
        3: "shards 3/4 and 4/4 missing or incomplete: 24 missions and 2 event logs missing at "
        "design points 0, 1 and 2; allowed: run the study again with --shard 3/4",
        4: "shard 4/4 missing or incomplete: 6 missions and 1 event log missing at design points "
        "0 and 2; allowed: run the study again with --shard 4/4",
    }
    for number, line in lines.items():
        with pytest.raises(InputError) as error:
            merge_shards([folder])
        assert str(error.value) == f"{folder}: {line}"
        run_shard(study, folder, FOUR[number - 1])
    merge_shards([folder])
    assert files_of(folder) == expected


def test_an_interrupted_shard_goes_on_where_it_was(study, expected, tmp_path):
    folder = tmp_path / "shared"

    def interrupt(missions):
        if missions:
            raise KeyboardInterrupt

    for shard in FOUR:
        with pytest.raises(KeyboardInterrupt):
            run_shard(study, folder, shard, progress=interrupt)
    with pytest.raises(InputError, match="shards 1/4, 2/4, 3/4 and 4/4 missing or incomplete"):
        merge_shards([folder])
    for shard in FOUR:
        run_shard(study, folder, shard)
    merge_shards([folder])
    assert files_of(folder) == expected


def test_a_run_without_shards_completes_what_is_missing(study, expected, tmp_path):
    run_shard(study, tmp_path / "out", FOUR[2])
    run_study(study, tmp_path / "out")
    assert files_of(tmp_path / "out") == expected


def test_shards_lock_themselves_and_not_the_folder(study, tmp_path, monkeypatch):
    monkeypatch.setattr(shards, "PATIENCE", 0.1)
    folder, manifest = tmp_path / "shared", Manifest.of(study)
    more = small_study(tmp_path, design=grid(uavs=[1, 2, 3]), missions=20)
    refused = [
        lambda: run_shard(study, folder, FOUR[0]),
        lambda: run_study(study, folder),
        lambda: merge_shards([folder]),
        lambda: run_shard(more, folder, FOUR[1]),  # which changes the manifest
    ]
    with Store.open_shard(manifest, folder, FOUR[0]):
        run_shard(study, folder, FOUR[1])
        for run in refused:
            with pytest.raises(InputError, match="in use by another run"):
                run()
    with Store.open(manifest, folder), pytest.raises(InputError, match="in use by another run"):
        run_shard(study, folder, FOUR[0])
    run_shard(study, folder, FOUR[0])


def test_only_shards_of_one_study_are_joined(study, tmp_path):
    run_shard(study, tmp_path / "a", FOUR[0])
    run_shard(small_study(tmp_path, seed=8), tmp_path / "b", FOUR[1])
    with pytest.raises(InputError, match="b: holds another study than"):
        merge_shards([tmp_path / "a", tmp_path / "b"])
    assert shards.shards_in(tmp_path / "b") == [FOUR[1]]


def test_a_rule_is_not_divided(tmp_path):
    rule = {"first": 5, "budget": 60, "targets": {"success": {"absolute": 0.2}}}
    study = small_study(tmp_path, precision=rule)
    with pytest.raises(InputError, match="--shard: a rule decides"):
        run_shard(study, tmp_path / "out", FOUR[0])


WORDS = ["study", "run", "trial.toml", "--out", "out"]
SWEEP = ["sweep", "--scenario", "small.toml", "--set", "uavs=1,2", "--policy", "greedy"]
SEARCH = [*SWEEP, "--require", "success=0.5", "--price", "uav=2"]
REFUSED = {
    "--shard: '5/4' is no shard; allowed: I/N": [*WORDS, "--shard", "5/4"],
    "--shard: '0/4' is no shard": [*WORDS, "--shard", "0/4"],
    "--shard: 'x' is no shard": [*WORDS, "--shard", "x"],
    "--report: needs all missions": [*WORDS, "--shard", "1/2", "--report"],
    "--json: needs all missions": [*SWEEP, "--shard", "1/2", "--json"],
    "--shard: a rule decides": [
        *SWEEP,
        "--shard",
        "1/2",
        "--require",
        "success=0.5",
        "--price",
        "uav=2",
    ],
    "nowhere/manifest.json: ": ["study", "merge", "nowhere"],
}


@pytest.mark.parametrize("line", REFUSED)
def test_what_is_no_shard_is_one_line(line, tmp_path, monkeypatch, capfd):
    small_study(tmp_path)
    monkeypatch.chdir(tmp_path)
    before = files_of(tmp_path)
    assert cli.main(REFUSED[line]) == 2
    out, err = capfd.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert f"dess: error: {line}" in err
    assert files_of(tmp_path) == before


def test_an_interrupt_is_one_line(tmp_path, monkeypatch, capfd):
    def interrupt(*_):
        raise KeyboardInterrupt

    small_study(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(MissionsJob, "run", interrupt)
    assert cli.main([*WORDS, "--shard", "1/2", "--yes"]) == 130
    out, err = capfd.readouterr()
    assert out == ""
    assert err.endswith("\ninterrupted: run the same command again to complete it\n")


def test_a_sweep_in_shards_is_answered_at_once(tmp_path, monkeypatch, capfd):
    monkeypatch.setitem(CHUNK, "batch", 9)
    small_study(tmp_path)
    monkeypatch.chdir(tmp_path)
    words = [*SWEEP, "--name", "asked", "--missions", "20"]
    for number in (1, 2):
        assert cli.main([*words, "--shard", f"{number}/2"]) == 0
        assert f"shard {number}/2 of study asked is complete" in capfd.readouterr().out
    assert cli.main(["study", "merge", "results/sweeps/asked"]) == 0
    assert cli.main(["study", "run", "results/sweeps/asked.toml", "--out", "whole"]) == 0
    assert files_of(tmp_path / "whole") == files_of(tmp_path / "results" / "sweeps" / "asked")
    done = []
    about = {"policies": ["greedy"], "missions": 20, "name": "asked", "uavs": (1, 2)}
    sweep("small.toml", **about, progress=done.append)
    assert done == [40]  # all were there
