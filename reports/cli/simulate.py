"""``dess simulate``: one mission, its event log and its picture."""

import json
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dess import InputError
from reports.cli import console
from reports.cli.settings import JsonOption, ScenarioOption, SeedOption, SetOption, load_space

if TYPE_CHECKING:
    from dess import ScenarioSpace
    from dess.record import EventLog, MissionRecord

FIGURES = (".png", ".pdf", ".svg")
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
    as_json: JsonOption = False,
) -> None:
    """Simulate one mission with the SimPy model."""
    from dess import simulate
    from dess.files import replacing
    from dess.state import check_seed
    from policies import load_team

    space, team = load_space(scenario, settings), load_team(policy)
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
        names = {"policy": policy, "scenario": scenario, "seed": seed, "replication": replication}
        metrics = {key: getattr(record, key) for key in METRICS}
        print(json.dumps(names | metrics | {"uavs": record.uav_rows()}, indent=2))
    else:
        _print_mission(record)


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
    rows = [[name, f"{metrics[name].item():g}"] for name in metrics.dtype.names or ()]
    console.print_table(["", "mission"], rows)
    uavs = record.uav_rows()
    rows = [[str(number), *map(str, row.values())] for number, row in enumerate(uavs)]
    console.print_table(["UAV", *uavs[0]], rows)
