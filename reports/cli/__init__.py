"""The ``dess`` command.

Only what the help needs is imported at once; the rest is imported by the command that uses it.
"""

import json
import shlex
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from typer.exceptions import TyperException

from dess.errors import InputError
from reports.cli import console, study
from reports.cli.settings import PARAMETER, from_here, setting

if TYPE_CHECKING:
    import numpy as np

    from dess import ScenarioSpace
    from dess.record import EventLog, MissionRecord

REPORTS, TIMING = Path("build/reports"), study.RESULTS / "timing"
WHAT_IF = "what-if"  # the report that --set is for
INTERRUPTED = 130  # what typer returns after Ctrl-C
FIGURES = (".png", ".pdf", ".svg")

# Metrics of ``simulate --json``, between who flew and the UAVs.
MISSION_KEYS = (
    "slots",
    "success",
    "collection_ratio",
    "collection_ratio_and_communication",
    "initial",
    "arrived",
    "collected",
    "residual",
)

app = typer.Typer(
    help="Discrete-event simulation of UAV data harvesting with charging at sea.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.add_typer(study.app, name="study")

ScenarioOption = Annotated[
    str, typer.Option("--scenario", metavar="NAME|FILE", help="A shipped scenario or a TOML file.")
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Set a field of the scenario, the value in TOML syntax; repeatable.",
    ),
]
SeedOption = Annotated[int, typer.Option("--seed", help="Seed of all randomness.")]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: Without the name of the program; those of the process by default.

    Returns:
        The exit code: 0 done, 2 bad input, 1 anything else.
    """
    try:
        code = app(arguments, prog_name="dess", standalone_mode=False)
    except TyperException as error:
        context = getattr(error, "ctx", None)
        hint = f" (see {context.command_path} --help)" if context else ""
        return console.fail(f"dess: error: {error.format_message()}{hint}", error.exit_code)
    except InputError as error:
        return console.fail(f"dess: error: {error}", 2)
    except SystemError as error:
        from analysis.execution.jobs import was_interrupted

        if not was_interrupted(error):
            raise
        return console.fail("interrupted", 1)
    return console.fail("interrupted", 1) if code == INTERRUPTED else code or 0


@app.command()
def simulate(
    scenario: ScenarioOption = "paper",
    settings: SetOption = None,
    policy: Annotated[
        str, typer.Option(metavar="P[,P...]", help="A policy, or one for each UAV in turn.")
    ] = "greedy",
    seed: SeedOption = 0,
    replication: Annotated[int, typer.Option(help="Number of the replication.")] = 0,
    events: Annotated[
        Path | None, typer.Option(metavar="FILE.parquet", help="Write the event log.")
    ] = None,
    figure: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="Draw the mission.")
    ] = None,
    as_json: study.JsonOption = False,
) -> None:
    """Simulate one mission with the SimPy model."""
    from dess import simulate
    from dess.files import replacing
    from dess.state import check_seed
    from policies import load_team

    space, team = _scenario(scenario, settings), load_team(policy)
    check_seed(seed, replication)
    if figure and figure.suffix not in FIGURES:
        raise InputError(f"--figure: {figure} is no picture; allowed: {', '.join(FIGURES)}")
    with ExitStack() as files:
        log_file = files.enter_context(replacing(events)) if events else None
        figure_file = files.enter_context(replacing(figure)) if figure else None
        with console.compile_notice():
            record = simulate(space, team, seed, replication, events=bool(log_file or figure_file))
        if log_file and record.events:
            _write_log(record.events, log_file)
        if figure and figure_file and record.events:
            _draw(record, space, figure_file, figure.suffix[1:])
    if as_json:
        who = {"policy": policy, "scenario": scenario, "seed": seed, "replication": replication}
        metrics = {key: getattr(record, key) for key in MISSION_KEYS}
        print(json.dumps(who | metrics | {"uavs": record.uav_rows()}, indent=2))
    else:
        _print_mission(record)


@app.command()
def evaluate(
    policy: Annotated[
        list[str], typer.Option(metavar="P[,P...]", help="A policy or a team; repeatable.")
    ],
    scenario: ScenarioOption = "paper",
    settings: SetOption = None,
    missions: Annotated[int, typer.Option(min=1, help="Replications 0, 1, ... to run.")] = 1000,
    seed: SeedOption = 0,
    engine: Annotated[
        Literal["batch", "events"], typer.Option(help="Both engines give the same records.")
    ] = "batch",
    workers: study.WorkersOption = 1,
    as_json: study.JsonOption = False,
) -> None:
    """Metrics of many missions, with 95 % intervals."""
    from analysis.execution.runner import evaluate
    from dess.state import check_seed
    from policies import load_team

    space = _scenario(scenario, settings)
    for team in policy:
        load_team(team)
    check_seed(seed, missions - 1)
    with console.compile_notice(), console.missions_bar(missions * len(policy)) as progress:
        evaluations = [
            evaluate(space, team, missions, seed, engine, workers, progress) for team in policy
        ]
    rows = [
        {
            "policy": done.policy,
            "missions": missions,
            "seed": seed,
            "engine": engine,
            "uav_slots": done.uav_slots,
            "seconds": done.seconds,
        }
        | _intervals(done.records.missions)
        for done in evaluations
    ]
    if as_json:
        print(json.dumps(rows, indent=2))
    else:
        _print_evaluations(rows)


@app.command()
def train(
    name: Annotated[str, typer.Argument(metavar="NAME|FILE", help="A config or a TOML file.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the training.")],
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the training there.")
    ] = False,
    device: Annotated[
        Literal["auto", "cpu", "cuda"], typer.Option(help="Where; auto takes CUDA if it is there.")
    ] = "auto",
    seed: Annotated[int | None, typer.Option(help="Seed of the training instead.")] = None,
) -> None:
    """Train a policy into a folder; Ctrl-C saves, --resume goes on exactly."""
    from policies.ddqn.config import load_config

    config = load_config(name, **({} if seed is None else {"seed": seed}))
    from policies.ddqn.session import train

    with console.compile_notice(), console.training_bar(config.ticks) as progress:
        training = train(
            config, out, resume=resume, device=device, announce=_say_memory, progress=progress
        )
    if not training.done:
        options = ["--out", str(out), *([] if seed is None else ["--seed", str(seed)])]
        options += [] if device == "auto" else ["--device", device]
        command = shlex.join(["dess", "train", name, *options, "--resume"])
        raise typer.Exit(
            console.fail(f"interrupted at tick {training.tick}: go on with {command}", 1)
        )
    print(
        f"{out}: {training.updates} updates, {training.uav_slots} UAV-slots in "
        f"{training.seconds:.0f} s; best product {training.best_score:.3f} in selection"
    )


@app.command()
def report(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help="Reports; all by default.")
    ] = None,
    results: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder with a results folder per study.")
    ] = study.RESULTS,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the pages.")] = REPORTS,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="What the report what-if changes: a field of the scenario, the value in TOML "
            "syntax; repeatable.",
        ),
    ] = None,
    parameters: Annotated[
        list[str] | None,
        typer.Option(
            "--parameter",
            metavar="NAME=VALUE",
            help="A parameter of the notebooks, such as missions or policies of what-if, the "
            "value in TOML syntax; repeatable.",
        ),
    ] = None,
) -> None:
    """Run the notebooks on the results and render them to HTML, with an index."""
    found = (setting(text, "--parameter", PARAMETER) for text in parameters or [])
    values = {name: from_here(value) for name, value in found}
    if settings:
        if names and WHAT_IF not in names:
            raise InputError(f"--set: {' '.join(names)} has nothing to set; allowed: {WHAT_IF}")
        values["settings"] = dict(setting(text) for text in settings)
        values.setdefault("baseline", {})  # the scenario itself, not that of the default question
    from reports.pages.render import ReportError, render

    try:
        with console.cells_bar() as progress:
            print(render(names or [], results, out, progress=progress, parameters=values))
    except ReportError as error:
        raise typer.Exit(console.fail(f"dess: error: {error}", 1)) from error


@app.command()
def verify(
    path: Annotated[
        Path, typer.Argument(metavar="PAGE|DIR", help="A page of dess report, or results.")
    ],
    missions: Annotated[
        int, typer.Option(min=1, help="Missions to fly again, at most, of every study.")
    ] = 20,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Of their choice.  [default: another every time]")
    ] = None,
    as_json: study.JsonOption = False,
) -> None:
    """Check a page or results: fly a random sample of the missions again, and compare."""
    import secrets

    from reports.pages.verify import verify_page, verify_results

    seed = secrets.randbelow(2**32) if seed is None else seed
    check = verify_results if path.is_dir() else verify_page
    with console.compile_notice():
        verdicts = check(path, missions, seed)
    differing = [line for verdict in verdicts for line in verdict.differing]
    if as_json:
        print(
            json.dumps(
                {"seed": seed, "checks": [asdict(verdict) for verdict in verdicts]}, indent=2
            )
        )
    else:
        rows = [[v.what, str(v.compared), str(len(v.differing))] for v in verdicts]
        console.print_table([str(path), "compared", "differing"], rows)
        for note in dict.fromkeys(f"{v.what}: {note}" for v in verdicts for note in v.notes):
            print(f"note: {note}")
    if differing:
        for line in differing:
            console.fail(f"differs: {line}", 1)
        found = f"{len(differing)} of {sum(v.compared for v in verdicts)} differ"
        raise typer.Exit(console.fail(f"dess: error: {path}: {found} (--seed {seed})", 1))


@app.command()
def timing(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to keep it in.")] = TIMING,
    policy: Annotated[
        list[str] | None,
        typer.Option(
            metavar="P[,P...]", help="Repeatable.  [default: those of the study comparison]"
        ),
    ] = None,
    missions: Annotated[int, typer.Option(min=1, help="Missions of each.")] = 30,
) -> None:
    """Measure what a decision costs in time; what was measured here before is kept."""
    from analysis.execution.decision_time import is_current, measure, read, writing
    from analysis.study.study import load_study

    teams = policy or [*load_study("comparison").policies]
    if not is_current(out, teams, missions):
        with writing(out) as path, console.compile_notice(), console.steps_bar() as progress:
            measured = measure(teams, missions=missions, progress=progress)
            path.write_text(measured.text, "utf-8")
    rows = [
        [c.policy, *(f"{1e6 * t:,.1f} µs" for t in (c.median, c.slow, c.batch))]
        for c in read(out).costs
    ]
    console.print_table(["policy", "median", "95 % below", "in a batch, per UAV"], rows)


@app.command()
def policies() -> None:
    """List the policies."""
    from policies.registry import descriptions

    console.print_list(descriptions().items())


@app.command()
def scenarios() -> None:
    """List the shipped scenarios."""
    from dess import scenario_names

    console.print_list((name, "") for name in scenario_names())


@app.command()
def studies() -> None:
    """List the shipped studies."""
    from analysis.study.study import load_study, study_names

    console.print_list((name, load_study(name).description) for name in study_names())


def _scenario(name: str, settings: list[str] | None) -> "ScenarioSpace":
    """The scenario with the fields that ``--set`` sets."""
    from dess import load_scenario

    return load_scenario(name, **dict(setting(text) for text in settings or []))


def _intervals(missions: "np.ndarray") -> dict[str, dict[str, float]]:
    """The metrics of missions: mean, low and high of each."""
    import pandas as pd

    from analysis.stats.intervals import summary

    rows = summary(pd.DataFrame(missions), by=[]).set_index("metric")[["mean", "low", "high"]]
    return rows.to_dict("index")


def _write_log(log: "EventLog", path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table(log.columns()), path)


def _draw(record: "MissionRecord", space: "ScenarioSpace", path: Path, kind: str) -> None:
    import pandas as pd

    from analysis.figures.missions import mission_figure
    from dess.state import sample_scenario

    assert record.events is not None
    scenario = sample_scenario(space, record.seed, record.replication)
    mission_figure(pd.DataFrame(record.events.columns()), scenario).savefig(path, format=kind)


def _print_mission(record: "MissionRecord") -> None:
    metrics = record.metrics
    console.print_table(
        ["", "mission"], [[m, f"{metrics[m].item():g}"] for m in metrics.dtype.names or ()]
    )
    uavs = record.uav_rows()
    rows = [[str(i), *map(str, row.values())] for i, row in enumerate(uavs)]
    console.print_table(["UAV", *uavs[0]], rows)


def _print_evaluations(evaluations: list[dict[str, Any]]) -> None:
    for done in evaluations:
        intervals = {m: value for m, value in done.items() if isinstance(value, dict)}
        rows = [[m, *(f"{x:.4f}" for x in value.values())] for m, value in intervals.items()]
        console.print_table([done["policy"], "mean", "low", "high"], rows)
        speed = done["uav_slots"] / done["seconds"]
        print(
            f" {done['missions']} missions, {done['uav_slots']} UAV-slots in "
            f"{done['seconds']:.2f} s: {speed:,.0f} UAV-slots/s"
        )


def _say_memory(size: int) -> None:
    """Say what a replay memory takes [bytes]."""
    print(f"replay memory: {size / 2**20:,.0f} MiB", file=sys.stderr)
