"""``dess sweep``: every combination of values of some fields, from one line to a page."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dess.code.libraries import missing
from dess.errors import InputError, one_of, shown
from reports.cli import console, options
from reports.cli.console import YesOption, complete
from reports.cli.options import (
    PAGES,
    RESULTS,
    JsonOption,
    ScenarioOption,
    SeedOption,
    WorkersOption,
    all_settings,
    all_values,
    command,
)
from reports.cli.report import rendering
from reports.cli.studies import print_plan
from reports.folders import PREFIX, check_pages

if TYPE_CHECKING:
    from analysis.ask.sweep import Sweep

SHOWN = 20  # rows of the table
PRICE = "a price and its amount, e.g. uav=20000"
SHARE = "a metric and its least mean, e.g. success=0.99"

app = typer.Typer()


@command(app)
def sweep(
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUES", autocompletion=options.fields),
    ] = None,
    policy: Annotated[
        list[str] | None, typer.Option(metavar="P,P,...", autocompletion=options.policies)
    ] = None,
    metric: str | None = None,
    missions: Annotated[int, typer.Option(min=1)] = 300,
    scenario: ScenarioOption = "paper",
    seed: SeedOption = 0,
    workers: WorkersOption = 1,
    price: Annotated[list[str] | None, typer.Option(metavar="KEY=AMOUNT")] = None,
    require: Annotated[list[str] | None, typer.Option(metavar="METRIC=SHARE")] = None,
    name: str | None = None,
    results: Annotated[Path, typer.Option(metavar="DIR")] = RESULTS,
    out: Annotated[Path, typer.Option(metavar="DIR")] = PAGES,
    dry_run: Annotated[bool, typer.Option("--dry-run")] = False,
    yes: YesOption = False,
    as_json: JsonOption = False,
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
            product) is at least this; repeatable. It may be half a point below; the answer says
            what is guaranteed.
        name: Name of the sweep.  [default: its fields and a hash]
        results: Folder in which the results are stored, as sweeps/NAME.
        out: Folder of the page.
        dry_run: Only print the plan and the range of its time.
    """
    from analysis.ask import sweep as question
    from analysis.ask.sweep import Sweep
    from analysis.execution.effort import plan_study
    from analysis.metrics import ALIASES, PRODUCT

    study = question.question(
        all_values(settings or []),
        scenario,
        [name for text in policy for name in text.split(",")] if policy else None,
        missions,
        seed,
        all_settings(map(_with_quotes, price or []), "--price", PRICE),
        all_settings(require or [], "--require", SHARE),
        name,
    )
    ranking = ALIASES.get(metric or PRODUCT, metric or PRODUCT)
    if ranking not in study.metrics:
        allowed = one_of(metric, [*ALIASES, *study.metrics])
        raise InputError(f"--metric: {shown(metric)} is not measured{allowed}")
    folder, file = question.folder_of(study, results), question.file_of(study, results)
    if dry_run:
        plan = plan_study(study, folder, workers, reuse=question.others(folder))
        print_plan(plan, study, folder, workers)
        return
    check_pages(out, f"{PREFIX}{study.name}")
    found = complete(
        study.name,
        lambda progress, announce: question.ask(study, results, workers, progress, announce, yes),
        f"dess study run {file} --out {folder}",
    )
    answer = Sweep(study, folder, found)
    if not as_json:  # the answer comes before the page, which takes longer
        _print(answer, ranking)
        console.say(f"study: {file}")
    page = _render(folder, out, {"metric": ranking} if metric else {})
    if as_json:
        _print_json(answer, ranking, page, file)
    elif page:
        console.say(f"page: {page}")


def _render(folder: Path, out: Path, parameters: dict[str, str]) -> Path | None:
    """Write the page; a line says so where the libraries of pages are not installed."""
    if absent := missing("reports", "the page of a sweep"):
        console.say(f"no page: {absent}", sys.stderr)
        return None
    from reports.pages.render import render_study

    with rendering() as steps:
        return render_study(folder, out, steps, parameters)


def _print(answer: "Sweep", metric: str) -> None:
    """Print the first settings of the ranking, and the cheapest ones."""
    import numpy as np
    import pandas as pd

    from analysis import numbers
    from analysis.answers.settings import varied
    from analysis.metrics import COST, PRODUCT, SUCCESS, metric_of
    from analysis.names import value_text

    table, fields, prices = answer.table(metric), [*varied(answer.results)], answer.study.costs
    top = table.head(SHOWN)
    cells = pd.DataFrame({"rank": top["rank"], "": np.where(top["tied"], "≈", "")})
    cells["policy"] = top["policy"]
    cells[fields] = top[fields].map(value_text)
    required = getattr(answer.study.selection, "requirements", {})
    for name in [m for m in dict.fromkeys([metric, SUCCESS, *required, PRODUCT]) if m != COST]:
        head = metric_of(name).head
        cells[head] = numbers.estimates(top, name, metric_of(name).written)
    if prices:
        cells[COST] = [numbers.money(cost, prices.currency) for cost in top[COST]]
    console.print_table([*map(str, cells)], cells.astype(str).to_numpy().tolist())
    first = f", the first {SHOWN} are shown" if len(table) > SHOWN else ""
    what = metric_of(metric).within
    console.say(
        f"{len(table):,} settings{first}; ≈: the {what} may be as good as that of the first"
    )
    for line in answer.answers():
        console.say(line)


def _print_json(answer: "Sweep", metric: str, page: Path | None, file: Path) -> None:
    """Print all settings and where all of it is, as JSON."""
    places = {"results": str(answer.path), "study_file": str(file), "page": page and str(page)}
    answers, rows = answer.answers(), json.loads(answer.table(metric).to_json(orient="records"))
    about = {"study": answer.study.name, **places, "answers": answers, "table": rows}
    print(json.dumps(about, indent=2))


def _with_quotes(text: str) -> str:
    """The name of a currency in TOML syntax."""
    key, _, value = text.partition("=")
    quoted = key.strip() != "currency" or value.strip().startswith(("'", '"'))
    return text if quoted else f"{key}={json.dumps(value)}"
