"""What a study may ask for, and what is refused before a mission is simulated."""

import pickle
import shlex

import pytest
import tomli_w
from pydantic import ValidationError

from dess import InputError, load_scenario
from dess.analysis import load_study, run_study
from dess.analysis.study.study import Study
from dess.policies.registry import load_team
from tests.analysis.small import grid, small_study


def test_a_study_takes_the_engine_that_one_of_its_points_needs(tmp_path):
    design = grid(**{"arrivals.process": ["slotted", "continuous"]})
    assert small_study(tmp_path).engine == "batch"
    assert small_study(tmp_path, design=design).engine == "events"
    assert small_study(tmp_path, design=design, engine="events").engine == "events"
    with pytest.raises(InputError, match=r"arrivals\.process: continuous needs the SimPy engine"):
        small_study(tmp_path, design=design, engine="batch")


BAD = {
    "missions = 0": ["missions: 0 is out of range; allowed: an integer 1.."],
    "logged = 2000": ["logged: 2000", "0..1000"],
    "policies = ['greedy', 'greedy']": ["greedy is listed twice"],
    "design = {kind = 'grid', values.uavs = [[1, 1], 1]}": ["uavs=1 is listed twice"],
    "design = {kind = 'one-at-a-time', values.arrival_rate = [0.0, -0.0]}": ["is listed twice"],
    "design = {kind = 'saltelli', base = 2, ranges.uavs = [1, 2]}": ["missions = 1"],
    "set.uavs = 1\ndesign = {kind = 'grid', values.uavs = [1, 2]}": ["uavs is also in set"],
    "design = {kind = 'grid', values.charge_start = [30, 70]}": [
        "at charge_start=70",
        "charge_complete",
    ],
    "missions = 9\nprecision.targets.success.absolute = 0.1": [
        "missions: are decided by precision"
    ],
    "missions = 9\nselection = {procedure = 'kn-bounded', indifference = 0.1}": [
        "missions: are decided by selection"
    ],
    "selection = {procedure = 'kn-bounded', indifference = 0.1}\n"
    "precision.targets.success.absolute = 0.1": ["precision: selection is also given"],
    "selection = {procedure = 'kn-bounded', indifference = 0.1, first = 9, budget = 8}": [
        "selection.budget: 8",
        "9 or more",
    ],
    "selection = {procedure = 'cheapest', requirements.success = 0.99, indifference = 1}": [
        "costs: are missing; allowed: a table of prices"
    ],
}


@pytest.mark.parametrize("text", BAD)
def test_a_bad_study_gets_one_line(text, tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text(text if "policies" in text else f"policies = ['greedy']\n{text}")
    with pytest.raises(InputError) as error:
        load_study(path)
    line = str(error.value)
    assert line.startswith(f"{path}: ")
    assert "\n" not in line
    for part in BAD[text]:
        assert part in line


def test_the_sea_may_differ_from_point_to_point(tmp_path):
    names = ("coast:4", "bay", "german-bight")
    design = {"kind": "grid", "values": {"scenario": [*names]}}
    study = small_study(tmp_path, design=design, set={"uavs": 2}, missions=2)
    expected = [load_scenario(name, uavs=2) for name in names]
    assert [*study.scenarios] == expected
    results = run_study(study, tmp_path / "seas")
    assert [results.scenario(point) for point in range(3)] == expected
    command = shlex.split(results.command("greedy", 0, 1))
    assert command[command.index("--scenario") + 1] == "coast:4"
    for unknown, line in (
        ("small.toml", "scenario: 'small.toml' is unknown"),
        ("coats:4", "coast"),
    ):
        with pytest.raises(InputError, match=line):
            small_study(tmp_path, design={"kind": "grid", "values": {"scenario": [unknown, "bay"]}})


def test_nodes_of_a_file_stay_where_they_are(tmp_path):
    """They are cells in the manifest, so a design must not move them."""
    (tmp_path / "buoys.csv").write_text("lon,lat\n8.50,54.25\n8.52,54.26\n")
    scenario = tmp_path / "sea.toml"
    scenario.write_text('nodes = "buoys.csv"\ngrid = 12\nzone = [0, 0, 2, 2]\nuavs = 1\n')
    values = {"name": "sea", "policies": ["greedy"], "scenario": str(scenario)}
    path = tmp_path / "sea-study.toml"

    def study(**more):
        path.write_text(tomli_w.dumps(values | {"scenario": "sea.toml"} | more))
        return load_study(path)

    nodes = ((5, 6), (6, 5))
    assert [space.nodes for space in study(design=grid(quota=[1, 2])).scenarios] == [nodes] * 2
    assert study(set={"grid": 14}).scenarios[0].nodes == ((6, 7), (7, 6))
    with pytest.raises(InputError, match="at grid=14: grid moves the nodes of a file"):
        study(design=grid(grid=[12, 14]))
    (tmp_path / "rocks.csv").write_text("lon,lat\n8.52,54.25\n")
    scenario.write_text(f'no_fly = "rocks.csv"\n{scenario.read_text()}')
    with pytest.raises(InputError, match="at grid=14: grid moves the no_fly of a file"):
        study(design=grid(grid=[12, 14]), set={"nodes": [[7, 1]]})
    scenario.write_text(scenario.read_text().partition("\n")[2])
    fixed = grid(grid=[12, 14])
    assert study(design=fixed, set={"nodes": [[1, 1]]}).scenarios[1].nodes == ((1, 1),)


def test_bounds_of_extended_scenarios_are_refused_before_the_run(tmp_path):
    with pytest.raises(InputError, match="trial.toml: bound: the scenario has sections") as error:
        small_study(tmp_path, bounds=True, set={"age.measured": True})
    assert "\n" not in str(error.value)


def test_a_study_takes_what_was_typed_to_its_workers_and_leaves_it_out_of_its_data(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "typed_words.py").write_text("from dess.policies.heuristics import Greedy")
    study = small_study(tmp_path, policies=["greedy", "greedy , typed_words.py:Greedy"])
    sent = pickle.loads(pickle.dumps(study))
    assert sent.policies == ("greedy", "greedy,typed_words.py:Greedy")
    members = load_team(sent.policies[1], run_files=sent.run_files)
    assert [policy.name for policy in members] == ["greedy", "greedy"]
    assert "run_files" not in study.model_dump_json()
    with pytest.raises(ValidationError, match="is a Python file, which is run only if you name it"):
        Study.model_validate_json(study.model_dump_json())
