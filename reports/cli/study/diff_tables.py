"""Tables of the differences between two results folders, for a terminal."""

import pandas as pd

from analysis.questions import diff
from analysis.questions.summary import settings
from reports.cli import console
from reports.cli.study.tables import differences, print_frame

MANY, FIELDS = 10, 4  # rows on differences, and fields of a mission, that are printed


def print_diff(found: diff.Diff, most: int) -> None:
    """Print how many missions of two results differ, by how much, and the most changed ones."""
    missions, differ = len(found.missions), len(found.changed)
    if found.identical:
        console.say(f"identical: {missions:,} missions")
    elif not differ:
        console.say(f"identical: the {missions:,} missions that both have")
    else:
        console.say(f"{differ:,} of {missions:,} missions differ")
    for origin in diff.origins(found):
        console.say(f" {origin}")
    _print_alone(found.alone)
    if differ:
        _print_effects(found)
        _print_most_changed(found, most)


def _print_alone(alone: pd.DataFrame) -> None:
    """What only one of the folders has."""
    for side, rows in alone.groupby("only_in"):
        for row in rows[:MANY].itertuples():
            console.say(f" only in {side}: {row.what} ({row.missions:,} missions)")
        if len(rows) > MANY:
            console.say(
                f" only in {side}: {len(rows) - MANY:,} more groups of missions; --json has them"
            )


def _print_effects(found: diff.Diff) -> None:
    """Differences by policy, and by policy and design point if there are several."""
    table = diff.effects(found)
    _print_differences(table.assign(who=table["policy_a"]))
    if len(points := settings(found.a)) > 1:
        table = diff.effects(found, ["policy_a", "point_a"])
        words = table["point_a"].map(dict(enumerate(points)))
        _print_differences(table.assign(who=table["policy_a"] + " " + words))


def _print_differences(table: pd.DataFrame) -> None:
    """A row for everything whose missions differ: how many do, and B - A in every metric."""
    rows = table[table["differ"] > 0]
    names = rows["who"].drop_duplicates()
    cells, product = differences(rows[rows["who"].isin(names[:MANY])], "who")
    counts = product["differ"].map("{:,}".format) + " of " + product["missions"].map("{:,}".format)
    cells.insert(0, "missions that differ", counts)
    print_frame("B - A [points]", cells)
    if (more := len(names) - MANY) > 0:
        console.say(f" {more:,} more rows; --json has them")
    if same := table["who"].nunique() - len(names):
        console.say(f" {same:,} more without any difference")


def _print_most_changed(found: diff.Diff, most: int) -> None:
    """The most changed missions, with the commands that simulate them again."""
    points = settings(found.a)
    for side, results in (("A", found.a), ("B", found.b)):
        console.say(f" {side}, {results.store.folder}: {diff.at_hand(results)}")
    console.say(" most changed missions:")
    for row in diff.most_changed(found, most).itertuples():
        where = f"{row.policy_a} {points[row.point_a]}".strip()
        console.say(
            f"   {where}, replication {row.replication}: {_shortened(row.fields.split(', '))}"
        )
        console.say(f"     A: {row.command_a}\n     B: {row.command_b}")


def _shortened(fields: list[str]) -> str:
    """The first of the fields that differ, and how many more there are."""
    more = f", and {len(fields) - FIELDS} more" if len(fields) > FIELDS else ""
    return ", ".join(fields[:FIELDS]) + more
