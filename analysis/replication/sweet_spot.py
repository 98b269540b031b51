"""The best setting of every policy, and its means compared with the paper's (Section V-D)."""

import pandas as pd

from analysis import numbers
from analysis.names import METRICS, PRODUCT, parameter, value_text
from analysis.questions import main_effects, summary
from analysis.questions.printed import with_mark
from analysis.replication import paper
from analysis.results.tables import Results
from analysis.stats.paired import paired


def setting(results: Results, point: int) -> dict[str, str]:
    """The values of a design point in words, by the short names of its parameters."""
    values = results.store.manifest.points[point].values
    return {parameter(field).short: value_text(value) for field, value in values.items()}


def table(results: Results) -> pd.DataFrame:
    """A table with a row for the paper and a row per policy: its best setting and its check."""
    checks = {(row.policy, row.metric): row for row in summary.checks(results).itertuples()}
    printed = {name: numbers.percent(paper.SWEET_SPOT[metric]) for metric, name in METRICS.items()}
    rows = [{"Policy": "paper", **dict.fromkeys(setting(results, 0), ""), **printed}]
    for row in summary.selections(results).itertuples():
        means = {
            name: with_mark(checks[row.policy, metric], paper.SWEET_SPOT[metric])
            for metric, name in METRICS.items()
            if checks
        }
        effort = {"Missions": f"{row.missions:,}", "Settings left": str(row.left)}
        rows.append({"Policy": row.policy, **setting(results, row.point), **means, **effort})
    return pd.DataFrame(rows)


def guarantees(results: Results) -> str:
    """What is guaranteed about the selection for every policy: a list in Markdown."""
    rows = summary.selections(results).itertuples()
    return "\n".join(f"- **{row.policy}**: {row.guarantee}." for row in rows)


def against_main_effects(
    results: Results, effects: pd.DataFrame, changes: main_effects.ByField
) -> str:
    """Where a selected value is significantly lower than another one by the main effects, and why.

    A main effect is a mean over everything else that missions draw; at the selected setting all
    else is fixed, so the two may well disagree. What is said of the setting is measured there: the
    two values in the same missions of the selection.

    Args:
        results: The study that selects.
        effects: The result of ``main_effects.effects`` for another study.
        changes: The result of ``main_effects.changes_by_field`` for that study.

    Returns:
        A list in Markdown, an item per policy and field; empty if there is no such value.
    """
    lines = []
    for field, by_policy in changes.items():
        rows = effects[effects["field"] == field].drop_duplicates("position")
        values = dict(zip(rows["position"], rows["value"], strict=True))
        for policy, pairs in by_policy.items():
            choice = results.choice(policy) if policy in results.policies else None
            if choice is None or field not in results.store.manifest.points[choice.best].values:
                continue
            chosen = value_text(results.store.manifest.points[choice.best].values[field])
            if worse := main_effects.significantly_lower(pairs, values, chosen):
                name = parameter(field).within
                lines.append(
                    f"- **{policy}, {name}**: by the main effect, {chosen} is lower than "
                    f"{worse.other} by {numbers.points(*worse.lead)} points, and yet the "
                    f"selected setting has {chosen}. {_there(results, policy, field, worse.other)}"
                )
    return "\n".join(lines)


def _there(results: Results, policy: str, field: str, other: str) -> str:
    """What the missions of the selection say of another value at the selected setting."""
    points, choice = results.store.manifest.points, results.choice(policy)
    assert choice is not None
    best = {name: value_text(value) for name, value in points[choice.best].values.items()}
    texts = [{name: value_text(v) for name, v in point.values.items()} for point in points]
    fixed = numbers.words(
        [f"{parameter(name).within} {text}" for name, text in best.items() if name != field]
    )
    if (wanted := {**best, field: other}) not in texts:
        return f"The study of the selection has no setting with {other} and {fixed}."
    missions = results.missions[results.missions["policy"] == policy]
    wide = missions.pivot(index="replication", columns="point", values=PRODUCT)
    both = wide[[choice.best, texts.index(wanted)]].dropna().to_numpy(float)
    lead = paired(both[:, 0], both[:, 1], metric=PRODUCT)
    return (
        f"The main effect is a mean over everything else that the missions draw; with {fixed}, "
        f"{best[field]} minus {other} is {numbers.points(*lead[:3])} points (n = {lead.n:,} "
        "missions of the selection; 95 % interval of this difference alone)."
    )
