"""``dess sweep`` and ``dess what-if``: a question in one line, and its answer with a page."""

import json
import shlex
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dess.base.errors import shown, unknown_name
from dess.base.libraries import missing
from dess.reports.cli import console, options
from dess.reports.cli.console import YesOption, run_or_exit
from dess.reports.cli.report import WHAT_IF, rendering_bar
from dess.reports.cli.studies import print_plan
from dess.reports.pages import PREFIX, check_pages

if TYPE_CHECKING:
    import pandas as pd

    from dess.analysis.ask.question import Question
    from dess.analysis.ask.sweep import Sweep
    from dess.analysis.ask.what_if import WhatIf
    from dess.analysis.results.tables import Results
    from dess.reports.pages.kernels import Progress

SHOWN = 20  # rows of the table
PRICE = "a price and its amount, e.g. uav=20000"
SHARE = "a metric and its least mean, e.g. success=0.99"

app = typer.Typer()


@options.add_command(app)
def sweep(
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUES", autocompletion=options.complete_fields),
    ] = None,
    policy: Annotated[
        list[str] | None, typer.Option(metavar="P,P,...", autocompletion=options.complete_policies)
    ] = None,
    metric: str | None = None,
    missions: Annotated[int, typer.Option(min=1)] = 300,
    scenario: options.ScenarioOption = "paper",
    seed: options.SeedOption = 0,
    workers: options.WorkersOption = 1,
    price: Annotated[list[str] | None, typer.Option(metavar="KEY=AMOUNT")] = None,
    require: Annotated[list[str] | None, typer.Option(metavar="METRIC=SHARE")] = None,
    name: str | None = None,
    results: Annotated[Path, typer.Option(metavar="DIR")] = options.RESULTS,
    out: Annotated[Path, typer.Option(metavar="DIR")] = options.PAGES,
    dry_run: Annotated[bool, typer.Option("--dry-run")] = False,
    yes: YesOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Simulate every combination of values, write a page, and print the ranked settings.

    Args:
        settings: The values of a field: 2..5, 0.01..0.05:5 (five values) or 1,2,4. A field with
            one value is fixed; zones.pads are the pads of all further zones; repeatable.
        policy: Policies to compare; repeatable.  [default: the best that five minutes allow, and
            greedy]
        metric: The metric that ranks the settings: success, ratio, product, reward, cost, or
            what the scenario measures, such as age.  [default: product]
        missions: Missions per setting; with --require, additional missions that check each
            selected setting.
        price: A price: uav, pad, charge, hour or lost_uav; also currency, missions (planned for
            the fleet) and slot_seconds; repeatable.
        require: Search for the cheapest setting whose mean of a metric (success, ratio,
            product) is at least this, or of age at most: "6 h" with a data sheet, otherwise
            mission slots; repeatable. It may be half a point below; the answer says what is
            guaranteed.
        name: Name of the sweep.  [default: its fields and a hash]
        results: Folder in which the results are stored, as sweeps/NAME.
        out: Folder of the page.
        dry_run: Only print the plan and the range of its time.
    """
    from dess.analysis.ask import around
    from dess.analysis.ask.question import sweep_question
    from dess.analysis.ask.sweep import Sweep
    from dess.analysis.metrics import ALIASES, PRODUCT, SUCCESS, column_in_sheet_unit

    policies = None
    if policy:
        policies = [name for text in policy for name in text.split(",")]
    question = sweep_question(
        options.parse_all_values(settings or []),
        scenario,
        policies,
        missions,
        seed,
        options.parse_all_settings(map(_with_quotes, price or []), "--price", PRICE),
        options.parse_all_settings(map(_with_quotes, require or []), "--require", SHARE),
        name,
        folder=results,
    )
    measured = question.study.metrics
    ranking = column_in_sheet_unit(ALIASES.get(metric or PRODUCT, metric or PRODUCT), measured)
    if ranking not in measured:
        names = [*ALIASES, *measured]
        raise unknown_name("--metric", f"{shown(metric)} is not measured", metric, names)
    page = f"{PREFIX}{question.study.name}"
    results_of_sweep = _run_question(question, page, out, workers, dry_run, yes)
    answer = Sweep(question, results_of_sweep)
    parameters = {}
    if metric:
        parameters["metric"] = ranking
    if question.study.selection:
        changes = around.question_around(results_of_sweep, question.study.scenario)
        if changes:
            _run_question(changes, page, out, workers, dry_run, yes)

    def render(progress: "Progress") -> Path:
        from dess.reports.pages.render import render_study

        return render_study(question.out, out, progress, parameters)

    tables = {"table": answer.table(ranking)}
    if question.study.selection:
        tables["fleets"] = answer.fleets()
        show = partial(_print_fleets, answer, parameters.get("metric", SUCCESS))
    else:
        show = partial(_print_settings, answer, ranking)
    _print_answer(answer, answer.answers(ranking), tables, show, render, as_json, "sweep")


@options.add_command(app, WHAT_IF)
def what_if(
    settings: Annotated[
        list[str],
        typer.Option(options.SET, metavar="KEY=VALUE", autocompletion=options.complete_fields),
    ],
    baseline: Annotated[
        list[str] | None, typer.Option(metavar="KEY=VALUE", autocompletion=options.complete_fields)
    ] = None,
    policy: Annotated[
        list[str] | None, typer.Option(metavar="P[,P...]", autocompletion=options.complete_policies)
    ] = None,
    missions: Annotated[int, typer.Option(min=2)] = 500,
    scenario: options.ScenarioOption = "paper",
    seed: options.SeedOption = 0,
    workers: options.WorkersOption = 1,
    shown: Annotated[str | None, typer.Option(metavar="P[,P...]")] = None,
    results: Annotated[Path, typer.Option(metavar="DIR")] = options.RESULTS,
    out: Annotated[Path, typer.Option(metavar="DIR")] = options.PAGES,
    dry_run: Annotated[bool, typer.Option("--dry-run")] = False,
    yes: YesOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Compare a variation with a baseline on the same missions, write a page, print the answer.

    Args:
        settings: What the variation changes: a field of the scenario and its value, in TOML
            syntax, a quantity such as 35 min without quotes; repeatable.
        baseline: A field that is set in the baseline, and in the variation as well where --set
            does not set it; repeatable.  [default: the scenario as it is]
        policy: A policy, or several that the UAVs follow in turn, compared with itself;
            repeatable.  [default: the best that five minutes allow, and greedy]
        missions: Missions of every policy on each side.
        shown: The policy whose missions are drawn.  [default: the best one in the variation]
        results: Folder in which the results are stored, as what-if/HASH.
        out: Folder of the page.
        dry_run: Only print the plan and the range of its time.
    """
    from dess.analysis.ask.question import what_if_question
    from dess.analysis.ask.what_if import VARIATION, WhatIf, best_policy_of_side, check_shown

    changes = options.parse_all_settings(settings, options.SET)
    fixed = options.parse_all_settings(baseline or [], "--baseline")
    question = what_if_question(changes, fixed, scenario, policy, missions, seed, results)
    check_shown(question, shown)
    results_of_pair = _run_question(question, WHAT_IF, out, workers, dry_run, yes)
    parameters = {
        "settings": changes,
        "baseline": fixed,
        "scenario": scenario,
        "policies": [*map(str, question.study.policies)],
        "missions": missions,
        "seed": seed,
        "shown": shown,
    }

    def render(progress: "Progress") -> Path:
        from dess.reports.pages.render import render

        render([WHAT_IF], results, out, progress, parameters)
        return out / f"{WHAT_IF}.html"

    answer = WhatIf(
        question, results_of_pair, shown or best_policy_of_side(results_of_pair, VARIATION)
    )
    show = partial(_print_measures, answer)
    tables = {"table": answer.table()}
    _print_answer(answer, answer.answers(), tables, show, render, as_json, "what-if question")


