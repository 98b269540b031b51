"""``dess evaluate``: metrics of many missions, with intervals."""

import json
from math import nan
from typing import Annotated, Any, Literal

import typer

from dess.reports.cli import console, options
from dess.reports.cli.console import YesOption
from dess.reports.cli.options import (
    JsonOption,
    ScenarioOption,
    SeedOption,
    SetOption,
    WorkersOption,
    command,
    load_space,
    note_departures,
)

app = typer.Typer()


@command(app)
def evaluate(
    policy: Annotated[list[str], typer.Option(metavar="P[,P...]", autocompletion=options.policies)],
    scenario: ScenarioOption = "paper",
    settings: SetOption = None,
    missions: Annotated[int, typer.Option(min=1)] = 1000,
    seed: SeedOption = 0,
    engine: Literal["batch", "events"] | None = None,
    workers: WorkersOption = 1,
    yes: YesOption = False,
    as_json: JsonOption = False,
) -> None:
    """Simulate many missions and print the means of their metrics with 95 % intervals.

    Args:
        policy: A policy, or several that the UAVs follow in turn; repeatable.
        missions: Number of missions (replications 0, 1, ...).
        engine: batch is faster, and both engines give the same records; continuous arrivals
            need events.  [default: batch, or events where it is needed]
    """
    from dess.analysis.execution.evaluation import Asked, check_evaluation, means
    from dess.analysis.study.study import engine_of
    from dess.policies.registry import typed
    from dess.record import measures_of

    space, policy = load_space(scenario, settings), typed(policy)
    engine = engine_of([space], engine)
    asked = [Asked(space, team, missions, seed, engine, workers) for team in policy]
    with console.compile_notice():
        check_evaluation(asked, yes)
    note_departures(policy, [space])
    with console.compile_notice(), console.bar("mission", missions * len(policy)) as bar:
        evaluations = [means(of_team, bar.update) for of_team in asked]
    unknown = dict.fromkeys(("mean", "low", "high"), nan)
    rows = [
        {
            "policy": evaluation.policy,
            "missions": missions,
            "seed": seed,
            "engine": engine,
            "uav_slots": evaluation.uav_slots,
            "seconds": evaluation.seconds,
        }
        | {name: of.interval(name)._asdict() for name, of in evaluation.moments.items()}
        | {name: unknown for name in measures_of(space) if name not in evaluation.moments}
        for evaluation in evaluations
    ]
    if as_json:
        print(json.dumps([_without_nan(row) for row in rows], indent=2, allow_nan=False))
    else:
        _print_rows(rows)


def _without_nan(row: Any) -> Any:
    """A row in which null stands for nan, which JSON does not have."""
    if isinstance(row, dict):
        return {name: _without_nan(value) for name, value in row.items()}
    return None if row != row else row


def _print_rows(rows: list[dict[str, Any]]) -> None:
    for row in rows:
        metrics = {name: value for name, value in row.items() if isinstance(value, dict)}
        cells = [[name, *(f"{x:.4f}" for x in value.values())] for name, value in metrics.items()]
        console.print_table([row["policy"], "mean", "low", "high"], cells)
        speed = row["uav_slots"] / row["seconds"]
        engine = ", SimPy engine" if row["engine"] == "events" else ""
        console.say(
            f" {row['missions']} missions, {row['uav_slots']} UAV-slots in "
            f"{row['seconds']:.2f} s: {speed:,.0f} UAV-slots/s{engine}"
        )
