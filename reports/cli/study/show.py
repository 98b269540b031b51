"""``dess study show``: the results of a study, as tables or as one document."""

import json
from pathlib import Path
from typing import Annotated

import typer

from dess import InputError
from reports.cli.settings import JsonOption


def show(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A results folder.")],
    policy: Annotated[
        str | None,
        typer.Option(
            metavar="P[,P...]",
            help="Policy whose worst missions are shown.  [default: the best policy]",
        ),
    ] = None,
    worst: Annotated[int, typer.Option(min=0, help="Number of worst missions to show.")] = 5,
    as_json: JsonOption = False,
) -> None:
    """Show the results of a study: means, comparisons, selections, the worst missions."""
    import pandas as pd

    from analysis.questions import costs, summary
    from analysis.results.tables import load_results
    from reports.cli.study import tables as printed

    results = load_results(folder)
    if policy is not None and policy not in results.policies:
        allowed = ", ".join(results.policies)
        raise InputError(f"--policy: {policy!r} is not in the study; allowed: {allowed}")
    policy = policy or summary.best_policy(results.missions)
    tables = {
        "means": summary.means(results),
        "distributions": summary.distributions(results),
        "precisions": summary.precisions(results),
        "comparisons": summary.comparisons(results),
        "learned_against_heuristic": summary.learned_against_heuristic(results),
        "sensitivities": summary.sensitivities(results),
        "costs": costs.front(results) if results.store.manifest.costs else pd.DataFrame(),
        "selected": summary.selections(results),
        "checks": summary.checks(results),
        "worst": summary.worst(results, policy, worst, folder=folder),
    }
    if as_json:
        rows = {name: json.loads(t.to_json(orient="records")) for name, t in tables.items()}
        about = {
            "study": results.manifest["study"]["name"],
            "accepted": results.manifest["accepted"],
        }
        print(json.dumps(about | rows, indent=2))
        return
    printed.print_summary(results, folder, short=False)
    printed.print_details(results, tables)
