"""What a study says, in tidy tables: means, what was selected, and the worst missions."""

import json
from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from analysis.names import METRICS, PRODUCT
from analysis.questions.sensitivity import sensitivity
from analysis.results.tables import Results, parts_of
from analysis.stats.correction import for_choice
from analysis.stats.distribution import distribution
from analysis.stats.intervals import summary
from analysis.stats.learners import compare_learners
from analysis.stats.paired import compare
from analysis.study.design import Saltelli
from analysis.study.stopping import Precision


def means(results: Results) -> pd.DataFrame:
    """Means with intervals of every policy at every design point.

    Returns:
        A row per policy, design point and metric, as ``analysis.summary`` has it.
    """
    return summary(results.missions, by=["policy", "point"])


def ranked_policies(missions: pd.DataFrame, among: Iterable[str] | None = None) -> list[str]:
    """Policies by their mean collection ratio and communication, the best one first.

    Every design point has the same weight. Of policies alike the first to appear is the better.

    Args:
        missions: A row per mission.
        among: The policies to rank; all, if not given.
    """
    if among is not None:
        missions = missions[missions["policy"].isin([*among])]
    at_points = missions.groupby(["policy", "point"], sort=False)[PRODUCT].mean()
    means = at_points.groupby("policy", sort=False).mean()
    return [str(policy) for policy in means.sort_values(ascending=False, kind="stable").index]


def best_policy(missions: pd.DataFrame, among: Iterable[str] | None = None) -> str:
    """The policy with the highest mean collection ratio and communication."""
    return ranked_policies(missions, among)[0]


def settings(results: Results) -> list[str]:
    """Every design point in words: the fields that the design sets, with their values."""
    points = results.store.manifest.points
    return [", ".join(f"{key} {_plain(v)}" for key, v in point.values.items()) for point in points]


def worst(results: Results, policy: str, missions: int = 5) -> pd.DataFrame:
    """The missions of a policy with the lowest collection ratio and communication.

    Returns:
        A row per mission, the worst first, of those alike first those that collected the smaller
        part: ``policy``, ``point``, ``replication``, the metrics, and ``command``, which simulates
        it again.
    """
    metrics = ["success", "collection_ratio", PRODUCT, "reward"]
    ours = results.missions[results.missions["policy"] == policy]
    ordered = ours.sort_values([PRODUCT, "collection_ratio"], kind="stable").head(missions)
    commands = [results.replay(policy, p, r) for p, r in _mission_of(ordered)]
    table = ordered[["policy", "point", "replication", *metrics]].assign(command=commands)
    return table.reset_index(drop=True)


def comparisons(results: Results) -> pd.DataFrame:
    """Every policy against the best one on the same missions, over all design points.

    Returns:
        A row per policy and metric, as ``stats.paired.compare`` has it, ``p_adjusted`` also
        for the choice of the best; empty if there is one policy, or a rule gave each its own
        missions.
    """
    if len(results.policies) < 2 or not _same_missions(results):
        return pd.DataFrame()
    table = compare(results.missions, best_policy(results.missions), [*METRICS])
    return for_choice(table, len(results.policies))


def learners(results: Results) -> dict[str, list[str]]:
    """The trained policies by learner: those of one learner differ in the seed of their training.

    Returns:
        Name of the learner -> its policies, in the order of the study.
    """
    found: dict[str, list[str]] = {}
    for team in results.store.manifest.policies:
        if len(team.members) == 1 and (learner := team.members[0].learner):
            found.setdefault(learner, []).append(team.policy)
    names = [learner.rpartition(" ")[0] for learner in found]  # without the hash, if they differ
    return dict(zip(names, found.values(), strict=True)) if len({*names}) == len(names) else found


def learned_against_heuristic(results: Results) -> pd.DataFrame:
    """Every learner against the best policy that has not learned, on the same missions.

    Returns:
        A row per learner and metric, as ``stats.paired.compare_learners`` has it: about the
        learner where there are several trainings of it, else about this one checkpoint;
        ``p_adjusted`` also for the choice of the best. Empty if there is nothing to compare, or a
        rule gave each policy its own missions.
    """
    trained = learners(results)
    learned = {policy for policies in trained.values() for policy in policies}
    others = results.missions[~results.missions["policy"].isin(learned)]
    if not trained or others.empty or not _same_missions(results):
        return pd.DataFrame()
    table = compare_learners(results.missions, trained, best_policy(others), [*METRICS])
    return for_choice(table, others["policy"].nunique())


def _same_missions(results: Results) -> bool:
    counts = results.store.manifest.missions
    return len({n for of_team in counts for n in of_team}) == 1


def distributions(results: Results) -> pd.DataFrame:
    """How collection ratio and communication spreads over the missions of every policy.

    Returns:
        A row per policy and view, as ``stats.intervals.distribution`` has it; empty if there
        are several design points, whose missions are not alike.
    """
    if len(results.store.manifest.points) > 1:
        return pd.DataFrame()
    generator = np.random.default_rng(results.store.manifest.seed)
    return distribution(results.missions, PRODUCT, generator)


def precisions(results: Results) -> pd.DataFrame:
    """How narrow the intervals became that the study asked for.

    Returns:
        A row per policy, design point and metric: ``policy``, and the fields of
        ``analysis.study.stopping.Reached``. Empty if the study asked for none.
    """
    data, manifest = results.manifest["study"]["precision"], results.store.manifest
    if data is None:
        return pd.DataFrame()
    rule = Precision.model_validate_json(json.dumps(data))
    tables = []
    for team, policy in enumerate(results.policies):
        parts = parts_of(manifest.cells[team], manifest.missions[team])
        table = pd.DataFrame(rule.reached(results.store.samples(parts)))
        table.insert(0, "policy", policy)
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def sensitivities(results: Results) -> pd.DataFrame:
    """How much each metric of each policy depends on each parameter, and on the noise.

    Returns:
        A row per policy, metric and parameter: ``policy``, and as ``questions.sensitivity`` has it.
        Empty if the design is not made for it.
    """
    design = results.manifest["study"]["design"]
    if not design or design["kind"] != "saltelli":
        return pd.DataFrame()
    saltelli = Saltelli.model_validate_json(json.dumps(design))
    tables = []
    for policy in results.policies:
        table = sensitivity(saltelli, results.missions.query("policy == @policy"), [*METRICS])
        table.insert(0, "policy", policy)
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def selections(results: Results) -> pd.DataFrame:
    """What was selected for every policy, and what is known of it.

    Returns:
        A row per policy: ``policy``, ``point``, ``setting`` in words, ``missions`` that it took,
        ``left`` (points not ruled out), ``guaranteed``, ``guarantee`` in words. Empty if the study
        selects nothing.
    """
    rows = []
    for policy in results.policies:
        if choice := results.choice(policy):
            setting = settings(results)[choice.best]
            told = (choice.missions, len(choice.survivors), choice.guaranteed, choice.guarantee)
            rows.append((policy, choice.best, setting, *told))
    columns = ["policy", "point", "setting", "missions", "left", "guaranteed", "guarantee"]
    return pd.DataFrame(rows, columns=columns)


def checks(results: Results) -> pd.DataFrame:
    """Means with intervals of what was selected, over missions that did not select it."""
    return summary(results.checks, by=["policy", "point"])


def _mission_of(missions: pd.DataFrame) -> Sequence[tuple[int, int]]:
    return [*zip(missions["point"], missions["replication"], strict=True)]


def _plain(value: object) -> str:
    if isinstance(value, list | tuple):
        return "..".join(map(_plain, value))
    return f"{value:g}" if isinstance(value, float) else str(value)
