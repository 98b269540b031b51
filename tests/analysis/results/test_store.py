import json
import shutil

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess import InputError, simulate_batch
from dess.analysis import load_results, load_study, run_study
from dess.analysis.execution import runner
from dess.analysis.results import parquet, provenance
from dess.analysis.results.chunks import Chunk, split_into_chunks
from dess.analysis.results.manifest import Cell, CellPart, Manifest
from dess.analysis.results.replications import gaps_between
from dess.analysis.results.store import Failure, Store
from dess.policies import load
from tests.analysis.small import files_of, small_study, write_scenario
from tests.reports.small import quick


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A results folder, made once."""
    folder = tmp_path_factory.mktemp("made")
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(runner.CHUNK, "batch", 4)  # as in the tests
        return run_study(small_study(folder, logged=1), folder / "out").store.folder


@pytest.fixture
def out(made, tmp_path):
    """A results folder, and the study beside it."""
    small_study(tmp_path)
    return shutil.copytree(made, tmp_path / "out")


def _flip(path):
    content = bytearray(path.read_bytes())
    content[40] ^= 1  # in the first data page
    path.write_bytes(content)


def _text(path):
    path.write_text("nothing like parquet")


@pytest.mark.parametrize("kind", ["missions", "uavs", "events", "bounds"])
@pytest.mark.parametrize("damage", [_flip, _text])
def test_a_damaged_file_is_noticed_and_computed_again(kind, damage, out, tmp_path):
    study = small_study(tmp_path, logged=1, bounds=True)
    with quick():
        run_study(study, out)
    whole = files_of(out)
    path = next((out / kind).rglob("*.parquet"))
    damage(path)
    with pytest.raises(InputError, match="run the study again|no event log"):
        results = load_results(out)
        for policy in ("greedy", "random"):
            results.events(policy)
    with quick():
        run_study(study, out)
    assert files_of(out) == whole


def _rewrite(out, **changes):
    path = out / "manifest.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


FOREIGN = {
    "binary": (lambda out: (out / "manifest.json").write_bytes(b"\xff\xfe"), "it is not text"),
    "other version": (
        lambda out: _rewrite(out, version="0.0.9"),
        r"has version '0\.0\.9', not",
    ),
    "other schema": (lambda out: _rewrite(out, schema_version=99), "has schema_version 99, not"),
    "no study": (lambda out: _rewrite(out, study={}), "study.name: is missing"),
}


@pytest.mark.parametrize("case", FOREIGN)
def test_a_foreign_manifest_is_refused(case, out, tmp_path):
    spoil, line = FOREIGN[case]
    spoil(out)
    before = files_of(out)
    for use in (lambda: load_results(out), lambda: run_study(small_study(tmp_path), out)):
        with pytest.raises(InputError, match=line) as error:
            use()
        assert str(error.value).startswith(str(out / "manifest.json"))
        assert "allowed: another results folder" in str(error.value)
        assert "\n" not in str(error.value)
    assert files_of(out) == before


OTHERS = {
    "holds seed 7, not 8": {"seed": 8},
    "holds study trial, not other": {"name": "other"},
    "holds other scenarios": {"set": {"quota": 50}},
    "holds policy random, which study trial does not have": {"policies": ["greedy", "tour"]},
}


@pytest.mark.parametrize("line", OTHERS)
def test_another_study_is_refused(line, out, tmp_path):
    before = files_of(out)
    with pytest.raises(InputError, match=line):
        run_study(small_study(tmp_path, **OTHERS[line]), out)
    assert files_of(out) == before


def test_the_scenario_counts_not_its_name(out, tmp_path):
    write_scenario(tmp_path).rename(tmp_path / "renamed.toml")
    run_study(load_study(tmp_path / "trial.toml", scenario=str(tmp_path / "renamed.toml")), out)


def _simulated_by_other_code(out, *modules):
    """Make the manifest say that the code of the modules was another."""
    code = json.loads((out / "manifest.json").read_text())["code"]
    _rewrite(out, code=code | dict.fromkeys(modules, "0" * 64))


def test_other_code_is_refused_by_its_modules(out, tmp_path):
    _simulated_by_other_code(out, "dess.model.rules", "dess.model.guard.moves")
    before = files_of(out)
    line = "made by other code of dess.model.guard.moves, dess.model.rules"
    with pytest.raises(InputError, match=line):
        run_study(small_study(tmp_path), out)
    assert files_of(out) == before


def test_a_run_that_accepts_other_code_keeps_the_missions(out, tmp_path):
    before = files_of(out)
    _simulated_by_other_code(out, "dess.model.rules")
    more = small_study(tmp_path, missions=15, policies=["greedy", "random", "tour"])
    results = run_study(more, out, accept_code=True)
    kept = {name: content for name, content in before.items() if name != "manifest.json"}
    assert kept.items() <= files_of(out).items()
    (change,) = results.manifest["accepted"]
    assert change["missions"] == 20
    assert change["modules"].keys() == {"dess.model.rules"}
    old, new = change["modules"]["dess.model.rules"]
    assert (old, new) == ("0" * 64, results.manifest["code"]["dess.model.rules"])
    assert load_results(out).missions.equals(results.missions)
    assert results.missions.equals(run_study(more, tmp_path / "at-once").missions)
    assert results.store.manifest.key != load_results(tmp_path / "at-once").store.manifest.key
    again = run_study(more, out)  # what was accepted is no other code
    assert again.manifest["accepted"] == results.manifest["accepted"]


def test_other_weights_are_refused_whatever_is_accepted(out, tmp_path):
    teams = json.loads((out / "manifest.json").read_text())["policies"]
    teams[1]["members"][0]["weights"] = "0" * 64
    _rewrite(out, policies=teams)
    for accept_code in (False, True):
        with pytest.raises(InputError, match="made by other weights of policy random"):
            run_study(small_study(tmp_path), out, accept_code=accept_code)


def test_a_policy_depends_on_the_modules_of_what_it_holds():
    learned = provenance.code_behind(["ddqn"])
    held = {
        "dess.policies.learner.policy",
        "dess.policies.network",
        "dess.envs.observations.vector",
    }
    assert held <= learned.keys()
    assert not {"dess.policies.learner.training", "dess.policies.learner.network"} & learned.keys()


def test_two_runs_of_one_folder_at_once(tmp_path):
    study = small_study(tmp_path)
    with Store.open(Manifest.of(study), tmp_path / "out"):
        for other in (study, small_study(tmp_path, missions=20)):
            with pytest.raises(InputError, match="in use by another run"):
                run_study(other, tmp_path / "out")
    assert len(run_study(study, tmp_path / "out").missions) == 20


def test_folders_that_were_put_together_count_once(tmp_path):
    few, more = small_study(tmp_path), small_study(tmp_path, missions=13)
    run_study(few, tmp_path / "out")
    expected = run_study(more, tmp_path / "more")
    for kind in ("missions", "uavs"):
        shutil.copytree(tmp_path / "out" / kind, tmp_path / "more" / kind, dirs_exist_ok=True)
    together = load_results(tmp_path / "more")
    pd.testing.assert_frame_equal(together.missions, expected.missions)
    pd.testing.assert_frame_equal(together.uavs, expected.uavs)


@pytest.mark.parametrize("name", ["{}" + "0" * 16, "0" * 16 + "{}"])
def test_a_file_under_another_name_does_not_pass(name, out):
    path = sorted((out / "missions").rglob("*.parquet"))[0]
    kept = path.stem[:17] if name.startswith("{") else path.stem[16:]
    path.rename(path.with_name(f"{name.format(kept)}.parquet"))
    with pytest.raises(InputError, match="damaged"):
        load_results(out)


def test_foreign_files_stay(out, tmp_path):
    notes = next((out / "missions").iterdir()) / "my-notes.parquet"
    notes.write_text("mine")
    # Of a killed run.
    (out / "missions" / "policy=greedy" / ".x.parquet.1.tmp").touch()
    run_study(small_study(tmp_path, logged=1), out)
    assert notes.read_text() == "mine"
    assert not [*out.rglob("*.tmp")]


@pytest.mark.parametrize("kind", ["uavs", "events"])
def test_what_is_in_the_place_of_a_file_is_refused_before_missions_are_simulated(
    kind, out, tmp_path
):
    next((out / "missions").rglob("*.parquet")).unlink()
    file = next((out / kind).rglob("*.parquet"))
    file.unlink()
    file.mkdir()
    before = files_of(out)
    with pytest.raises(InputError, match="is a folder; allowed: a file"):
        run_study(small_study(tmp_path, logged=1), out)
    assert {*files_of(out)} == {*before}


def test_a_long_team_has_a_short_folder(tmp_path):
    team = ",".join(["greedy", "random"] * 30)
    fleet = {"zone": [0, 0, 8, 8], "uavs": 60}
    study = small_study(tmp_path, policies=[team], missions=1, set=fleet)
    results = run_study(study, tmp_path / "out")
    assert results.policies == [team]
    assert len(load_results(tmp_path / "out").missions) == 1


def test_a_failure_is_forgotten_once_its_chunk_is_there(tmp_path):
    study = small_study(tmp_path)
    with Store.open(Manifest.of(study), tmp_path / "out") as store:
        chunk = Chunk(0, (CellPart(store.manifest.cells[0][0], range(2)),))
        path = store.write_failure(chunk, Failure("greedy", 2, "no", "dess", ""))
        assert path.exists()
        records = simulate_batch(study.scenarios[0], load("greedy"), 7, 2)
        store.keep("missions", chunk, parquet.tables_of(chunk, records))
        assert not path.exists()


def test_chunks_have_their_size_and_one_team():
    cells = [Cell(1, point, f"{point}", 0) for point in (0, 1, 2)]
    chunks = [*split_into_chunks([CellPart(cell, range(3)) for cell in cells], 4)]
    assert [(c.team, c.rows) for c in chunks] == [
        (1, [("0", 0, 3), ("1", 0, 1)]),
        (1, [("1", 1, 3), ("2", 0, 2)]),
        (1, [("2", 2, 3)]),
    ]


@given(
    st.tuples(st.integers(0, 30), st.integers(0, 30)),
    st.lists(st.tuples(st.integers(0, 30), st.integers(0, 30)), max_size=6),
)
def test_gaps_are_what_is_in_no_other_range(wanted, present):
    ranges = [range(*sorted(each)) for each in present]
    missing = gaps_between(range(*sorted(wanted)), ranges)
    there = {r for each in ranges for r in each}
    assert [r for gap in missing for r in gap] == [
        r for r in range(*sorted(wanted)) if r not in there
    ]


@pytest.mark.parametrize("size", [1, 2, 3, 100])
def test_small_files_are_joined_into_those_of_any_size(size, tmp_path, monkeypatch):
    """The files are those that a run with chunks of this size writes at once."""
    fleets = {"kind": "grid", "values": {"uavs": [1, 2]}}
    study = small_study(tmp_path, missions=5, policies=["greedy"], design=fleets)
    for name, of_chunk in (("joined", 2), ("expected", size)):
        monkeypatch.setitem(runner.CHUNK, "batch", of_chunk)
        run_study(study, tmp_path / name)
    with Store.open(Manifest.of(study), tmp_path / "joined") as store:
        store.merge([*split_into_chunks(store.manifest.parts_of_team(0, [5, 5]), size)])
    assert files_of(tmp_path / "joined") == files_of(tmp_path / "expected")
