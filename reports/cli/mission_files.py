"""A simulated mission written into files: its event log, picture, animation, path and plan."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from dess.base.errors import InputError
from dess.reports.cli import console

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure

    from dess.analysis.flights.flight_plan import FlightPlan
    from dess.analysis.flights.separation import Separation
    from dess.model.record import MissionRecord
    from dess.scenario.own_sea import Positions
    from dess.scenario.scenario import Scenario, ScenarioSpace

LOGS = (".parquet", ".csv")
FIGURES = (".png", ".pdf", ".svg")
ANIMATIONS = (".gif", ".mp4", ".html")
PATHS = (".geojson", ".kml", ".gpx", ".csv")


@dataclass(frozen=True)
class SimulatedMission:
    """A simulated mission to write into files: its record with its event log, and its names."""

    record: "MissionRecord"
    scenario: "Scenario"
    title: str
    separation: "Separation"
    start: datetime | None = None

    @property
    def log(self) -> "dict[str, np.ndarray]":
        """The columns of the event log."""
        assert self.record.events is not None
        return self.record.events.columns()

    @property
    def outcome(self) -> str:
        """How the mission ended, in sentences."""
        from dess.analysis.metrics import format_length
        from dess.analysis.numbers import format_percent
        from dess.analysis.results.event_log import causes_of_failure

        ends = [uav["end"] for uav in self.record.uav_rows()]
        ended = sum(end in ("quota", "landed") for end in ends)
        outcome = (
            f"{format_percent(self.record.collection_ratio)} of the data collected in "
            f"{format_length(self.record.slots, self.scenario.units)}; {ended} of {len(ends)} UAVs "
            f"{self.scenario.aim}."
        )
        return " ".join([outcome, *(f"{c}." for c in causes_of_failure(self.log, self.scenario))])


def _write_log(mission: SimulatedMission, path: Path, kind: str) -> None:
    import numpy as np
    import pandas as pd
    import pyarrow as pa

    from dess.analysis.numbers import write_csv
    from dess.base.files.tables import parquet_of
    from dess.base.files.writing import fill

    columns = dict(mission.log)
    if names := mission.scenario.names:
        columns["name"] = np.array([*names, None])[columns["node"]]
    if kind == "csv":
        fill(path, write_csv(pd.DataFrame(columns)).encode())
    else:
        fill(path, parquet_of(pa.table(columns)))


def _write_map(mission: SimulatedMission, path: Path, kind: str) -> None:
    from dess.analysis.figures.missions import mission_figure

    save_figure(mission_figure(mission.log, mission.scenario), path, kind)


def save_figure(figure: "Figure", path: Path, kind: str) -> None:
    """Write a figure into a temporary file; ``kind`` is the ending of its final name."""
    figure.savefig(path, format=kind)


def _write_animation(mission: SimulatedMission, path: Path, kind: str) -> None:
    from dess.reports.animation import write_animation

    if kind == "html":
        _write_page(mission, path)
    else:
        write_animation(mission.log, mission.scenario, path, kind, mission.title)


def _write_path(mission: SimulatedMission, path: Path, kind: str) -> None:
    from dess.analysis.results.paths import path_text
    from dess.base.files.writing import fill

    altitudes = None
    if mission.scenario.units and mission.scenario.landing:
        altitudes = mission.separation.altitudes(mission.scenario)
    text = path_text(mission.log, mission.scenario, kind, mission.start, altitudes)
    fill(path, text.encode())


@dataclass(frozen=True)
class Outputs:
    """What a mission is written into."""

    events: Path | None
    figure: Path | None
    animation: Path | None
    path: Path | None
    plan: Path | None

    @property
    def files(self) -> list[Path]:
        """The files."""
        chosen = (self.events, self.figure, self.animation, self.path)
        return [file for file in chosen if file]

    @property
    def need_log(self) -> bool:
        """Whether an output is made from the event log."""
        return bool(self.files) or self.plan is not None

    @property
    def fill_stdout(self) -> bool:
        """Whether standard output has the event log."""
        return self.events is not None and console.is_stdout(self.events)

    def check_degrees(self, space: "ScenarioSpace") -> None:
        """Refuse a path in degrees of a sea that has none."""
        if self.path and self.path.suffix.lower() in (".kml", ".gpx") and space.centre is None:
            raise InputError(f"--path: {self.path}", "the sea has no degrees", ".geojson, .csv")

    def check_files(self, as_json: bool) -> None:
        """Refuse files that exclude each other, have a wrong ending, or cannot be made here."""
        if len({file.absolute() for file in self.files}) < len(self.files):
            raise InputError("--events, --figure", "the same file", "a file for each")
        console.check_ending("--events", self.events, LOGS, "an event log", is_stream=True)
        console.check_ending("--figure", self.figure, FIGURES, "a picture")
        console.check_ending("--animation", self.animation, ANIMATIONS, "an animation")
        console.check_ending("--path", self.path, PATHS, "a path")
        if self.animation and self.animation.suffix.lower() == ".mp4":
            from dess.reports.animation import check_ffmpeg

            check_ffmpeg()
        if self.fill_stdout and as_json:
            raise InputError("--json", "standard output has the event log", "--events FILE")

    def write(self, mission: SimulatedMission, temporaries: Sequence[Path]) -> None:
        """Write the mission into temporary files, which become ``files``."""
        from dess.base.files.writing import writable

        writers = {
            self.events: _write_log,
            self.figure: _write_map,
            self.animation: _write_animation,
            self.path: _write_path,
        }
        for file, temporary in zip(self.files, temporaries, strict=True):
            with writable(file):
                writers[file](mission, temporary, file.suffix[1:].lower())


def write_plan(mission: SimulatedMission, positions: "Positions", folder: Path) -> "FlightPlan":
    """Write the plan of a mission into a folder."""
    from dess.analysis.flights.flight_plan import FlightPlan
    from dess.base.files.writing import fill

    flight_plan = FlightPlan.of(
        mission.log, mission.scenario, positions, mission.start, mission.separation
    )
    for name, text in flight_plan.make_files().items():
        fill(folder / name, text)
    return flight_plan


def _write_page(mission: SimulatedMission, path: Path) -> None:
    """Write a page with the player of the mission; the same mission gives the same bytes."""
    from dess.base.files import writing
    from dess.reports import player
    from dess.reports.pages.templates import fill_page

    caption = player.explain_player(mission.scenario)
    shown = player.Shown(mission.log, mission.scenario)
    played = player.make_player([shown], "mission", caption)
    parts = {"library": player.player_script().data, "player": played.data}
    title, outcome = mission.title, mission.outcome
    page = fill_page("mission.html", scripts=True, title=title, outcome=outcome, **parts)
    writing.fill(path, page)
