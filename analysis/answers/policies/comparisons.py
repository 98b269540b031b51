"""The policies of a study compared on the same missions, corrected for the number of tests."""

import pandas as pd

from dess.analysis.answers.policies.ranks import best_policy, rank_learned_and_others
from dess.analysis.metrics import METRICS, PRODUCT, metric_of
from dess.analysis.results.learners import trained_policies_by_learner
from dess.analysis.results.tables import Results
from dess.analysis.stats.corrections import P_VALUES, insert_adjusted
from dess.analysis.stats.differences import compare
from dess.analysis.stats.learners import compare_learners
from dess.analysis.tables import (
    INTERVALS,
    MARKED,
    Table,
    allowance_sentence,
    comparison_cells,
    most_widened,
)


def count_tests(results: Results) -> int:
    """The number of comparisons that a study allows, by all of the paper's metrics.

    Compared are every two policies, and every learner of several trainings with every heuristic.
    """
    trained = trained_policies_by_learner(results)
    policies = len(results.policies)
    several = sum(len(trainings) > 1 for trainings in trained.values())
    heuristics = policies - sum(map(len, trained.values()))
    return len(METRICS) * (policies * (policies - 1) // 2 + several * heuristics)


def correct_for_all_tests(results: Results, table: pd.DataFrame) -> pd.DataFrame:
    """A table of comparisons, corrected for all comparisons that the study allows (Bonferroni).

    So it does not matter which of them were chosen by these data, and a comparison has the same
    p-value in every table of the study.

    Args:
        results: The study.
        table: The comparisons, with ``p``.
    """
    count = count_tests(results)
    for name in P_VALUES:
        table = insert_adjusted(table, (table[name] * count).clip(upper=1), name)
    return table


def has_policies_to_compare(results: Results) -> bool:
    """Whether a study has several policies, with the same missions in spite of a stopping rule."""
    return len(results.policies) > 1 and _same_missions(results)


def has_learned_to_compare(results: Results) -> bool:
    """Whether a study has learned policies and others, with the same missions."""
    trained = trained_policies_by_learner(results).values()
    learned = {policy for trainings in trained for policy in trainings}
    return bool(learned) and learned < {*results.policies} and _same_missions(results)


def compare_with_best(results: Results) -> pd.DataFrame:
    """Every policy compared with the best one on the same missions, over all design points.

    Returns:
        A row per policy and metric, as ``dess.analysis.compare`` returns it,
        ``correct_for_all_tests``. Empty unless the study ``has_policies_to_compare``.
    """
    if not has_policies_to_compare(results):
        return pd.DataFrame()
    best = best_policy(results.missions)
    return correct_for_all_tests(
        results, compare(results.missions, best, [*METRICS], correction=None)
    )


def comparison_table(results: Results) -> Table:
    """The ``compare_with_best``."""
    data = compare_with_best(results)
    caption = f"Differences from {data['baseline'].iloc[0]}"
    return _difference_table(results, data, "policy", caption)


def compare_learned_with_heuristic(results: Results) -> pd.DataFrame:
    """Every learner compared with the best policy that is not learned, on the same missions.

    Returns:
        A row per learner and metric, as ``dess.analysis.compare_learners`` returns it: about the
        learner if it has several trainings, otherwise about this one checkpoint,
        ``correct_for_all_tests``. Empty unless the study ``has_learned_to_compare``.
    """
    if not has_learned_to_compare(results):
        return pd.DataFrame()
    trained = trained_policies_by_learner(results)
    _, heuristics = rank_learned_and_others(results)
    table = compare_learners(results.missions, trained, heuristics[0], [*METRICS], correction=None)
    return correct_for_all_tests(results, table)


def learner_table(results: Results) -> Table:
    """What ``compare_learned_with_heuristic`` finds."""
    data = compare_learned_with_heuristic(results)
    caption = f"Learned policies: differences from {data['baseline'].iloc[0]}, the best heuristic"
    return _difference_table(results, data, "learner", caption)


def _difference_table(results: Results, rows: pd.DataFrame, of: str, caption: str) -> Table:
    caption = (
        f"{caption} [percentage points], with {INTERVALS}, each by itself; {MARKED}, by p. "
        f"{correction_in_words(results)}"
    )
    return Table(comparison_cells(rows, of), caption, rows)


def all_comparison_tables(
    results: Results, pair: pd.DataFrame, pairing: str, missions: int
) -> list[Table]:
    """The differences of a pair, of learners and of all policies, as far as the study has them.

    Args:
        results: The study.
        pair: Rows of ``pairs.compare_pair``.
        pairing: What is compared in them.
        missions: The number of missions of a policy.
    """
    found = {
        pairing: pair,
        "every learner and the best heuristic": compare_learned_with_heuristic(results),
        "every policy and the best one": compare_with_best(results),
    }
    return [
        Table(
            comparison_cells(rows, rows.columns[0]),
            f"Points ahead of {rows['baseline'].iloc[0]} in n = {missions:,} missions; "
            f"{what}. {MARKED}, by p",
            rows,
        )
        for what, rows in found.items()
        if len(rows)
    ]


def allowance_for_difference(rows: pd.DataFrame, of: str, metric: str = PRODUCT) -> str:
    """Why the intervals of differences are wider than the missions alone would make them.

    Args:
        rows: Rows of ``dess.analysis.compare``.
        of: The column that tells what is compared.
        metric: The metric of the example.

    Returns:
        Sentences with the example that becomes wider by most; empty if none becomes much wider.
    """
    rows = rows[(rows["metric"] == metric) & rows["student"].notna()]
    row = most_widened(rows)
    if row is None:
        return ""
    unit = metric_of(metric)
    if unit.in_percent:
        scale, words = (100, " points")
    else:
        scale, words = (1, f" {unit.unit}".rstrip())
    plain, wide = (f"±{scale * row[half]:.2g}{words}" for half in ("student", "half"))
    what = f"the difference of {row[of]} in {unit.within}"
    return allowance_sentence(what, plain, wide, int(row["n"]))


def correction_in_words(results: Results) -> str:
    """For what p-values are corrected, and why a mark may differ from its interval."""
    return (
        f"P-values are corrected for the {count_tests(results):,} comparisons that the policies "
        "and metrics allow (Bonferroni). So ≈ may stand beside an interval without 0, which is "
        "not corrected."
    )


def _same_missions(results: Results) -> bool:
    counts = results.store.manifest.missions
    return len({n for of_team in counts for n in of_team}) == 1
