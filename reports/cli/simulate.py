"""``dess simulate``: one mission, its event log, its picture and its animation."""

import json
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dess import InputError
from reports.cli import console
from reports.cli.settings import JsonOption, ScenarioOption, SeedOption, SetOption, load_space

if TYPE_CHECKING:
    import numpy as np

    from dess.record import MissionRecord
    from dess.scenario import Scenario

FIGURES = (".png", ".pdf", ".svg")
ANIMATIONS = (".gif", ".mp4", ".html")
# Metrics of ``--json``, between the names and the UAVs.
METRICS = (
    "slots",
    "success",
    "collection_ratio",
    "collection_ratio_and_communication",
    "initial",
    "arrived",
    "collected",
    "residual",
)

app = typer.Typer()


@app.command()
def simulate(
    scenario: ScenarioOption = "paper",
    settings: SetOption = None,
    policy: Annotated[
        str,
        typer.Option(metavar="P[,P...]", help="A policy, or several that the UAVs follow in turn."),
    ] = "greedy",
    seed: SeedOption = 0,
    replication: Annotated[
        int, typer.Option(help="Number of the replication, which selects the random draws.")
    ] = 0,
    events: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.parquet", help="Write the event log of the mission into this file."
        ),
    ] = None,
    figure: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="Draw the mission into this file.")
    ] = None,
    animation: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.gif",
            help="Write the mission as an animation: .gif, .mp4 (needs ffmpeg), or .html, a page "
            "with its player.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate one mission with the SimPy model."""
    from dess import simulate
    from dess.files import replacing
    from dess.state import check_seed, sample_scenario
    from policies import load_team

    space, team = load_space(scenario, settings), load_team(policy)
    check_seed(seed, replication)
    _check_suffix("--figure", figure, FIGURES, "picture")
    _check_suffix("--animation", animation, ANIMATIONS, "animation")
    if animation and animation.suffix == ".mp4":
        from reports.player.animation import check_ffmpeg

        check_ffmpeg()
    writers = {events: _write_log, figure: _draw, animation: _animate}
    title = f"{policy}, scenario {Path(scenario).stem}, replication {replication} of seed {seed}"
    with ExitStack() as files:
        written = {path: files.enter_context(replacing(path)) for path in writers if path}
        with console.compile_notice():
            record = simulate(space, team, seed, replication, events=bool(written))
        mission = _Mission(record, sample_scenario(space, seed, replication), title)
        for path, temporary in written.items():
            writers[path](mission, temporary, path.suffix[1:])
    if as_json:
        names = {"policy": policy, "scenario": scenario, "seed": seed, "replication": replication}
        metrics = {key: getattr(record, key) for key in METRICS}
        print(json.dumps(names | metrics | {"uavs": record.uav_rows()}, indent=2))
    else:
        _print_mission(record)


def _check_suffix(option: str, path: Path | None, allowed: Sequence[str], kind: str) -> None:
    if path and path.suffix not in allowed:
        raise InputError(f"{option}: {path} is not a {kind}; allowed: {', '.join(allowed)}")


@dataclass(frozen=True)
class _Mission:
    """A simulated mission to write into files: its record with its event log, and its names."""

    record: "MissionRecord"
    scenario: "Scenario"
    title: str

    @property
    def log(self) -> "dict[str, np.ndarray]":
        assert self.record.events is not None
        return self.record.events.columns()

    @property
    def outcome(self) -> str:
        from analysis.numbers import percent

        ends = [uav["end"] for uav in self.record.uav_rows()]
        return (
            f"{percent(self.record.collection_ratio)} of the data collected in "
            f"{self.record.slots} mission slots; {ends.count('quota')} of {len(ends)} UAVs filled "
            "their quota."
        )


def _write_log(mission: _Mission, path: Path, kind: str) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table(mission.log), path)


def _draw(mission: _Mission, path: Path, kind: str) -> None:
    from analysis.figures.missions import mission_figure

    mission_figure(mission.log, mission.scenario).savefig(path, format=kind)


def _animate(mission: _Mission, path: Path, kind: str) -> None:
    from reports.pages.mission import mission_page
    from reports.player.animation import write_animation

    if kind == "html":
        page = mission_page(mission.log, mission.scenario, mission.title, mission.outcome)
        path.write_text(page, "utf-8")
    else:
        write_animation(mission.log, mission.scenario, path, kind, mission.title)


def _print_mission(record: "MissionRecord") -> None:
    metrics = record.metrics
    rows = [[name, f"{metrics[name].item():g}"] for name in metrics.dtype.names or ()]
    console.print_table(["", "mission"], rows)
    uavs = record.uav_rows()
    rows = [[str(number), *map(str, row.values())] for number, row in enumerate(uavs)]
    console.print_table(["UAV", *uavs[0]], rows)
