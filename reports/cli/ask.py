"""``dess sweep`` and ``dess what-if``: a question in one line, and its answer with a page."""

import json
import re
import sys
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dess.base.commands import command_line
from dess.base.libraries import missing
from dess.reports.cli import console, options
from dess.reports.cli.console import YesOption, run_or_exit
from dess.reports.cli.report import WHAT_IF, rendering_bar
from dess.reports.cli.studies import complete_shard, print_plan
from dess.reports.pages import PREFIX, check_pages

if TYPE_CHECKING:
    from dess.analysis.ask.answer import Answer
    from dess.analysis.ask.question import Question
    from dess.analysis.results.shards import Shard
    from dess.analysis.results.tables import Results
    from dess.reports.pages.missing import Progress

PRICE = "a price and its amount, e.g. uav=20000"
SHARE = "a metric and its least mean, e.g. success=0.99"

WHAT_IF_QUESTION = "what-if question"

app = typer.Typer()


@options.add_command(app)
def sweep(
    context: typer.Context,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUES", autocompletion=options.complete_fields),
    ] = None,
    policy: Annotated[
        list[str] | None,
        typer.Option(
            metavar="P,P,...",
            autocompletion=options.complete_policies,
            callback=options.use_current_names,
        ),
    ] = None,
    metric: str | None = None,
    missions: Annotated[int, typer.Option(min=1)] = 300,
    years: options.YearsOption = None,
    scenario: options.ScenarioOption = "paper",
    seed: options.SeedOption = 0,
    workers: options.WorkersOption = 1,
    scheduler: options.SchedulerOption = None,
    shard: options.ShardOption = None,
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
            what the scenario measures, such as age.  [default: product, or age in years]
        missions: Missions per setting; with --require, additional missions that check each
            selected setting.
        price: A price: uav, pad, charge, hour or lost_uav; also currency, missions (planned for
            the fleet) and slot_seconds. With years (over which the fleet is paid off) and days
            (with a mission in a year), costs are those of a year; then also interest, pack (a
            battery) and pack_cycles. Repeatable.
        require: Search for the cheapest setting whose mean of a metric (success, ratio,
            product) is at least this, or of age at most: "6 h" with a data sheet, otherwise
            mission slots; repeatable. It may be half a point below; the answer says what is
            guaranteed.
        name: Name of the sweep.  [default: its fields and a hash]
        results: Folder in which the results are stored, as sweeps/NAME.
        out: Folder of the page.
        dry_run: Only print the plan and the range of its time.
    """
    from dess.analysis.ask.answer import settings_answer
    from dess.analysis.ask.question import sweep_question

    values = options.parse_all_values(settings or [])
    policies = None
    if policy:
        policies = [name for text in policy for name in text.split(",")]
    question = sweep_question(
        values,
        scenario,
        policies,
        options.given(context, "missions"),
        seed,
        _prices_of(price),
        options.parse_all_settings(map(_with_quotes, require or []), "--require", SHARE),
        name,
        folder=results,
        years=years,
    )
    parameters = {}
    if metric:
        parameters["metric"] = question.measured_column(metric, "--metric")
    machines = options.Machines(workers, scheduler)
    if part := options.parse_shard(shard, [question.study], json=as_json):
        _ask_shard(question, part, machines, dry_run, yes)
        return
    page = f"{PREFIX}{question.study.name}"
    asked_results = _run_question(question, page, out, machines, dry_run, yes)
    _ask_around(question, asked_results, page, out, machines)
    answer = settings_answer(asked_results, question, parameters.get("metric"))

    def render(progress: "Progress") -> Path:
        from dess.reports.pages.render import render_study

        return render_study(asked_results, out, progress, parameters)

    _print_answer(question, answer, render, as_json, "sweep")


@options.add_command(app, WHAT_IF)
def what_if(
    context: typer.Context,
    settings: Annotated[
        list[str],
        typer.Option(options.SET, metavar="KEY=VALUE", autocompletion=options.complete_fields),
    ],
    baseline: Annotated[
        list[str] | None, typer.Option(metavar="KEY=VALUE", autocompletion=options.complete_fields)
    ] = None,
    policy: Annotated[
        list[str] | None,
        typer.Option(
            metavar="P[,P...]",
            autocompletion=options.complete_policies,
            callback=options.use_current_names,
        ),
    ] = None,
    missions: Annotated[int, typer.Option(min=2)] = 500,
    years: options.YearsOption = None,
    scenario: options.ScenarioOption = "paper",
    seed: options.SeedOption = 0,
    workers: options.WorkersOption = 1,
    scheduler: options.SchedulerOption = None,
    price: Annotated[list[str] | None, typer.Option(metavar="KEY=AMOUNT")] = None,
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
        price: A price, as for dess sweep; then the costs of both sides are compared. Repeatable.
        shown: The policy whose missions are drawn.  [default: the best one in the variation]
        results: Folder in which the results are stored, as what-if/HASH.
        out: Folder of the page.
        dry_run: Only print the plan and the range of its time.
    """
    from dess.analysis.ask.answer import VariationAnswer, check_shown
    from dess.analysis.ask.question import what_if_question

    changes = options.parse_all_settings(settings, options.SET)
    fixed = options.parse_all_settings(baseline or [], "--baseline")
    prices = _prices_of(price)
    question = what_if_question(
        changes,
        fixed,
        scenario,
        policy,
        options.given(context, "missions"),
        seed,
        results,
        prices=prices,
        years=years,
    )
    check_shown(question, shown)
    machines = options.Machines(workers, scheduler)
    asked_results = _run_question(question, WHAT_IF, out, machines, dry_run, yes)
    answer = VariationAnswer(asked_results, question, shown)
    parameters = {
        "settings": changes,
        "baseline": fixed,
        "scenario": scenario,
        "policies": [*map(str, question.study.policies)],
        "missions": None if question.study.years else missions,
        "seed": seed,
        "prices": prices or None,
        "shown": shown,
    }

    def render(progress: "Progress") -> Path:
        from dess.reports.pages.render import render

        render([WHAT_IF], results, out, progress, parameters)
        return out / f"{WHAT_IF}.html"

    _print_answer(question, answer, render, as_json, WHAT_IF_QUESTION)


