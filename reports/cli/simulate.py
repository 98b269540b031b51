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
from dess.reports.cli.mission_files import Outputs, SimulatedMission, write_plan

if TYPE_CHECKING:
    from dess.analysis.flights.flight_plan import FlightPlan
    from dess.analysis.flights.separation import Separation
    from dess.model.state import Starts
    from dess.policies.registry import Policy
    from dess.scenario.own_sea import Positions
    from dess.scenario.scenario import ScenarioSpace

MOST_DISTANCE = 100  # of UAVs of a plan from each other [m]
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
    window: Annotated[str | None, typer.Option(metavar="HOUR")] = None,
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
    process: options.ProcessOption = None,
    yes: YesOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Simulate one mission with the SimPy model.

    Args:
        policy: A policy, or several that the UAVs follow in turn.  [default: greedy, or that of
            the study]
        replication: Number of the replication, which selects the random draws.  [default: 0, or
            the first of the design point]
        window: With weather: simulate the window that begins in this hour (UTC), such as
            2013-02-09T14, as a mission that begins with what its year has left. It takes the place
            of --replication.
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
    from dess.analysis.execution.effort import check_missions
    from dess.model.state import check_seed

    processes = options.typed_processes(process)
    if of:
        allowed = "--of without --{}"
        _refuse_given(context, ("scenario", "settings", "seed"), "comes from the study", allowed)
        asked = _read_study(of, point, policy, replication, processes)
    elif point is not None:
        raise InputError("--point", "belongs to a study", "with --of DIR")
    else:
        asked = _read_scenario(
            scenario, settings, policy, seed, replication, options.typed_processes(process)
        )
    if window is not None and replication is not None:
        raise InputError("--window", "is given beside --replication", "either")
    if not yes:
        check_missions("simulate", [asked.space])
    if plan is not None:
        asked = asked.without_swaps()
    if window is not None:
        with console.compile_notice():
            asked = asked.in_window(window)
    check_seed(asked.seed, asked.replication)
    outputs = Outputs(events, figure, animation, path, plan)
    outputs.check_degrees(asked.space)
    begin = _parse_start(start, outputs)
    separation = _parse_separation(context, air_distance, ground_distance, outputs)
    positions = None
    if plan is not None:
        positions = _prepare_plan(plan, asked, settings)
    outputs.check_files(as_json)
    with console.open_outputs(outputs.files) as temporaries, _open_folder(plan) as folder:
        mission = _simulate(asked, outputs.need_log or not as_json, separation, begin)
        outputs.write(mission, temporaries)
        flight_plan = None
        if folder and positions:
            flight_plan = write_plan(mission, positions, folder)
    options.note_departures([asked.policy], [asked.space])
    if as_json:
        print(json.dumps(_make_document(asked, mission, flight_plan), indent=2))
        return
    if not outputs.fill_stdout:
        _print_mission(mission)
    if flight_plan:
        _print_plan(flight_plan, outputs)


@dataclass(frozen=True)
class _Asked:
    """What is to be simulated; ``point`` is None where it is no mission of a study."""

    space: "ScenarioSpace"
    policy: str
    team: "list[Policy]"
    seed: int
    replication: int
    processes: Sequence[str]
    scenario: str
    study: str = ""
    point: int | None = None
    window: str | None = None
    starts: "Starts | None" = None

    def in_window(self, window: str) -> "_Asked":
        """The window of the weather that begins in an hour."""
        from dess.model.years import start_of_window

        start = start_of_window(self.space, self.team, self.seed, window)
        return replace(
            self,
            space=start.scenario,
            replication=start.replication,
            window=window,
            starts=start.starts,
        )

    def without_swaps(self) -> "_Asked":
        """The same in a sea in which UAVs do not swap their cells."""
        from dess.scenario.scenario import ScenarioSpace

        return replace(self, space=ScenarioSpace.of(self.space, forbid_swaps=True))

    @property
    def title(self) -> str:
        where = f"scenario {Path(self.scenario).stem}"
        if self.point is not None:
            where = f"study {self.study}, point {self.point}"
        which = f"replication {self.replication}"
        if self.window:
            which = f"the window of {self.window}"
        return f"{self.policy}, {where}, {which} of seed {self.seed}"

    @property
    def names(self) -> dict[str, Any]:
        shown = ["policy", "scenario", "seed", "replication"]
        if self.point is not None:
            shown += ["study", "point"]
        if self.processes:
            shown.append("processes")
        if self.window:
            shown.append("window")
        return {name: getattr(self, name) for name in shown}


