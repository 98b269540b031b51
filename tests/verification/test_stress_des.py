"""The STRESS-DES checklist is complete, and no number in it is typed."""

import re
from typing import Any

import pytest

from dess.analysis import load_study, study_names
from dess.analysis.results.manifest import Manifest
from dess.analysis.stats.kinds import LEVEL
from dess.scenario.fields import GEOMETRY, LANDING, SECTIONS
from dess.scenario.scenario import Scenario
from tests.pins.pinned import check_kept
from tests.verification import stress_des
from tests.verification.page import KEPT
from tests.verification.suite import STUDY

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
    r"|from 0 on|^\d  |^## \d|^\*\*[\d.]+",
    re.M,
)


def manifest(**changes: Any) -> dict[str, Any]:
    return Manifest.of(load_study(STUDY, **changes)).data


def words(data: dict[str, Any], *others: dict[str, Any]) -> str:
    """All words of the checklist, its diagram and its table."""
    description = stress_des.describe_model(data, others)
    steps, *rest = description.overview
    texts = [*description.sections.values(), *rest, *(word for step in steps for word in step)]
    return "\n".join([*texts, *description.parameters["Value"]])


def test_every_input_parameter_is_in_the_table():
    table = stress_des.describe_model(manifest()).parameters
    fields = table["Input parameter [unit]"].str.partition(":")[0]
    off = {*SECTIONS, *GEOMETRY, LANDING}
    assert set(fields) == set(Scenario.model_fields) - off == set(OTHER)
    assert table.notna().all(axis=None)


def test_no_number_of_the_model_is_typed():
    """Scenarios that have nothing in common share the level of the intervals, and no more."""
    about = {"version": "x", "commit": "y", "libraries": {"python": "p", "numpy": "q"}}
    numbers = []
    for changes, seed, missions in (({}, 501, 301), (OTHER, 502, 302)):
        data = manifest(set=changes, seed=seed, missions=missions) | about
        text = re.sub("1 design point", "", CITED.sub("", words(data)))
        numbers.append(set(re.findall(r"\d+(?:[.,]\d+)*", text)))
    assert set.intersection(*numbers) == {f"{100 * LEVEL:g}"}
    assert all(len(of_scenario) > 30 for of_scenario in numbers)


@pytest.mark.slow
@pytest.mark.brief
def test_the_page_of_the_docs_describes_the_shipped_studies():
    """``DESS_WRITE_PINS=1`` writes it."""
    others = [Manifest.of(load_study(name)).data for name in study_names() if name != STUDY]
    check_kept(KEPT / "stress-des.md", stress_des.render_model(manifest(), others))
