"""The STRESS-DES checklist is complete, and no number in it is typed."""

import re
from pathlib import Path
from typing import Any

import pytest

from analysis import load_results, load_study, run_study
from analysis.figures import verification as drawings
from analysis.results.manifest import Manifest
from analysis.stats.intervals import LEVEL
from dess.scenario import Scenario, ScenarioSpace
from reports.pages import stress

# Monks et al. (2019), Table 1.
CHECKLIST = {"1": 3, "2": 4, "2.5": 5, "3": 4, "4": 3, "5": 4, "6": 1}

# Another value of every field of the paper's scenario.
OTHER: dict[str, Any] = {
    "grid": 41,
    "cell_size": 611.0,
    "altitude": 17.0,
    "nodes": [[0, 0], [7, 9], [33, 31], [34, 31], [35, 31], [36, 31], [37, 31]],
    "zone": [9, 27, 7, 9],
    "pads": 12,
    "forbid_swaps": True,
    "slot_length": 15.0,
    "communication_slots": 12,
    "max_slots": 617,
    "charge_rate": 17,
    "flight_cost": 0,
    "edge_snr": -31.0,
    "path_loss_exponent": 3.1,
    "shadowing_variance": 19.0,
    "initial_data": [9.0, 37.0],
    "arrival_rate": 0.07,
    "quota": 511,
    "reward_data": 7.7,
    "reward_overruled": -7.1,
    "reward_depleted": -711.0,
    "reward_charging": 0.71,
    "reward_quota": 177.0,
    "reward_step": -0.77,
    "uavs": [7, 7],
    "flying_time": [43, 59],
    "charge_start": [22, 31],
    "charge_complete": [63, 91],
}
# What has numbers of its own: citations, mathematics, and names.
CITED = re.compile(
    r"eq\. [\d-]+(, \d+)*|EAAI-22-4101|Philox 4x32-10|`[^`]*`|<sub>\d+</sub>|1 \+ SNR|time 0"
    r"|from 0 on|^\d  ",
    re.M,
)


def manifest(**changes: Any) -> dict[str, Any]:
    return Manifest.of(load_study("verification", **changes)).data


def told(data: dict[str, Any], *others: dict[str, Any]) -> str:
    """All words of the checklist, its diagram and its table."""
    space = ScenarioSpace.of(**data["scenario"])
    steps, *rest = stress.overview(space)
    words = [item.text for item in stress.report(data, others)]
    words += [*rest, *(word for step in steps for word in step)]
    return "\n".join([*words, *stress.parameters(space)["Value"]])


def test_every_item_of_the_checklist_is_there_and_filled() -> None:
    items = stress.report(manifest())
    numbers = [item.number for item in items]
    expected = [
        f"{section}.{n}" for section, count in CHECKLIST.items() for n in range(1, count + 1)
    ]
    assert sorted(numbers) == sorted(expected)
    assert all(item.name and item.text.strip() for item in items)
    assert {number.split(".")[0] for number in numbers} == set(stress.SECTIONS)


def test_every_input_parameter_is_there() -> None:
    data = manifest()
    table = stress.parameters(ScenarioSpace.of(**data["scenario"]))
    assert set(table["Field"]) == set(Scenario.model_fields) == set(OTHER)
    assert table.notna().all(axis=None)


@pytest.mark.parametrize("field", OTHER)
def test_a_change_of_the_scenario_changes_what_is_told(field: str) -> None:
    wider = {"grid": OTHER["grid"]} if field in ("nodes", "zone") else {}
    fewer = {"uavs": 3} if field == "zone" else {}
    assert told(manifest(set=wider | fewer | {field: OTHER[field]})) != told(
        manifest(set=wider | fewer)
    )


def test_no_number_of_the_model_is_typed() -> None:
    """Scenarios that have nothing in common share the level of the intervals, and no more."""
    about = {"version": "x", "commit": "y", "libraries": {"python": "p", "numpy": "q"}}
    numbers = []
    for changes, seed, missions in (({}, 501, 301), (OTHER, 502, 302)):
        data = manifest(set=changes, seed=seed, missions=missions) | about
        text = re.sub("1 design point", "", CITED.sub("", told(data)))
        numbers.append(set(re.findall(r"\d+(?:[.,]\d+)*", text)))
    assert set.intersection(*numbers) == {f"{100 * LEVEL:g}"}
    assert all(len(own) > 30 for own in numbers)


def test_studies_tell_what_they_are_about() -> None:
    others = [Manifest.of(load_study(name)).data for name in ("fig5", "sweet-spot")]
    items = {item.number: item.text for item in stress.report(manifest(), others)}
    for data in others:
        study = data["study"]
        assert f"`{study['name']}`: {study['description']}" in items["1.3"]
        assert f"{len(data['points'])} design points ({study['design']['kind']})" in items["1.3"]
    assert "by `kn-bounded`" in items["1.3"]
    assert "`initial_data`" in items["2.3"] and "`uavs`" in items["2.3"]
    assert "`ddqn`" in items["2.4"] and "another package" not in items["2.4"]
    assert "as a rule asked for, in `sweet-spot`" in items["4.3"]


def test_missions_are_those_that_were_flown(tmp_path: Path) -> None:
    study = load_study("verification", policies=["random"], missions=3, logged=0)
    data = run_study(study, tmp_path / "out").manifest
    text = {item.number: item.text for item in stress.report(data)}
    assert "3 in `verification`" in text["4.3"]
    assert load_results(tmp_path / "out").manifest == data


def test_scarce_pads_make_a_queue() -> None:
    queue = {item.number: item.text for item in stress.report(manifest(set={"pads": 1}))}["2.5.4"]
    assert "With 1 pad for 1 to 3 UAVs, UAVs in excess wait" in queue
    assert (
        "nobody ever waits" in dict((i.number, i.text) for i in stress.report(manifest()))["2.5.4"]
    )


def test_no_text_of_the_diagram_leaves_its_box() -> None:
    for changes in ({}, OTHER):
        space = ScenarioSpace.of(**manifest(set=changes)["scenario"])
        figure = drawings.slot(*stress.overview(space))
        figure.canvas.draw()
        (ax,) = figure.axes
        for text in ax.texts:
            ends = text.get_window_extent().transformed(ax.transData.inverted())
            assert ends.x1 <= (10 if text.get_rotation() == 0 else ax.get_xlim()[1]), text
