import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analysis import load_results, load_study, run_study
from analysis.ask.sweep import ask, file_of, folder_of, question, values_of
from analysis.execution import effort
from analysis.execution.effort import BASELINE, SECONDS
from dess import InputError
from tests.analysis.small import files_of, write_scenario

FIELDS = {"uavs": [1, 2], "quota": [20, 40], "pads": 2}


@pytest.fixture
def asking(tmp_path):
    """Asks a sweep of the small scenario into ``results``; the study, results and missions done."""

    def run(fields=FIELDS, missions=6, **about):
        study = sweep_of(fields, tmp_path, missions=missions, **about)
        rounds, done = [], []
        results = ask(study, tmp_path / "results", 1, done.append, rounds.append)
        return study, results, sum(done) - rounds[0].present

    return run


def sweep_of(fields, folder, **about):
    """The study of a sweep of the small scenario."""
    values = {field: values_of(field, given) for field, given in fields.items()}
    return question(values, write_scenario(folder), **{"policies": ["greedy"]} | about)


def tables(results):
    """All records, by cell, in an order that no folder decides."""
    cells = {c.point: c.key for cells in results.store.manifest.cells for c in cells}
    return [
        table.assign(cell=table["point"].map(cells))
        .drop(columns="point")
        .sort_values([*keys, "cell"], ignore_index=True)
        for table, keys in (
            (results.missions, ["policy", "replication"]),
            (results.uavs, ["policy", "replication", "uav"]),
        )
    ]


def check_equal_to_a_fresh_run(study, results, folder):
    fresh = run_study(study, folder / "fresh")
    for found, expected in zip(tables(results), tables(fresh), strict=True):
        pd.testing.assert_frame_equal(found, expected)


def test_a_sweep_is_the_grid_of_what_has_several_values(asking, tmp_path):
    study, results, done = asking()
    assert study.set == {"pads": 2}
    assert [point.values for point in study.points] == [
        {"uavs": uavs, "quota": quota} for uavs in (1, 2) for quota in (20, 40)
    ]
    assert study.name.startswith("uavs-quota-")
    assert done == len(results.missions) == 24


OTHERS = {
    "wider": ({**FIELDS, "uavs": [1, 2, 3]}, 12),
    "narrower": ({**FIELDS, "uavs": 2}, 0),
    "across": ({**FIELDS, "uavs": [2, 3]}, 12),
    "another order": ({"quota": [40, 20], "uavs": [2, 1], "pads": 2}, 0),
    "other pads": ({**FIELDS, "pads": 1}, 24),
}


@pytest.mark.parametrize("case", OTHERS)
def test_only_what_is_new_is_simulated(case, asking, tmp_path):
    first = asking()[0]
    fields, new = OTHERS[case]
    study, results, done = asking(fields)
    assert study.name != first.name
    assert done == new
    check_equal_to_a_fresh_run(study, results, tmp_path)
    assert asking(fields)[2] == 0


def _no_manifest(folder):
    (folder / "manifest.json").write_text("{}")


def _cut(folder):
    for path in folder.glob("missions/*/*.parquet"):
        path.write_bytes(path.read_bytes()[:-9])


def _accepted(folder):
    path = folder / "manifest.json"
    change = '"accepted": [{"modules": ["dess.rules"], "missions": 3}]'
    path.write_text(path.read_text().replace('"accepted": []', change))


@pytest.mark.parametrize("damage", [_no_manifest, _cut, _accepted, shutil.rmtree])
def test_a_damaged_folder_gives_nothing(damage, asking, tmp_path):
    study, *_ = asking()
    damage(folder_of(study, tmp_path / "results"))
    study, results, done = asking(OTHERS["wider"][0])
    assert done == 36
    check_equal_to_a_fresh_run(study, results, tmp_path)


