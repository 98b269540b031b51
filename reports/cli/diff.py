"""``dess study diff``: two results folders compared mission by mission."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from reports.cli.settings import JsonOption

if TYPE_CHECKING:
    import pandas as pd

    from analysis.questions.diff import Diff

MANY, FIELDS = 10, 4  # rows of a table, and fields of a mission, that are printed

app = typer.Typer()


@app.command("diff")
def diff(
    a: Annotated[Path, typer.Argument(metavar="A", help="A results folder.")],
    b: Annotated[Path, typer.Argument(metavar="B", help="Another results folder.")],
    most: Annotated[int, typer.Option(min=0, help="How many of the most changed missions.")] = 5,
    as_json: JsonOption = False,
) -> None:
    """Compare two results folders mission by mission, on the same random draws."""
    from analysis.questions import diff
    from analysis.results.tables import load_results

    found = diff.diff(load_results(a), load_results(b))
    if as_json:
        print(json.dumps(_document(found, most), indent=2))
        return
    _print_counts(found)
    for origin in diff.origins(found):
        print(f" {origin}")
    _print_alone(found.alone)
    if not found.changed.empty:
        _print_effects(found)
        _print_most_changed(found, most)


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


def _print_counts(found: "Diff") -> None:
    """How many missions differ."""
    missions, differ = len(found.missions), len(found.changed)
    if found.identical:
        print(f"identical: {missions:,} missions")
    elif not differ:
        print(f"identical: the {missions:,} missions that both have")
    else:
        print(f"{differ:,} of {missions:,} missions differ")


def _print_alone(alone: "pd.DataFrame") -> None:
    """What only one of the folders has."""
    for side, rows in alone.groupby("only_in"):
        for row in rows[:MANY].itertuples():
            print(f" only in {side}: {row.what} ({row.missions:,} missions)")
        if len(rows) > MANY:
            print(f" only in {side}: {len(rows) - MANY:,} more groups of missions; --json has them")


def _print_effects(found: "Diff") -> None:
    """Differences by policy, and by policy and design point if there are several."""
    from analysis.questions import diff
    from analysis.questions.summary import settings

    table = diff.effects(found)
    _print_differences(table.assign(who=table["policy_a"]))
    if len(points := settings(found.a)) > 1:
        table = diff.effects(found, ["policy_a", "point_a"])
        words = table["point_a"].map(dict(enumerate(points)))
        _print_differences(table.assign(who=table["policy_a"] + " " + words))


def _print_differences(table: "pd.DataFrame") -> None:
    """A row for everything whose missions differ: how many do, and B - A in every metric."""
    from reports.cli import study_tables

    rows = table[table["differ"] > 0]
    names = rows["who"].drop_duplicates()
    cells, product = study_tables.differences(rows[rows["who"].isin(names[:MANY])], "who")
    counts = product["differ"].map("{:,}".format) + " of " + product["missions"].map("{:,}".format)
    cells.insert(0, "missions that differ", counts)
    study_tables.print_frame("B - A [points]", cells)
    if (more := len(names) - MANY) > 0:
        print(f" {more:,} more rows; --json has them")
    if same := table["who"].nunique() - len(names):
        print(f" {same:,} more without any difference")


def _print_most_changed(found: "Diff", most: int) -> None:
    """The most changed missions, with the commands that simulate them again."""
    from analysis.questions import diff
    from analysis.questions.summary import settings

    points = settings(found.a)
    for side, results in (("A", found.a), ("B", found.b)):
        print(f" {side}, {results.store.folder}: {diff.at_hand(results)}")
    print(" most changed missions:")
    for row in diff.most_changed(found, most).itertuples():
        where = f"{row.policy_a} {points[row.point_a]}".strip()
        print(f"   {where}, replication {row.replication}: {_shortened(row.fields.split(', '))}")
        commands = {"A": row.command_a, "B": row.command_b}
        if row.command_a == row.command_b:
            commands = {"A and B, each with its own code": row.command_a}
        for side, command in commands.items():
            print(f"     {side}: {command}")


def _shortened(fields: list[str]) -> str:
    """The first of the fields that differ, and how many more there are."""
    more = f", and {len(fields) - FIELDS} more" if len(fields) > FIELDS else ""
    return ", ".join(fields[:FIELDS]) + more