def _run_question(
    question: "Question", page: str, out: Path, machines: options.Machines, dry_run: bool, yes: bool
) -> "Results":
    """Run a question after all checks; with --dry-run, print its plan and end the command."""
    study, folder = question.study, question.out
    if dry_run:
        _print_plan(question, machines.workers)
        raise typer.Exit
    check_pages(out, page)
    results = run_or_exit(
        study.name,
        lambda progress, announce: question.ask(
            machines.workers, progress, announce, yes, machines.scheduler
        ),
        command_line("study", "run", question.file, out=folder),
        study.replication_name,
    )
    options.note_departures(study.policies, study.scenarios)
    return results


def _ask_shard(
    question: "Question", shard: "Shard", machines: options.Machines, dry_run: bool, yes: bool
) -> None:
    """Run a shard of a question; with --dry-run, print the plan of all shards at once."""
    if dry_run:
        _print_plan(question, machines.workers, shard.total)
        return
    study, folder = question.study, question.out
    complete_shard(
        study,
        folder,
        shard,
        lambda progress, announce: question.ask_shard(
            shard, machines.workers, progress, announce, yes, machines.scheduler
        ),
        command_line("study", "run", question.file, out=folder, shard=shard),
    )
    console.print_text("then the same command without --shard has the answer")


def _print_plan(question: "Question", workers: int, shards: int = 1) -> None:
    """Print the plan of a question, with the notes that its answer has."""
    options.print_notes(question.notes)
    print_plan(question.plan(workers), question.study, question.out, workers * shards)


def _ask_around(
    question: "Question", results: "Results", page: str, out: Path, machines: options.Machines
) -> None:
    """Ask what one more UAV or pad brings to the cheapest fleet, and what the fleet bears."""
    from dess.analysis.ask.around import question_around
    from dess.analysis.ask.limit_search import find_limits

    scenario = question.study.scenario
    if question.study.selection and (changes := question_around(results, scenario)):
        _run_question(changes, page, out, machines, dry_run=False, yes=True)
        if question.study.years:  # limits are of a wind and of failures in single missions
            return
        with console.compile_notice(), console.progress_bar("mission") as shown:
            find_limits(results, scenario, machines.workers, shown.update)


def _print_answer(
    question: "Question",
    answer: "Answer",
    render: "Callable[[Progress], Path]",
    as_json: bool,
    asked: str,
) -> None:
    """Print an answer, and write its page, which takes longer; or print all of it as JSON."""
    from dess.reports.cli.tables import print_facts, print_table_with_caption

    facts = answer.facts()
    assumed = answer.assumptions()
    if not as_json:
        console.print_text(answer.headline())
        print_facts(facts)
        for table in answer.shown_tables():
            print_table_with_caption(table)
        if assumed:
            console.print_text("What is assumed:")
            print_facts(assumed)
        # Once more, since the tables may have moved the headline out of the window.
        console.print_text(f"answer: {answer.headline()}")
        console.print_text(f"study: {question.file}")
    page = None
    absent: object = missing("reports", f"the page of a {asked}")
    if question.study.years and asked == WHAT_IF_QUESTION:
        absent = "it draws single missions, and these are years"
    if absent:
        console.print_text(f"no page: {absent}", sys.stderr)
    else:
        with rendering_bar() as progress:
            page = render(progress)
    if as_json:
        places = {"results": str(question.out), "study_file": str(question.file)}
        about = {"study": question.study.name, **places, "page": page and str(page)}
        rows = {
            name: json.loads(table.to_json(orient="records"))
            for name, table in answer.tables().items()
        }
        sentences = {
            "answers": [answer.headline(), *(fact.line for fact in facts)],
            "assumptions": [fact.line for fact in assumed],
            "facts": [asdict(fact) for fact in facts],
        }
        print(json.dumps({**about, **sentences, **rows}, indent=2))
    elif page:
        console.print_text(f"page: {page}")


def _prices_of(options_given: list[str] | None) -> dict[str, Any]:
    """The prices that a command names."""
    return options.parse_all_settings(map(_with_quotes, options_given or []), "--price", PRICE)


def _with_quotes(text: str) -> str:
    """The name of a currency, or a time with its unit, in TOML syntax."""
    key, _, value = text.partition("=")
    is_number = re.fullmatch(r"[-+]?[0-9.,]+ ?%?", value.strip())
    is_time = key.strip() in ("age", "oldest") and not is_number
    is_text = key.strip() == "currency" or is_time
    quoted = not is_text or value.strip().startswith(("'", '"'))
    if quoted:
        return text
    return f"{key}={json.dumps(value)}"