def test_the_file_completes_the_sweep(asking, tmp_path, monkeypatch):
    prices = {"uav": 20_000, "hour": 10.0, "slot_seconds": 60.0}
    study, *_ = asking(prices=prices)
    out = folder_of(study, tmp_path / "results")
    monkeypatch.chdir(tmp_path)
    again = load_study(file_of(study, "results"))
    assert again.model_dump() == study.model_dump() | {"scenario": again.scenario}
    assert Path(again.scenario).resolve() == Path(study.scenario).resolve()
    before = files_of(out)
    shutil.rmtree(out)
    run_study(again, out)
    assert files_of(out) == before


def test_a_name_is_of_one_question(asking, tmp_path):
    assert asking(name="mine")[2] == 24
    assert asking({**FIELDS, "uavs": [1, 2, 3]}, name="mine")[2] == 12
    before = files_of(tmp_path)
    line = "mine/manifest.json: holds other scenarios .*; allowed: another --out or name, or remove"
    with pytest.raises(InputError, match=line):
        asking({**FIELDS, "uavs": [2]}, name="mine")
    assert files_of(tmp_path) == before
    assert len(load_results(tmp_path / "results" / "sweeps" / "mine").missions) == 36


def test_a_search_has_a_policy_for_the_missions_that_it_will_take() -> None:
    """It takes more of them than the check of its answer, so it gets a faster policy."""
    values = {"uavs": [1, 2, 3, 4, 5], "pads": [1, 2, 3, 4]}
    same = question(values, "bay", missions=30)
    search = question(values, "bay", prices={"uav": 20_000}, requirements={"success": 0.99})
    assert SECONDS[search.policies[0]] < SECONDS[same.policies[0]]
    assert search.policies[1:] == same.policies[1:] == (BASELINE,)


def test_missions_of_other_sweeps_take_no_time(asking, tmp_path, monkeypatch):
    for module in (effort, effort):
        monkeypatch.setattr(module, "LONG_RUN", 0.00015)  # less than 24 missions take
    study = sweep_of(FIELDS, tmp_path, missions=6)
    with pytest.raises(InputError, match="24 missions to simulate"):
        ask(study, tmp_path / "results")
    ask(study, tmp_path / "results", yes=True)
    assert asking({**FIELDS, "uavs": [1, 2, 3]})[2] == 12  # of 36


# Field, what is given, and the values that this is.
GIVEN = [
    ("uavs", 3, (3,)),
    ("uavs", range(2, 6), (2, 3, 4, 5)),
    ("uavs", [[1, 3]], ([1, 3],)),
    ("uavs", np.array([2, 4]), (2, 4)),
    ("arrival_rate", np.array([0.01, 0.02]), (0.01, 0.02)),
    ("forbid_swaps", [False, True], (False, True)),
    ("initial_data", [5, 20], ([5, 20],)),
    ("initial_data", np.array([5, 20]), (5, 20)),
    ("initial_data", [[5, 7.5], [7.5, 10]], ([5, 7.5], [7.5, 10])),
    ("zone", [[26, 2, 4, 4], [0, 0, 2, 2]], ([26, 2, 4, 4], [0, 0, 2, 2])),
    ("nodes", [[1, 2], [3, 4]], ([[1, 2], [3, 4]],)),
    ("nodes", [[[1, 2]], [[3, 4]]], ([[1, 2]], [[3, 4]])),
]


@pytest.mark.parametrize(("field", "given", "values"), GIVEN)
def test_one_value_is_fixed_and_several_are_swept(field, given, values):
    found = values_of(field, given)
    assert found == values
    assert [type(value) for value in found] == [type(value) for value in values]


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ([], "uavs: has no values; allowed: 1 to 100,000"),
        (range(0, 10**30, 3), "uavs: has 333,333,333,333,333,333,333,333,333,334 values"),
        (range(10**30, 0, -(10**10)), "uavs: has 100,000,000,000,000,000,000 values"),
    ],
)
def test_values_that_are_none(given, line):
    with pytest.raises(InputError, match=line):
        values_of("uavs", given)
