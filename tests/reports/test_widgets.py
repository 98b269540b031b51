"""The panel of a what-if question: its sliders, what they ask, and what is answered."""

import re
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from typing import Any

import pytest

from analysis import what_if
from dess import InputError, load_scenario
from reports.widgets import FIELDS, WhatIfPanel, what_if_panel
from tests.analysis.small import files_of, write_scenario
from tests.reports.small import words

MISSIONS = 6


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("panel")


@pytest.fixture
def panel(folder: Path) -> WhatIfPanel:
    return panel_of(folder)


def panel_of(folder: Path, **changes: Any) -> WhatIfPanel:
    """A panel about the small scenario."""
    options = {"policies": ["greedy"], "folder": folder, "missions": MISSIONS, **changes}
    return what_if_panel(write_scenario(folder), **options)


def shown(panel: WhatIfPanel) -> str:
    return unescape(re.sub("<[^>]+>", "", panel.output.value))


def manifests(folder: Path) -> Iterator[Path]:
    return (folder / "what-if").glob("*/manifest.json")


def test_sliders_stand_where_the_scenario_and_the_question_have_their_fields(folder: Path) -> None:
    panel = panel_of(folder, settings={"uavs": 6, "pads": 1}, baseline={"uavs": 2})
    space = load_scenario(folder / "small.toml")
    assert [*panel.baseline] == [*panel.variation] == [*FIELDS]
    assert panel.baseline["uavs"].value == (2, 2) and panel.variation["uavs"].value == (6, 6)
    assert panel.baseline["pads"].value == space.zone_cells and panel.variation["pads"].value == 1
    assert panel.baseline["initial_data"].value == space.initial_data
    assert panel.baseline["arrival_rate"].value == space.arrival_rate


def test_sliders_reach_from_limit_to_limit_or_to_twice_the_value(panel: WhatIfPanel) -> None:
    reach = {f: (slider.min, slider.max, slider.step) for f, slider in panel.baseline.items()}
    assert reach["uavs"] == (1, 6, 1)  # the zone has six cells
    assert reach["pads"] == (1, 6, 1)
    assert reach["charge_start"] == (10, 30, 1)
    assert reach["quota"] == (1, 120, 1)
    assert reach["initial_data"] == (0, 40, 0.1)
    assert reach["arrival_rate"] == (0, 0.04, 0.0001)


def test_the_variation_follows_the_baseline_until_it_stands_elsewhere(panel: WhatIfPanel) -> None:
    panel.baseline["quota"].value = 70
    assert panel.variation["quota"].value == 70
    panel.variation["quota"].value = 80
    panel.baseline["quota"].value = 75
    assert panel.variation["quota"].value == 80


def test_the_answer_is_that_of_the_same_question(panel: WhatIfPanel, folder: Path) -> None:
    panel.baseline["uavs"].value = (2, 3)
    panel.variation["quota"].value = 30
    panel.button.click()
    question = {"quota": 30}, {"uavs": [2, 3]}, folder / "small.toml", ["greedy"], MISSIONS
    asked = what_if(*question, folder=folder)
    (answer,) = (line for line in asked.answer().splitlines() if "greedy**" in line)
    assert words(answer.removeprefix("- ")) in shown(panel)
    assert re.search(r"by [+−][^0].* points", answer) and "<img " in panel.output.value
    assert panel.progress.value == panel.progress.max == 2 * MISSIONS
    assert not panel.button.disabled


def test_the_same_question_is_simulated_once(tmp_path: Path) -> None:
    for _ in range(2):
        panel = panel_of(tmp_path)
        panel.variation["pads"].value = 2
        panel.button.click()
        assert "collection ratio" in shown(panel)
    assert len([*manifests(tmp_path)]) == 1


def test_fields_without_a_slider_stay_as_they_are_asked(tmp_path: Path) -> None:
    panel = panel_of(tmp_path, settings={"zone": [4, 0, 4, 2]}, fields=["quota"])
    panel.baseline["quota"].value = 50
    panel.button.click()
    what_if(
        *({"zone": [4, 0, 4, 2]}, {"quota": 50}, tmp_path / "small.toml", ["greedy"], MISSIONS),
        folder=tmp_path,
    )
    assert len([*manifests(tmp_path)]) == 1


def test_fields_are_chosen(tmp_path: Path) -> None:
    panel = panel_of(tmp_path, fields=["quota"])
    assert [*panel.baseline] == ["quota"]
    assert "pads" in panel.more.options and not {"quota", "zone"} & {*panel.more.options}
    panel.more.value = "pads"
    assert [*panel.baseline] == [*panel.variation] == ["quota", "pads"]
    assert "pads" not in panel.more.options
    panel.variation["pads"].value = 1
    panel.button.click()
    assert "collection ratio" in shown(panel)


def test_policies_are_chosen(tmp_path: Path) -> None:
    panel = panel_of(tmp_path)
    assert {name for name, box in panel.policies.items() if box.value} == {"greedy"}
    panel.policies["random"].value, panel.policies["greedy"].value = True, False
    panel.variation["pads"].value = 1
    panel.button.click()
    assert "random: collection ratio" in shown(panel) and "greedy" not in shown(panel)


@pytest.mark.parametrize(
    ("field", "value", "line"),
    [
        (None, None, "settings: none is given; allowed: one or more of"),
        ("charge_start", (10, 30), "charge_start: 30 is not below charge_complete 20"),
    ],
)
def test_a_question_that_is_none_is_refused_in_a_line(
    tmp_path: Path, field: str | None, value: Any, line: str
) -> None:
    panel = panel_of(tmp_path)
    if field:
        panel.variation["charge_complete"].value = (20, 60)
        panel.variation[field].value = value
    before = files_of(tmp_path)
    panel.button.click()
    assert line in shown(panel) and "<img" not in panel.output.value
    assert not panel.button.disabled and files_of(tmp_path) == before


def test_no_policy_is_refused_in_a_line(panel: WhatIfPanel) -> None:
    panel.policies["greedy"].value = False
    panel.variation["pads"].value = 1
    panel.button.click()
    assert "question: policies" in shown(panel)


@pytest.mark.parametrize(
    ("fields", "line"),
    [(["zone"], "'zone' is not a number; allowed: .*quota"), (["uav"], "'uav' is not a number")],
)
def test_a_field_that_has_no_slider_is_refused(folder: Path, fields: list[str], line: str) -> None:
    with pytest.raises(InputError, match=f"field: {line}"):
        panel_of(folder, fields=fields)
