"""The page of a sweep says what its missions say, and its notebook runs with a changed cell."""

from pathlib import Path
from typing import Any

from analysis import load_results, numbers
from tests.analysis.small import write_scenario
from tests.reports.small import said_by

NAME = "sweep"
ASKED: dict[str, Any] = {
    "fields": {"uavs": [1, 2], "quota": [20, 40], "pads": 2},
    "policies": ["random", "greedy"],
    "missions": 12,
    "seed": 3,
}


def test_the_page_says_what_the_missions_say(tmp_path: Path) -> None:
    scenario = write_scenario(tmp_path)
    text = said_by(NAME, results=str(tmp_path), scenario=str(scenario), **ASKED)
    (folder,) = (path for path in (tmp_path / "sweeps").iterdir() if path.is_dir())
    missions = load_results(folder).missions
    means = missions.groupby(["policy", "point"])["collection_ratio"].mean()
    for mean in means:
        assert numbers.percent(mean) in text
    assert "12 per policy and design point, 96 in all" in text
    command = "dess sweep --set pads=2 --set uavs=1,2 --set quota=20,40 --policy random,greedy"
    assert f"{command} --missions 12 --seed 3 --scenario small.toml" in text
