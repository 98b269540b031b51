"""A scenario and a study whose missions take next to no time."""

import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from dess.analysis import load_study
from dess.analysis.ask.answer import VariationAnswer
from dess.analysis.ask.question import what_if_question
from dess.analysis.facts import Fact
from dess.analysis.study.study import Study
from dess.scenario.weather import REPLACED

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


# Two years of weather for the small scenario: it is calm for four hours a day, in two of which UAVs
# operate; not in January, and waves are high on the first ten days of July.
STORM, CALM = 30, 5  # [m/s]
HIGH, LOW = 3.0, 0.5  # [m]


def write_years(folder: Path, calm: Sequence[int] = range(1, 12), **weather: Any) -> Path:
    """The small scenario with a data sheet, one UAV, and two years of weather, as a TOML file.

    In a month that is not ``calm``, nobody flies; January has the number 0.
    """
    hours = np.arange("2019-01-01T00", "2021-01-01T00", dtype="datetime64[h]")
    months = hours.astype("datetime64[M]")
    of_day = (hours - hours.astype("datetime64[D]")).astype(int)
    is_calm = np.isin(months.astype(int) % 12, calm) & (of_day >= 8) & (of_day < 12)
    days = (hours.astype("datetime64[D]") - months).astype(int)
    is_high = (months.astype(int) % 12 == 6) & (days < 10)
    rows = zip(hours, np.where(is_calm, CALM, STORM), np.where(is_high, HIGH, LOW), strict=True)
    lines = [f"{hour}:00,{wind},45,{waves}" for hour, wind, waves in rows]
    (folder / "weather.csv").write_text("\n".join(["time,wind,from,waves", *lines]), "utf-8")
    section = {
        **{"file": "weather.csv", "operating": "08:00-10:00", "longitude": 0},
        **{"limits": {"waves": "1.5 m"}, "longest": "2 h"},
    }
    sheet = {key: value for key, value in SHEET["data_sheet"].items() if key not in REPLACED}
    return write_scenario(
        folder,
        **{**SHEET, "data_sheet": sheet, "uavs": 1, "weather": section | weather},
    )


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


# Missions of a chunk of the study that is divided into shards.
CHUNK_SIZE = 9


def divided_study(folder: Path) -> Study:
    """A study of seven chunks of missions, and as many of event logs and bounds."""
    return small_study(folder, design=grid(uavs=[1, 2, 3]), logged=1)


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
