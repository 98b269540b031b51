"""The ``dess study`` commands."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from analysis.names import PRODUCT, SHORT_METRICS
from dess.errors import InputError
from reports.cli import console

if TYPE_CHECKING:
    import pandas as pd

    from analysis.execution.dry_run import Plan
    from analysis.results.tables import Results
    from analysis.study.study import Study

RESULTS = Path("results")
MANY = 40  # design points, more than which are not listed

# The metrics as the tables call them.

JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON document.")]
WorkersOption = Annotated[int, typer.Option("--workers", min=1, help="How many to work at once.")]

app = typer.Typer(help="Studies: policies x design points x replications.")


@app.command("run")
def run(
    name: Annotated[str, typer.Argument(metavar="NAME|FILE", help="A study or a TOML file.")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help=f"Results folder.  [default: {RESULTS}/NAME]"),
    ] = None,
    workers: WorkersOption = 1,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Run on this dask.distributed scheduler."),
    ] = None,
    missions: Annotated[
        int | None, typer.Option(min=1, help="Missions per design point and policy.")
    ] = None,
    policy: Annotated[
        list[str] | None, typer.Option(metavar="P[,P...]", help="Policies instead; repeatable.")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only say what would be done, and how long it takes.")
    ] = False,
) -> None:
    """Run a study into a results folder; run again to resume or to top up."""
    from analysis.execution.runner import ChunkError, run_study
    from analysis.study.study import load_study

    changes = {"missions": missions, "policies": policy}
    study = load_study(name, **{key: value for key, value in changes.items() if value is not None})
    out = out or RESULTS / study.name
    if dry_run:
        from analysis.execution.dry_run import plan_study

        with console.compile_notice():
            _print_plan(plan_study(study, out, workers), study, out, workers)
        return
    try:
        with console.compile_notice(), console.rounds_bar() as (progress, announce):
            results = run_study(study, out, workers, scheduler, progress, announce)
    except KeyboardInterrupt:
        line = "interrupted: run the same command again to complete it"
        raise typer.Exit(console.fail(line, 1)) from None
    except ChunkError as error:
        for path, failure in error.failures.items():
            console.fail(f"failed: {failure.error} ({path}); replay: {failure.replay}", 1)
        count = len(error.failures)
        line = f"dess: error: {count} of the chunks of study {study.name} failed, the rest is done"
        raise typer.Exit(console.fail(line, 1)) from None
    _print_summary(results, out, short=True)
    print(f"more: dess study show {out}")


@app.command("show")
def show(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A results folder.")],
    policy: Annotated[
        str | None,
        typer.Option(metavar="P[,P...]", help="Whose worst missions.  [default: the best policy]"),
    ] = None,
    worst: Annotated[int, typer.Option(min=0, help="How many of the worst missions.")] = 5,
    as_json: JsonOption = False,
) -> None:
    """Say what a study found: means, comparisons, what it selected, its worst missions."""
    from analysis.questions import summary
    from analysis.results.tables import load_results

    results = load_results(folder)
    if policy and policy not in results.policies:
        allowed = ", ".join(results.policies)
        raise InputError(f"--policy: {policy} is not in the study; allowed: {allowed}")
    whose = policy or summary.best_policy(results.missions)
    tables = {
        "means": summary.means(results),
        "distributions": summary.distributions(results),
        "precisions": summary.precisions(results),
        "comparisons": summary.comparisons(results),
        "learned_against_heuristic": summary.learned_against_heuristic(results),
        "sensitivities": summary.sensitivities(results),
        "selected": summary.selections(results),
        "checks": summary.checks(results),
        "worst": summary.worst(results, whose, worst),
    }
    if as_json:
        rows = {name: json.loads(t.to_json(orient="records")) for name, t in tables.items()}
        print(json.dumps({"study": results.manifest["study"]["name"]} | rows, indent=2))
        return
    _print_summary(results, folder, short=False)
    _print_sensitivities(tables["sensitivities"])
    _print_by_point(results, tables["means"], list(SHORT_METRICS))
    _print_distributions(tables["distributions"])
    _print_precisions(results, tables["precisions"])
    _print_comparisons(tables["comparisons"])
    _print_learners(tables["learned_against_heuristic"])
    _print_worst(tables["worst"], whose)


def _print_plan(plan: "Plan", study: "Study", out: Path, workers: int) -> None:
    """What would be done, and about how long it takes."""
    rows = [
        [p.policy, f"{p.missions:,}", f"{p.present:,}", f"{p.seconds:,.0f} s"]
        for p in plan.policies
    ]
    console.print_table(["policy", "missions", "there", "time on one core"], rows)
    per_cell = f"{study.first} replications"
    if plan.at_most is not None:
        rule = "selection" if study.selection else "precision"
        per_cell += f" and more, up to {plan.at_most:,} missions, as {rule} asks"
    print(
        f"{out}: {plan.missions:,} missions of study {study.name} ({len(study.policies)} policies "
        f"x {plan.points} design points x {per_cell})"
    )
    more = "at least " if plan.at_most is not None else ""
    print(f"about {more}{plan.seconds:,.0f} s with {workers} at work")


def _print_summary(results: "Results", folder: Path, short: bool) -> None:
    """The means at the only design point, or what was selected and its check."""
    from analysis.questions import summary
    from analysis.replication import paper

    study = results.manifest["study"]
    print(f"{folder}: {len(results.missions):,} missions of study {study['name']}")
    printed = paper.PRINTED.get(study["name"], {})
    if study["selection"]:
        _print_selections(summary.selections(results))
        if checks := study["selection"]["check"]:
            title = f"{checks} further missions"
            _print_metrics(summary.checks(results), title, printed)
        return
    means = summary.means(results)
    if len(summary.settings(results)) == 1:
        _print_metrics(means, "mean, 95 % interval", printed)
    elif short:
        _print_by_point(results, means, [PRODUCT])


def _print_selections(selected: "pd.DataFrame") -> None:
    """What was selected for every policy, and with what guarantee."""
    rows = [[s.policy, s.setting, f"{s.missions:,}", str(s.left)] for s in selected.itertuples()]
    console.print_table(["selected for", "setting", "missions", "left"], rows)
    for guarantee in dict.fromkeys(selected["guarantee"]):
        print(f" {guarantee}")


def _print_metrics(means: "pd.DataFrame", title: str, printed: dict[str, float]) -> None:
    """A row per policy, a column per metric, and what the paper prints."""
    cells = {(row.policy, row.metric): _interval(row) for row in means.itertuples()}
    rows = [[p, *(cells[p, metric] for metric in SHORT_METRICS)] for p in means["policy"].unique()]
    if printed:
        rows.append(["paper", *(f"{100 * printed[metric]:.1f} %" for metric in SHORT_METRICS)])
    console.print_table([title, *SHORT_METRICS.values()], rows)


def _print_by_point(results: "Results", means: "pd.DataFrame", metrics: list[str]) -> None:
    """A table per metric, a row per design point, if these are some and not too many."""
    from analysis.questions.summary import settings

    named = settings(results)
    if len(named) == 1:
        return
    if len(named) > MANY:
        print(f"{len(named)} design points are too many to list; --json has them")
        return
    cells = {(row.metric, row.point, row.policy): _interval(row) for row in means.itertuples()}
    for metric in metrics:
        rows = [
            [setting, *(cells[metric, point, policy] for policy in results.policies)]
            for point, setting in enumerate(named)
        ]
        console.print_table([SHORT_METRICS[metric], *results.policies], rows)


def _print_distributions(table: "pd.DataFrame") -> None:
    """The spread of the product: what 5 %, half and 95 % of the missions stay below, the worst."""
    if table.empty:
        return
    rows = []
    for policy, views in table.groupby("policy", sort=False):
        quantiles = views[views["view"] == "quantile"].set_index("share")["value"]
        (worst,) = views[views["view"] == "worst mean"].itertuples()
        cells = [f"{100 * quantiles[share]:.1f} %" for share in (0.05, 0.5, 0.95)]
        cells.append(f"{100 * worst.value:.1f} % [{100 * worst.low:.1f}, {100 * worst.high:.1f}]")
        rows.append([policy, *cells])
    head = ["spread of the product", "5 % quantile", "median", "95 % quantile"]
    console.print_table([*head, "mean of the worst 5 %"], rows)


def _print_precisions(results: "Results", table: "pd.DataFrame") -> None:
    """What came of the targets."""
    from analysis.questions.summary import settings

    named = settings(results)
    rows = [
        [
            " ".join([row.policy, named[row.point]]).strip(),
            row.metric,
            f"{row.missions:,}",
            f"{row.mean:.4g} ± {row.half_width:.2g}",
            f"{row.target:.2g}",
            "yes" if row.met else "no: the budget ended",
        ]
        for row in table.itertuples()
    ]
    if rows:
        head = ["precision", "metric", "missions", "mean", "asked for", "reached"]
        console.print_table(head, rows)


def _print_sensitivities(table: "pd.DataFrame") -> None:
    """A table per policy, a row per parameter: alone, and with all that it takes part in."""
    if table.empty:
        return
    product = table[table["metric"] == PRODUCT]
    for policy, rows in product.groupby("policy", sort=False):
        cells = [
            [row.parameter, *(_index(row, kind) for kind in ("first", "total"))]
            for row in rows.itertuples()
        ]
        console.print_table([f"{policy}: share of the product's variance", "alone", "total"], cells)


def _index(row: Any, kind: str) -> str:
    estimate, low, high = (getattr(row, kind + end) for end in ("", "_low", "_high"))
    return f"{100 * estimate:.1f} % [{100 * low:.1f}, {100 * high:.1f}]"


def _print_comparisons(table: "pd.DataFrame") -> None:
    """How the other policies differ from the best one, mission by mission."""
    if table.empty:
        return
    rows = [
        [policy, *differences, f"{product.p_adjusted:.2g}", _gain(product)]
        for policy, differences, product in _by_metric(table, "policy")
    ]
    head = [f"against {table['baseline'].iloc[0]} [points]", *SHORT_METRICS.values()]
    console.print_table([*head, "p (Holm)", "pairing saves"], rows)


def _print_learners(table: "pd.DataFrame") -> None:
    """What the learners are worth beside the best heuristic, and what that is known of."""
    if table.empty:
        return
    rows = [
        [learner, *differences, f"{product.p_adjusted:.2g}", product.about, str(product.trainings)]
        for learner, differences, product in _by_metric(table, "learner")
    ]
    head = [f"learned against {table['baseline'].iloc[0]} [points]", *SHORT_METRICS.values()]
    console.print_table([*head, "p (Holm)", "about", "trainings"], rows)


def _by_metric(table: "pd.DataFrame", who: str) -> Iterator[tuple[str, list[str], Any]]:
    """A row's name, its differences in every metric, and its row of the product."""
    for name, rows in table.groupby(who, sort=False):
        of = {row.metric: row for row in rows.itertuples()}
        yield name, [_difference(of[metric]) for metric in SHORT_METRICS], of[PRODUCT]


def _gain(row: Any) -> str:
    """How many times as many missions it would take without common random numbers."""
    reduction = row.variance_reduction
    return f"{1 / (1 - reduction):.1f} x" if reduction < 1 else ""


def _difference(row: Any) -> str:
    return f"{100 * row.difference:+.2f} [{100 * row.low:+.2f}, {100 * row.high:+.2f}]"


def _print_worst(table: "pd.DataFrame", policy: str) -> None:
    """The worst missions of a policy, with the commands that simulate them again."""
    if len(table):
        print(f" worst missions of {policy}, by collection ratio and communication:")
    for row in table.itertuples():
        outcome = "" if row.success else ", no success"
        print(f"   {100 * row.collection_ratio:.1f} % collected{outcome}: {row.command}")


def _interval(row: Any) -> str:
    return f"{100 * row.mean:.1f} % [{100 * row.low:.1f}, {100 * row.high:.1f}]"
