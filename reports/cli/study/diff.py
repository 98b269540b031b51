"""``dess study diff``: two results folders, mission by mission."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from reports.cli.settings import JsonOption

if TYPE_CHECKING:
    from analysis.questions.diff import Diff


def diff(
    a: Annotated[Path, typer.Argument(metavar="A")],
    b: Annotated[Path, typer.Argument(metavar="B")],
    most: Annotated[int, typer.Option(min=0)] = 5,
    as_json: JsonOption = False,
) -> None:
    """Compare two results folders mission by mission, with the same random draws.

    Args:
        a: A results folder.
        b: Another results folder.
        most: Number of most changed missions to show.
    """
    from analysis.questions import diff
    from analysis.results.tables import load_results
    from reports.cli.study.diff_tables import print_diff

    found = diff.diff(load_results(a), load_results(b))
    if as_json:
        print(json.dumps(_document(found, most), indent=2))
    else:
        print_diff(found, most)


def _document(found: "Diff", most: int) -> dict:
    """All that is found, as plain data."""
    from analysis.questions import diff

    identity = ["policy_a", "policy_b", "point_a", "point_b", "replication", "fields"]
    tables = {
        "alone": found.alone,
        "policies": diff.effects(found),
        "points": diff.effects(found, ["policy_a", "point_a"]),
        "changed": found.changed[identity],
        "most_changed": diff.most_changed(found, most)[[*identity, "command_a", "command_b"]],
    }
    return {
        "a": str(found.a.store.folder),
        "b": str(found.b.store.folder),
        "identical": found.identical,
        "missions": len(found.missions),
        "differ": len(found.changed),
        "origins": diff.origins(found),
        **{name: json.loads(table.to_json(orient="records")) for name, table in tables.items()},
    }
