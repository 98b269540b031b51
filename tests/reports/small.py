"""Small results of the studies that the reports read, and what is looked for in pages."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dess.analysis import load_study, run_study
from dess.analysis.bound import Bound
from dess.analysis.execution import jobs
from dess.policies.planner import Budget, Planner
from dess.reports.pages import figures
from dess.reports.pages.notebook import Report, read_report
from dess.reports.player import player_script
from dess.scenario.scenario import ScenarioSpace
from tests.analysis.small import grid
from tests.reports.here import run_cells

EMBEDDED = re.compile("data:image/svg\\+xml;base64,([A-Za-z0-9+/=]+)")

POLICIES = ["random", "greedy", "ddqn"]
# Three generated seas of as many families.
_SEAS = grid(scenario=["coast:2", "scattered:2", "large:2"])
_CORNERS = grid(uavs=[1, 3], initial_data=[[5, 7.5], 10])
RULE = {"procedure": "kn-bounded", "first": 4, "indifference": 0.01, "budget": 60, "check": 12}
STUDIES: dict[str, dict[str, Any]] = {
    "table4": {"policies": POLICIES, "missions": 40},
    "fig1": {"missions": 8},
    "comparison": {"policies": POLICIES, "missions": 40},
    "fig4": {"policies": POLICIES, "missions": 8, "logged": 2},
    "fig5": {"policies": POLICIES, "missions": 8},
    "sweet-spot": {"policies": POLICIES, "selection": RULE, "design": _CORNERS},
    "pads": {"missions": 8, "logged": 2, "design": grid(uavs=[2, 4], pads=[1, 2, 4])},
    "age": {"missions": 4, "design": grid(uavs=[1, 2], arrival_rate=[0.1, 0.5])},
    "failures": {
        "missions": 8,
        "design": grid(
            **{"uavs": [2, 3], "failures.uav_rate": [0.0, 0.01]},
            **{"failures.uav_repair": [0.0, 20.0]},
        ),
    },
    "planning": {"policies": [*POLICIES, "planner"], "missions": 40, "logged": 2},
    "gap": {"policies": [*POLICIES, "planner"], "missions": 12},
    "seas": {"policies": ["generalist", "greedy", "planner"], "missions": 4, "design": _SEAS},
    "seas-landing": {"policies": ["generalist", "greedy"], "missions": 4, "design": _SEAS},
    "seas-horizon": {
        "policies": ["generalist", "greedy"],
        "missions": 4,
        "set": {"landing": True, "quota": 0, "max_slots": 60},
        "design": _SEAS,
    },
    "sensitivity": {
        "policies": ["greedy"],
        "design": {
            "kind": "saltelli",
            "base": 8,
            "ranges": {"uavs": [1, 3], "charge_start": [10, 50]},
            "seed": 1,
        },
    },
}


def made_up(space: ScenarioSpace, seed: int, replication: int, **_: int) -> Bound:
    """A bound of the study gap that takes no time."""
    prices = np.full((2, len(space.nodes)), 0.1) * (1 + np.arange(len(space.nodes)) % 4)
    return Bound(0.97, prices, np.array([60, 120]), 1)


@contextmanager
def quick() -> Iterator[None]:
    """Bounds that take no time, and planners that search little."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jobs, "upper_bound", made_up)
        patch.setattr(Planner, "budget", Budget(500, 20))
        yield


def run_small_studies(folder: Path, *names: str) -> Path:
    """Run the studies, all or some, each into a folder of its name."""
    for name in names or STUDIES:
        with quick():
            run_study(load_study(name, **STUDIES[name]), folder / name)
    return folder


class Links(HTMLParser):
    """Everything that a page refers to or loads.

    Attributes:
        found: The targets.
        tags: The kinds of its elements.
        outside_scripts: The page without its drawings and its scripts.
    """

    def __init__(self, html: str):
        super().__init__()
        self.found: list[str] = []
        self.tags: set[str] = set()
        bare = re.sub(
            r"<script[^>]*>.*?</script>", "", html.replace(player_script().data, ""), flags=re.S
        )
        self.outside_scripts = EMBEDDED.sub("", bare)
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        kinds = {"src", "href", "srcset", "data", "action"}
        self.found += [value or "" for key, value in attrs if key in kinds]


def words_of(html: str) -> str:
    """The words of a page, without its drawings, its scripts and its code."""
    main = html.split("<main")[1].split('<details class="code">')[0]
    return words(Links(main).outside_scripts)


def words(html: str) -> str:
    """The words of a piece of a page, be it of HTML or Markdown."""
    bare = re.sub(r"<(script|style).*?</\1>|<[^>]+>", " ", html, flags=re.S)
    return unescape(re.sub(r"\s+", " ", bare)).replace("**", "")


def shown_by(source: str | Report, **parameters: Any) -> str:
    """What a notebook shows, which is run here, and nothing drawn.

    The notebook is a report, or that of a name.

    A kernel of its own and the drawings take most of the time that a page takes.
    """
    report = read_report(source) if isinstance(source, str) else source
    report.set_parameters(parameters)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "encode_figure", lambda drawing, kind: b"")
        return "\n".join(piece.data for _, pieces in run_cells(report) for piece in pieces)


def said_by(source: str | Report, **parameters: Any) -> str:
    """The words of what a notebook shows."""
    return words(shown_by(source, **parameters))
