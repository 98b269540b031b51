"""``dess evaluate``: metrics of many missions, with intervals."""

import json
import re
from collections.abc import Sequence
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from dess.base.commands import command_line
from dess.reports.cli import console, options
from dess.reports.cli.console import YesOption

if TYPE_CHECKING:
    import pandas as pd

    from dess.analysis.execution.evaluation import Evaluation

app = typer.Typer()
_DIFFERENCE = ["difference", "low", "high", "p", "p_adjusted", "n"]


@options.add_command(app)
def evaluate(
    context: typer.Context,
    policy: Annotated[
        list[str],
        typer.Option(
            metavar="P[,P...]",
            autocompletion=options.complete_policies,
            callback=options.use_current_names,
        ),
    ],
    scenario: options.ScenarioOption = "paper",
    settings: options.SetOption = None,
    missions: Annotated[int, typer.Option(min=1)] = 1000,
    years: options.YearsOption = None,
    seed: options.SeedOption = 0,
    engine: Literal["batch", "events"] | None = None,
    process: options.ProcessOption = None,
    workers: options.WorkersOption = 1,
    scheduler: options.SchedulerOption = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR")] = None,
    yes: YesOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Simulate many missions and print the means of their metrics with 95 % intervals.

    Several policies fly the same missions; each is compared with the first one.

    Args:
        policy: A policy, or several that the UAVs follow in turn; repeatable.
        missions: Number of missions (replications 0, 1, ...).
        engine: batch is faster, and both engines give the same records; continuous arrivals
            need events.  [default: batch, or events where it is needed]
        out: Keep the missions in this results folder, which dess study show and dess report read;
            with more missions, those that are there are not simulated again.
    """
    from dess.analysis.execution.evaluation import (
        Asked,
        check_evaluation,
        compare_with_first,
        estimate_means,
    )
    from dess.analysis.metric_ranges import metric_in_space
    from dess.analysis.study.fields import replications_of
    from dess.analysis.study.study import engine_of
    from dess.model.record import measures_of

    machines = options.Machines(workers, scheduler)
    space = options.load_space(scenario, settings)
    replications = replications_of(space, options.given(context, "missions"), years, missions)
    ((unit, number),) = replications.items()

    processes = tuple(options.typed_processes(process))
    engine = engine_of([space], engine, processes)
    if out:
        study: dict[str, Any] = {"scenario": scenario, "policies": policy} | replications
        study |= {
            "set": dict(map(options.parse_setting, settings or [])),
            "seed": seed,
            "engine": engine,
        }
        evaluations = _evaluate_as_study(study, processes, out, machines, yes)
    else:
        about = (number, seed, engine, workers)
        first = Asked(
            space, policy[0], *about, run_files=True, processes=processes, scheduler=scheduler
        )
        asked = [first._replace(team=team) for team in policy]
        with console.compile_notice():
            check_evaluation(asked, yes)
        with (
            console.compile_notice(),
            console.progress_bar(unit.removesuffix("s"), number * len(policy)) as bar,
        ):
            evaluations = [estimate_means(of_team, bar.update) for of_team in asked]
        options.note_departures(policy, [space])
    unknown = dict.fromkeys(("mean", "low", "high"), nan)
    rows = [
        {
            "policy": evaluation.policy,
            unit: number,
            "seed": seed,
            "engine": engine,
            "uav_slots": evaluation.uav_slots,
            "seconds": evaluation.seconds,
        }
        | {
            name: moments.interval(metric_in_space(name, space))._asdict()
            for name, moments in evaluation.moments.items()
        }
        | {name: unknown for name in measures_of(space) if name not in evaluation.moments}
        for evaluation in evaluations
    ]
    if processes:
        rows = [row | {"processes": [*processes]} for row in rows]
    differences = compare_with_first(evaluations)
    for row in rows if len(differences) else ():
        of_policy = differences[differences["policy"] == row["policy"]].set_index("metric")
        if len(of_policy):
            row["against"] = rows[0]["policy"]
            row["differences"] = of_policy[_DIFFERENCE].to_dict("index")
    if as_json:
        print(json.dumps([_replace_nan(row) for row in rows], indent=2, allow_nan=False))
    else:
        _print_rows(rows)
        _print_differences(differences)
        if out:
            console.print_text(f"more: {command_line('study', 'show', out)}")


def _evaluate_as_study(
    data: dict[str, Any],
    processes: Sequence[str],
    out: Path,
    machines: options.Machines,
    yes: bool,
) -> "list[Evaluation]":
    """Run the scenario as a study, which is named after its folder."""
    from dess.analysis.execution.effort import check_run
    from dess.analysis.execution.evaluation import of_results
    from dess.analysis.execution.runner import run_study
    from dess.analysis.study.fields import MOST_CHARACTERS
    from dess.analysis.study.study import study_from

    name = re.sub(r"[^A-Za-z0-9._-]+|^[._-]+", "-", out.absolute().name).lstrip("-")
    data |= {"name": name[:MOST_CHARACTERS] or "evaluation", "description": "an evaluation"}
    study = study_from(data, "evaluate", run_files=True, processes=processes)
    with console.compile_notice():
        check_run(study, out, machines.workers, yes=yes)
    options.note_departures(study.policies, study.scenarios)
    return of_results(
        console.run_or_exit(
            study.name,
            lambda progress, announce: run_study(study, out, *machines, progress, announce),
        )
    )


def _replace_nan(row: Any) -> Any:
    """A row in which null stands for nan, which JSON does not have."""
    if isinstance(row, dict):
        return {name: _replace_nan(value) for name, value in row.items()}
    if row != row:
        return None
    return row


def _print_rows(rows: list[dict[str, Any]]) -> None:
    from dess.analysis.metrics import column_in_sheet_unit
    from dess.analysis.numbers import inflect

    for row in rows:
        metrics = {name: estimate for name, estimate in row.items() if isinstance(estimate, dict)}
        metrics.pop("differences", None)
        metrics = {
            name: estimate
            for name, estimate in metrics.items()
            if column_in_sheet_unit(name, metrics) == name
        }
        cells = [[name, *(f"{x:.4f}" for x in value.values())] for name, value in metrics.items()]
        console.print_table([row["policy"], "mean", "low", "high"], cells)
        engine = ", SimPy engine" if row["engine"] == "events" else ""
        if "processes" in row:
            engine += f" with {', '.join(row['processes'])}"
        speed = f" in {row['seconds']:.2f} s: {row['uav_slots'] / row['seconds']:,.0f} UAV-slots/s"
        took = "" if row["seconds"] != row["seconds"] else speed
        unit = "year" if "years" in row else "mission"
        counted = f"{row[f'{unit}s']} {inflect(unit, row[f'{unit}s'])}"
        console.print_text(f" {counted}, {row['uav_slots']} UAV-slots{took}{engine}")


def _print_differences(differences: "pd.DataFrame") -> None:
    """Each policy against the first one, mission by mission; nothing of a single policy."""
    from dess.reports.cli.tables import choose_product_differences, print_frame

    if differences.empty:
        return
    cells, _ = choose_product_differences(differences, "policy")
    print_frame(f"against {differences['baseline'].iloc[0]} [points]", cells)
    console.print_text(
        f" {differences['n'].max():,} missions of both; p-values are corrected for "
        f"{len(differences)} comparisons (Holm)"
    )
