"""A scenario and a study whose missions take next to no time."""

import os
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import tomli_w

from dess.analysis import load_study
from dess.analysis.ask.answer import VariationAnswer
from dess.analysis.ask.question import what_if_question
from dess.analysis.facts import Fact
from dess.analysis.study.study import Study

SCENARIO: dict[str, Any] = {
    "grid": 8,
    "nodes": [[1, 1], [2, 6], [5, 4]],
    "zone": [5, 0, 3, 2],
    "uavs": [1, 3],
    "flying_time": [20, 30],
    "charge_start": [10, 15],
    "charge_complete": [40, 60],
    "quota": 60,
}
# A data sheet for the small scenario, in the place of what follows from it.
SHEET: dict[str, Any] = {
    **{"flying_time": 80, "charge_start": 30, "charge_complete": 80, "quota": 0},
    "age": {"measured": True},
    "data_sheet": {
        **{"endurance": "35 min", "cruise": "15 m/s", "charging": "40 min", "horizon": "2 h"},
        **{
            "data_rate": "3 MB/h",
            "backlog": "2 MB",
            "wind": "4 m/s from SW",
            "max_speed": "20 m/s",
        },
        **{"bandwidth": "125 kHz", "snr": "12 dB at 2 km", "range": "2 km"},
    },
}


def write_scenario(folder: Path, **changes: Any) -> Path:
    """The small scenario as a TOML file."""
    path = folder / "small.toml"
    path.write_text(tomli_w.dumps(SCENARIO | changes), "utf-8")
    return path


def small_study(folder: Path, **changes: Any) -> Study:
    """A study of the small scenario; a rule takes the place of the number of missions."""
    values = {
        "scenario": write_scenario(folder).name,
        "policies": ["greedy", "random"],
        "missions": 10,
        "seed": 7,
    }
    if changes.keys() & {"precision", "selection"}:
        del values["missions"]
    path = folder / "trial.toml"
    path.write_text(tomli_w.dumps(values), "utf-8")
    return load_study(path, **changes)


def asked(folder: Path, missions: int = 12, **changes: Any) -> VariationAnswer:
    """The answer to a question about the small scenario: six UAVs at a single pad, not two."""
    values = {
        "settings": {"uavs": 6, "pads": 1},
        "baseline": {"uavs": 2},
        "policies": ["random", "greedy"],
        "seed": 3,
        "scenario": write_scenario(folder),
        "missions": missions,
    }
    question = what_if_question(**values | changes, folder=folder)
    return VariationAnswer(question.ask(), question)


def found_of(facts: Iterable[Fact]) -> dict[str, str]:
    """What facts say was found, by their labels."""
    return {fact.label: fact.found for fact in facts}


def grid(**values: Any) -> dict[str, Any]:
    """The design of every combination of the values."""
    return {"kind": "grid", "values": values}


def files_of(folder: Path) -> dict[str, bytes]:
    """Everything in a folder, by relative path."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file() and path.name != ".lock")
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def environment() -> dict[str, str]:
    """A process of its own imports what this one imports."""
    return os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