def _run_question(
    question: "Question", page: str, out: Path, workers: int, dry_run: bool, yes: bool
) -> "Results":
    """Run a question after all checks; with --dry-run, print its plan and end the command."""
    study, folder = question.study, question.out
    if dry_run:
        print_plan(question.plan(workers), study, folder, workers)
        raise typer.Exit
    check_pages(out, page)
    results = run_or_exit(
        study.name,
        lambda progress, announce: question.ask(workers, progress, announce, yes),
        shlex.join(["dess", "study", "run", str(question.file), "--out", str(folder)]),
    )
    options.note_departures(study.policies, study.scenarios)
    return results


def _print_answer(
    answer: "Sweep | WhatIf",
    sentences: list[str],
    tables: "dict[str, pd.DataFrame]",
    show: Callable[[], None],
    render: "Callable[[Progress], Path]",
    as_json: bool,
    asked: str,
) -> None:
    """Print an answer, and write its page, which takes longer; or print all of it as JSON."""
    question = answer.question
    if not as_json:
        show()
        for line in sentences:
            console.print_text(line)
        console.print_text(f"study: {question.file}")
    page = None
    if absent := missing("reports", f"the page of a {asked}"):
        console.print_text(f"no page: {absent}", sys.stderr)
    else:
        with rendering_bar() as progress:
            page = render(progress)
    if as_json:
        places = {"results": str(question.out), "study_file": str(question.file)}
        about = {"study": question.study.name, **places, "page": page and str(page)}
        rows = {name: json.loads(table.to_json(orient="records")) for name, table in tables.items()}
        print(json.dumps({**about, "answers": sentences, **rows}, indent=2))
    elif page:
        console.print_text(f"page: {page}")