def _read_scenario(
    scenario: str,
    settings: list[str] | None,
    policy: str | None,
    seed: int,
    replication: int | None,
    processes: Sequence[str],
) -> _Asked:
    """A mission of a scenario."""
    from dess.policies.registry import load_team

    space = options.load_space(scenario, settings)
    (policy,) = options.use_current_names([policy or "greedy"]) or []
    team = load_team(policy, run_files=True)
    return _Asked(space, policy, team, seed, replication or 0, processes, scenario)


def _read_study(
    folder: Path,
    point: int | None,
    policy: str | None,
    replication: int | None,
    processes: Sequence[str],
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
    manifest.load_processes(processes)
    of_study = [identity.process for identity in manifest.processes]
    if others := [process for process in processes if process not in of_study]:
        problem = f"{shown(others[0])} is not in the study"
        raise InputError("--process", problem, ", ".join(of_study) or "none")
    if changes := manifest.changes_here([*named, *processes]):
        line = f"note: {folder}: {'; '.join(changes)}: the mission may be another one now"
        console.print_text(line, sys.stderr)
    if replication is None:
        replication = manifest.points[point].replication
    names = manifest.study.scenario, manifest.study.name
    return _Asked(space, policy, team, manifest.seed, replication, processes, *names, point)


def _simulate(
    asked: _Asked, has_log: bool, separation: "Separation", start: datetime | None
) -> SimulatedMission:
    """Simulate the mission."""
    from dess.model.mission import simulate
    from dess.model.processes import load_processes
    from dess.model.state import sample_scenario
    from dess.scenario.weather import refuse_weather

    which = asked.seed, asked.replication
    processes = load_processes(asked.processes)
    with console.compile_notice():
        refuse_weather([asked.space.weather])
        record = simulate(
            asked.space,
            asked.team,
            *which,
            events=has_log,
            processes=processes,
            starts=asked.starts,
        )
    drawn = sample_scenario(asked.space, *which)
    return SimulatedMission(record, drawn, asked.title, separation, start)


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


def _parse_start(text: str | None, outputs: Outputs) -> datetime | None:
    """A time of day with its date, in UTC unless it says otherwise; None if there is no text.

    Raises:
        InputError: If it is none, or if no output has times of day.
    """
    if text is None:
        return None
    if outputs.path is None and outputs.plan is None:
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


def _parse_separation(
    context: typer.Context, air: str, ground: str, outputs: Outputs
) -> "Separation":
    """How far apart UAVs have to be.

    Raises:
        InputError: If one of them is no length, or out of range; or if it is given, and no output
            has altitudes.
    """
    from dess.analysis.flights.separation import Separation
    from dess.scenario.quantities import quantity_of

    metres = []
    for option, text in (("--air-distance", air), ("--ground-distance", ground)):
        length = quantity_of(text, option, "m")
        if not 1 <= length <= MOST_DISTANCE:
            raise InputError(option, f"{shown(text)} is out of range", f"1 m..{MOST_DISTANCE} m")
        metres.append(length)
    if outputs.plan is None and outputs.path is None:
        options_of_plan = ("air_distance", "ground_distance")
        allowed = "with --plan DIR or --path FILE"
        _refuse_given(context, options_of_plan, "no output has altitudes", allowed)
    return Separation(*metres)


def _make_document(
    asked: _Asked, mission: SimulatedMission, flight_plan: "FlightPlan | None"
) -> dict[str, Any]:
    """The mission as plain data."""
    record = mission.record
    metrics = {key: getattr(record, key) for key in JSON_METRICS}
    others = _metric_values(mission).items()
    metrics |= {k: value for k, value in others if k not in (*asked.names, *metrics, "uavs")}
    document = asked.names | metrics | {"uavs": record.uav_rows()}
    if record.operations is not None:
        document["operations"] = _values_in_units(record.measured, mission)
    if flight_plan:
        document["plan"] = flight_plan.summarise()
    return document


def _print_plan(flight_plan: "FlightPlan", outputs: Outputs) -> None:
    """Print what there is to say of a plan, on stderr if standard output has the event log."""
    stream = sys.stdout
    if outputs.fill_stdout:
        stream = sys.stderr
    for line in flight_plan.list_sentences():
        console.print_text(line, stream)


def _metric_values(mission: SimulatedMission) -> dict[str, float]:
    """The metrics of every mission."""
    metrics = mission.record.metrics
    return _values_in_units(
        {name: metrics[name].item() for name in metrics.dtype.names or ()}, mission
    )


def _values_in_units(values: dict[str, Any], mission: SimulatedMission) -> dict[str, Any]:
    """Values of the mission; with a data sheet, in units as well."""
    from dess.analysis.metrics import columns_in_units

    units = mission.scenario.units
    return values | columns_in_units(values, units) if units else values


def _print_mission(mission: SimulatedMission) -> None:
    from dess.analysis.measured import measured_in
    from dess.analysis.metrics import column_in_sheet_unit, metric_of
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
