"""``dess simulate``: one mission, its event log, its picture and its animation."""

import json
import sys
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from dess.base.errors import InputError, shown, unknown_name
from dess.reports.cli import console, options
from dess.reports.cli.console import YesOption

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure

    from dess.analysis.flights.flight_plan import FlightPlan
    from dess.analysis.flights.separation import Separation
    from dess.model.record import MissionRecord
    from dess.policies.registry import Policy
    from dess.scenario.own_sea import Positions
    from dess.scenario.scenario import Scenario, ScenarioSpace

LOGS = (".parquet", ".csv")
FIGURES = (".png", ".pdf", ".svg")
ANIMATIONS = (".gif", ".mp4", ".html")
MOST_DISTANCE = 100  # of UAVs of a plan from each other [m]
PATHS = (".geojson", ".kml", ".gpx", ".csv")
# Metrics of ``--json``, between the names and the UAVs.
JSON_METRICS = (
    *("slots", "success", "collection_ratio", "collection_ratio_and_communication"),
    *("initial", "arrived", "collected", "residual"),
)

T = TypeVar("T")
# The options whose parameter has another name.
_OPTION_OF = {"settings": "set"}
app = typer.Typer()


@options.add_command(app)
def simulate(
    context: typer.Context,
    scenario: options.ScenarioOption = "paper",
    settings: options.SetOption = None,
    policy: Annotated[
        str | None, typer.Option(metavar="P[,P...]", autocompletion=options.complete_policies)
    ] = None,
    seed: options.SeedOption = 0,
    replication: int | None = None,
    of: Annotated[Path | None, typer.Option(metavar="DIR")] = None,
    point: int | None = None,
    events: Annotated[Path | None, typer.Option(metavar="FILE.parquet")] = None,
    figure: Annotated[Path | None, typer.Option(metavar="FILE.png")] = None,
    animation: Annotated[Path | None, typer.Option(metavar="FILE.gif")] = None,
    path: Annotated[Path | None, typer.Option(metavar="FILE.geojson")] = None,
    plan: Annotated[Path | None, typer.Option(metavar="DIR")] = None,
    air_distance: Annotated[str, typer.Option(metavar="LENGTH")] = "10 m",
    ground_distance: Annotated[str, typer.Option(metavar="LENGTH")] = "3 m",
    start: Annotated[str | None, typer.Option(metavar="TIME")] = None,
    yes: YesOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Simulate one mission with the SimPy model.

    Args:
        policy: A policy, or several that the UAVs follow in turn.  [default: greedy, or that of
            the study]
        replication: Number of the replication, which selects the random draws.  [default: 0, or
            the first of the design point]
        of: Simulate a mission of this results folder again, with its scenario and seed.
        point: With --of: number of the design point, from 0.
        events: Write the event log of the mission into this file, .parquet or .csv; - for
            standard output, as Parquet.
        figure: Draw the mission into this file: .png, .pdf or .svg.
        animation: Write the mission as an animation: .gif, .mp4 (needs ffmpeg), or .html, a
            page with its player.
        path: Write the path of each UAV with its times, in degrees where the sea has them:
            .geojson, .kml, .gpx or .csv.
        plan: Write each flight into this new folder, as a .plan that QGroundControl reads, and a
            table of them. The mission is simulated with forbid_swaps; the sea needs degrees and a
            data sheet.
        air_distance: How far apart UAVs are if one of them is in the air, in a plan and in the
            altitudes of paths; a plan with less is refused.
        ground_distance: How far apart UAVs stand.
        start: Time of the start for --path and --plan, e.g. 2026-06-01T08:00Z.
    """
    from dess import simulate
    from dess.analysis.execution.effort import check_missions
    from dess.base.files.writing import writable
    from dess.model.state import check_seed, sample_scenario
    from dess.policies.registry import load_team
    from dess.scenario.scenario import ScenarioSpace

    if of:
        allowed = "--of without --{}"
        _refuse_given(context, ("scenario", "settings", "seed"), "comes from the study", allowed)
        asked = _read_study(of, point, policy, replication)
    elif point is not None:
        raise InputError("--point", "belongs to a study", "with --of DIR")
    else:
        space = options.load_space(scenario, settings)
        policy = policy or "greedy"
        team = load_team(policy, run_files=True)
        asked = _Asked(space, policy, team, seed, replication or 0, scenario)
    if not yes:
        check_missions("simulate", [asked.space])
    check_seed(asked.seed, asked.replication)
    if path and path.suffix.lower() in (".kml", ".gpx") and asked.space.centre is None:
        raise InputError(f"--path: {path}", "the sea has no degrees", ".geojson, .csv")
    begin = None
    if start is not None:
        begin = _parse_start(start, is_used=path is not None or plan is not None)
    positions = None
    separation = _parse_separation(air_distance, ground_distance)
    if plan is None and path is None:
        options_of_plan = ("air_distance", "ground_distance")
        allowed = "with --plan DIR or --path FILE"
        _refuse_given(context, options_of_plan, "no output has altitudes", allowed)
    if plan is not None:
        positions = _prepare_plan(plan, asked, settings)
        asked = replace(asked, space=ScenarioSpace.of(asked.space, forbid_swaps=True))
    writers = {
        events: _write_log,
        figure: _write_map,
        animation: _write_animation,
        path: _write_path,
    }
    paths = [file for file in (events, figure, animation, path) if file]
    if len({file.absolute() for file in paths}) < len(paths):
        raise InputError("--events, --figure", "the same file", "a file for each")
    console.check_ending("--events", events, LOGS, "an event log", is_stream=True)
    console.check_ending("--figure", figure, FIGURES, "a picture")
    console.check_ending("--animation", animation, ANIMATIONS, "an animation")
    console.check_ending("--path", path, PATHS, "a path")
    if animation and animation.suffix.lower() == ".mp4":
        from dess.reports.player import check_ffmpeg

        check_ffmpeg()
    is_binary = events is not None and console.is_stdout(events)
    if is_binary and as_json:
        raise InputError("--json", "standard output has the event log", "--events FILE")
    with console.open_outputs(paths) as temporaries, _open_folder(plan) as folder:
        with console.compile_notice():
            which = asked.seed, asked.replication
            has_log = bool(paths) or plan is not None or not as_json
            record = simulate(asked.space, asked.team, *which, events=has_log)
        drawn = sample_scenario(asked.space, *which)
        mission = _MissionToWrite(record, drawn, asked.title, separation, begin)
        for file, temporary in zip(paths, temporaries, strict=True):
            with writable(file):
                writers[file](mission, temporary, file.suffix[1:].lower())
        flight_plan = None
        if folder and positions:
            flight_plan = _write_plan(mission, positions, folder)
    options.note_departures([asked.policy], [asked.space])
    if as_json:
        metrics = {key: getattr(record, key) for key in JSON_METRICS}
        others = _metric_values(mission).items()
        in_units = _values_in_units(record.measured, mission)
        metrics |= {k: value for k, value in others if k not in (*asked.names, *metrics, "uavs")}
        measured = {}
        if record.operations is not None:
            measured["operations"] = in_units
        if flight_plan:
            measured["plan"] = flight_plan.summarise()
        print(json.dumps(asked.names | metrics | {"uavs": record.uav_rows()} | measured, indent=2))
    elif not is_binary:
        _print_mission(mission)
    if flight_plan and not as_json:
        stream = sys.stdout
        if is_binary:
            stream = sys.stderr
        for line in flight_plan.list_sentences():
            console.print_text(line, stream)


@dataclass(frozen=True)
class _Asked:
    """What is to be simulated; ``point`` is None where it is no mission of a study."""

    space: "ScenarioSpace"
    policy: str
    team: "list[Policy]"
    seed: int
    replication: int
    scenario: str
    study: str = ""
    point: int | None = None

    @property
    def title(self) -> str:
        where = f"scenario {Path(self.scenario).stem}"
        if self.point is not None:
            where = f"study {self.study}, point {self.point}"
        return f"{self.policy}, {where}, replication {self.replication} of seed {self.seed}"

    @property
    def names(self) -> dict[str, Any]:
        shown = ["policy", "scenario", "seed", "replication"]
        if self.point is not None:
            shown += ["study", "point"]
        return {name: getattr(self, name) for name in shown}


def _read_study(
    folder: Path, point: int | None, policy: str | None, replication: int | None
) -> _Asked:
    """What a results folder says of a mission; a line on stderr if it may be another one now."""
    from dess.analysis.results.chunks import MANIFEST
    from dess.analysis.results.manifest import Manifest
    from dess.policies.registry import load_team

    manifest = Manifest.read(folder / MANIFEST)
    policies = [team.policy for team in manifest.policies]
    named = [policy] if policy else []
    policy = _choose_of_study("policy", policy or None, policies, ", ".join(policies))
    points = range(len(manifest.points))
    point = _choose_of_study("point", point, points, f"0..{len(points) - 1}")
    space = manifest.scenarios[point]
    team = load_team(policy, space.uavs[1], run_files=bool(named))
    if changes := manifest.changes_here(named):
        line = f"note: {folder}: {'; '.join(changes)}: the mission may be another one now"
        console.print_text(line, sys.stderr)
    if replication is None:
        replication = manifest.points[point].replication
    names = manifest.study.scenario, manifest.study.name
    return _Asked(space, policy, team, manifest.seed, replication, *names, point)


def _choose_of_study(option: str, given: T | None, there: Sequence[T], allowed: str) -> T:
    """What is given of the study, or the only one that it has."""
    if given is None and len(there) == 1:
        return there[0]
    if given is None:
        raise InputError(f"--{option}", f"the study has {len(there):,}", f"one of {allowed}")
    if given not in there:
        problem = f"{shown(given)} is not in the study"
        if isinstance(given, str):
            raise unknown_name(f"--{option}", problem, given, map(str, there))
        raise InputError(f"--{option}", problem, allowed)
    return given


def _refuse_given(context: typer.Context, names: Sequence[str], problem: str, allowed: str) -> None:
    """Refuse options that do not fit to the others; ``allowed`` has a place for the option."""
    for name in names:
        source = context.get_parameter_source(name)
        if source and source.name != "DEFAULT":
            option = _OPTION_OF.get(name, name.replace("_", "-"))
            raise InputError(f"--{option}", problem, allowed.format(option))


@dataclass(frozen=True)
class _MissionToWrite:
    """A simulated mission to write into files: its record with its event log, and its names."""

    record: "MissionRecord"
    scenario: "Scenario"
    title: str
    separation: "Separation"
    start: datetime | None = None

    @property
    def log(self) -> "dict[str, np.ndarray]":
        assert self.record.events is not None
        return self.record.events.columns()

    @property
    def outcome(self) -> str:
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


def _write_log(mission: _MissionToWrite, path: Path, kind: str) -> None:
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


def _write_map(mission: _MissionToWrite, path: Path, kind: str) -> None:
    from dess.analysis.figures.missions import mission_figure

    save_figure(mission_figure(mission.log, mission.scenario), path, kind)


def save_figure(figure: "Figure", path: Path, kind: str) -> None:
    """Write a figure into a temporary file; ``kind`` is the ending of its final name."""
    figure.savefig(path, format=kind)


def _write_animation(mission: _MissionToWrite, path: Path, kind: str) -> None:
    from dess.reports.player import write_animation

    if kind == "html":
        _write_page(mission, path)
    else:
        write_animation(mission.log, mission.scenario, path, kind, mission.title)


def _write_path(mission: _MissionToWrite, path: Path, kind: str) -> None:
    from dess.analysis.results.event_log import path_text
    from dess.base.files.writing import fill

    altitudes = None
    if mission.scenario.units and mission.scenario.landing:
        altitudes = mission.separation.altitudes(mission.scenario)
    text = path_text(mission.log, mission.scenario, kind, mission.start, altitudes)
    fill(path, text.encode())


def _parse_start(text: str, *, is_used: bool) -> datetime:
    """A time of day with its date, in UTC unless it says otherwise.

    Raises:
        InputError: If it is none, or if no output has times of day.
    """
    if not is_used:
        raise InputError("--start", "no output has times", "with --path FILE or --plan DIR")
    allowed = "a date and a time from 1970 to 2100, e.g. 2026-06-01T08:00Z"
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise InputError("--start", f"{shown(text)} is no time", allowed) from None
    if not 1970 <= moment.year <= 2100:
        raise InputError("--start", f"{shown(text)} is out of range", allowed)
    if moment.tzinfo is None:
        console.print_text(f"note: --start {text} has no time zone and is taken as UTC", sys.stderr)
        return moment.replace(tzinfo=UTC)
    return moment.astimezone(UTC)


def _prepare_plan(plan: Path, asked: "_Asked", settings: list[str] | None) -> "Positions":
    """The places that the sea of a plan has in degrees.

    Raises:
        InputError: If the mission cannot become a plan, or the folder cannot be made.
    """
    from dess.analysis.flights.flight_plan import check_plannable
    from dess.base.files.writing import check_new_folder
    from dess.scenario.scenario import positions_in

    if asked.point is not None:
        allowed = "without --of, with the --scenario, --seed and --replication of the mission"
        raise InputError("--plan", "needs the files of the sea, which a study has not", allowed)
    check_plannable(asked.space)
    check_new_folder(plan)
    return positions_in(asked.scenario, **options.parse_settings(settings))


def _open_folder(plan: Path | None) -> AbstractContextManager[Path | None]:
    """A temporary folder that becomes that of the plan, if there is one."""
    from dess.base.files.writing import creating_folder

    if plan is None:
        return nullcontext()
    return creating_folder(plan)


def _parse_separation(air: str, ground: str) -> "Separation":
    """How far apart UAVs have to be.

    Raises:
        InputError: If one of them is no length, or out of range.
    """
    from dess.analysis.flights.separation import Separation
    from dess.scenario.quantities import quantity_of

    metres = []
    for option, text in (("--air-distance", air), ("--ground-distance", ground)):
        length = quantity_of(text, option, "m")
        if not 1 <= length <= MOST_DISTANCE:
            raise InputError(option, f"{shown(text)} is out of range", f"1 m..{MOST_DISTANCE} m")
        metres.append(length)
    return Separation(*metres)


def _write_plan(mission: _MissionToWrite, positions: "Positions", folder: Path) -> "FlightPlan":
    from dess.analysis.flights.flight_plan import FlightPlan
    from dess.base.files.writing import fill

    flight_plan = FlightPlan.of(
        mission.log, mission.scenario, positions, mission.start, mission.separation
    )
    for name, text in flight_plan.make_files().items():
        fill(folder / name, text)
    return flight_plan


def _write_page(mission: _MissionToWrite, path: Path) -> None:
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


def _metric_values(mission: _MissionToWrite) -> dict[str, float]:
    """The metrics of every mission."""
    metrics = mission.record.metrics
    return _values_in_units(
        {name: metrics[name].item() for name in metrics.dtype.names or ()}, mission
    )


def _values_in_units(values: dict[str, Any], mission: _MissionToWrite) -> dict[str, Any]:
    """Values of the mission; with a data sheet, in units as well."""
    from dess.analysis.metrics import columns_in_units

    units = mission.scenario.units
    return values | columns_in_units(values, units) if units else values


def _print_mission(mission: _MissionToWrite) -> None:
    from dess.analysis.metrics import column_in_sheet_unit, measured_in, metric_of
    from dess.analysis.results.event_log import causes_of_failure, residual_data

    metrics = _metric_values(mission)
    rows = [
        [name, f"{metrics[name]:g}"]
        for name in dict.fromkeys(column_in_sheet_unit(n, metrics) for n in metrics)
    ]
    console.print_table(["", "mission"], rows)
    if measured := _values_in_units(mission.record.measured, mission):
        labelled = [(metric_of(name).label, measured[name]) for name in measured_in(measured)]
        rows = [[label, f"{value:g}"] for label, value in labelled]
        console.print_table(["", "beyond the paper"], rows)
    uavs = mission.record.uav_rows()
    rows = [[str(number), *map(str, row.values())] for number, row in enumerate(uavs, 1)]
    console.print_table(["UAV", *uavs[0]], rows)
    if names := mission.scenario.names:
        data = residual_data(mission.log).to_numpy()
        of_nodes = zip(names, mission.scenario.nodes, data[0], data[-1], strict=True)
        rows = [[name, str([*cell]), f"{had:g}", f"{left:g}"] for name, cell, had, left in of_nodes]
        console.print_table(["node", "cell", "data at the start", "at the end"], rows)
    for cause in causes_of_failure(mission.log, mission.scenario):
        console.print_text(f"{cause}.")