def _print_settings(answer: "Sweep", ranking: str) -> None:
    """Print the first settings of the ranking."""
    import numpy as np
    import pandas as pd

    from dess.analysis import numbers
    from dess.analysis.answers.settings.home import with_way_home
    from dess.analysis.answers.settings.points import varied_values
    from dess.analysis.metrics import COST, PRODUCT, SUCCESS, metric_of
    from dess.analysis.names import field_named

    prices = answer.question.study.costs
    table = answer.table(ranking)
    top = table.head(SHOWN)
    cells = pd.DataFrame({"rank": top["rank"], "": np.where(top["tied"], "≈", "")})
    cells["policy"] = top["policy"]
    for field in varied_values(answer.results):
        cells[field] = top[field].map(field_named(field).cell)
    shown = with_way_home(answer.results, [ranking, SUCCESS, PRODUCT])
    for metric in map(metric_of, shown):
        if metric.column != COST:
            cells[metric.head] = numbers.format_estimates(top, metric.column, metric.written)
    if prices:
        cells[COST] = [numbers.format_money(cost, prices.currency) for cost in top[COST]]
    console.print_table([*map(str, cells)], cells.astype(str).to_numpy().tolist())
    settings = f"{len(table):,} settings"
    if len(table) > SHOWN:
        settings += f", the first {SHOWN} are shown"
    what = metric_of(ranking).within
    console.print_text(f"{settings}; ≈: the {what} may be as good as that of the first")


def _print_fleets(answer: "Sweep", further: str) -> None:
    """Print the fleets of a search by cost, with the answer marked; then what a change brings.

    Args:
        answer: The answer.
        further: A metric that is shown beside those of the requirements.
    """
    from dess.analysis.answers.fleet import cheapest
    from dess.analysis.answers.fleet.requirements import requirements_in_words, requirements_of
    from dess.analysis.ask import around
    from dess.reports.cli.tables import print_frame

    results = answer.results
    rows = cheapest.fleet_rows(results)
    cells = cheapest.fleet_cells(results, cheapest.shown_rows(rows, SHOWN), further)
    print_frame("Fleet", cells.set_index("Fleet"))
    pairs = f"{len(rows):,} pairs of a fleet and a policy"
    if len(rows) > SHOWN:
        pairs += f", {SHOWN} of them shown"
    console.print_text(
        f"{pairs}, the cheapest first; required: "
        f"{requirements_in_words(requirements_of(results))}; {cheapest.VERDICTS_EXPLAINED}"
    )
    if around.is_known(results):
        print_frame("What if", around.table_around(results).cells.set_index("What if"))


def _print_measures(answer: "WhatIf") -> None:
    """Print what was measured on both sides, policy by policy."""
    from dess.reports.cli.tables import print_frame

    for policy in answer.results.policies:
        print_frame(policy, answer.measures(policy).set_index("Mean per mission"))


def _with_quotes(text: str) -> str:
    """The name of a currency, or a time with its unit, in TOML syntax."""
    key, _, value = text.partition("=")
    is_text = key.strip() == "currency" or (key.strip() == "age" and value.strip(" .0123456789"))
    quoted = not is_text or value.strip().startswith(("'", '"'))
    if quoted:
        return text
    return f"{key}={json.dumps(value)}"
