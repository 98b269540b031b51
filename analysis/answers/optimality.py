"""How near policies come to the upper bound."""

from pathlib import Path

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers import summary
from dess.analysis.answers.policies import ranks
from dess.analysis.metrics import BOUND, GAP, PRODUCT
from dess.analysis.results.chunks import MANIFEST
from dess.analysis.results.tables import Results, load_results
from dess.analysis.stats.groups import summary as means_of

NOT_RUN = (
    "How far the policies are from the best possible is not known here: `dess study run gap` "
    "computes an upper bound of every mission."
)
ALL = "all"  # in place of a number of UAVs: the missions of fleets of any size
_SHOWN = {PRODUCT: "Product", BOUND: "Upper bound", GAP: "Gap [points]"}
LEAST = 5  # missions of a fleet of which something is said
_SAYS_NOTHING = 0.999  # a mean bound from which on it is not below 100 % as pages print it


def results_in(folder: Path) -> Results | None:
    """The results of the study in a folder; None if it has not been run."""
    if (folder / MANIFEST).exists():
        return load_results(folder)
    return None


def by_fleet(results: Results) -> pd.DataFrame:
    """The product, the upper bound and the gap of every policy, by number of UAVs and over all.

    Returns:
        A row per number of UAVs (or ``ALL``) and policy: ``uavs``, ``policy``, ``n`` missions, and
        for each of the columns ``collection_ratio_and_communication``, ``upper_bound`` and
        ``optimality_gap`` its mean, with its 95 % interval in ``NAME_low`` and ``NAME_high``; that
        of the product ends where that of the bound does. Empty if the study has no bounds.
    """
    if not results.bounds:
        return pd.DataFrame()
    overall = means_of(results.missions, by=["policy"]).assign(uavs=ALL)
    fleets = summary.means_by_fleet(results.missions).sort_values("uavs", kind="stable")
    rows = pd.concat([fleets, overall] if fleets["uavs"].nunique() > 1 else [fleets])
    keys = ["uavs", "policy", "n"]
    table = rows.drop_duplicates(keys)[keys]
    for metric in _SHOWN:
        names = {"mean": metric, "low": f"{metric}_low", "high": f"{metric}_high"}
        of_metric = rows[rows["metric"] == metric].rename(columns=names)
        table = table.merge(of_metric[[*keys, *names.values()]])
    # A mission may exceed its bound by chance, a mean cannot.
    highest = np.maximum(table[f"{BOUND}_high"], table[PRODUCT])
    return table.assign(**{f"{PRODUCT}_high": np.minimum(table[f"{PRODUCT}_high"], highest)})


def fleet_bound_table(table: pd.DataFrame) -> pd.DataFrame:
    """The rows of ``by_fleet`` as a table of text."""
    columns = {"Policy": table["policy"], "UAVs": table["uavs"].astype(str)}
    columns["Missions"] = table["n"].map("{:,}".format)
    for metric, head in _SHOWN.items():
        if metric == GAP:
            write = _format_gap
        else:
            write = numbers.format_interval
        columns[head] = numbers.format_estimates(table, metric, write)
    return pd.DataFrame(columns)


def fleets_with_useful_bound(table: pd.DataFrame) -> pd.DataFrame:
    """The rows of ``by_fleet`` of fleets whose bound says something.

    The bound is below 100 %, and is known of ``LEAST`` missions or more.
    """
    says = (table[BOUND] < _SAYS_NOTHING) & (table["n"] >= LEAST)
    return table[(table["uavs"] != ALL) & says]


def nearest_sentence(table: pd.DataFrame) -> str:
    """Which policy comes nearest to the bound, of the rows of ``fleets_with_useful_bound``."""
    row = table.loc[table[GAP].idxmin()]
    gap = _format_gap(*row[[GAP, f"{GAP}_low", f"{GAP}_high"]])
    fleet = numbers.format_count(row["uavs"], "UAV")
    return f"{row['policy']} comes nearest to the bound: {gap} points with {fleet}."


def in_words(results: Results, policy: str | None = None) -> str:
    """How far a policy is from the best possible at most, for fleets with a useful bound.

    Args:
        results: A study with bounds.
        policy: The policy; by default the best of the study.
    """
    policy = policy or ranks.best_policy(results.missions)
    table = by_fleet(results)
    useful = fleets_with_useful_bound(table)
    rows = useful[useful["policy"] == policy]
    parts = [
        f"{100 * row[f'{GAP}_high']:.1f} points with {numbers.format_count(row['uavs'], 'UAV')} "
        f"(mean gap {_format_gap(*row[[GAP, f'{GAP}_low', f'{GAP}_high']])}, "
        f"n = {row['n']:,} missions)"
        for _, row in rows.iterrows()
    ]
    sentences = []
    if parts:
        sentences.append(
            f"`{policy}` is at most {numbers.join_words(parts)} from the best possible."
        )
    of_policy = table[(table["policy"] == policy) & (table["uavs"] != ALL)]
    says = of_policy[BOUND] < _SAYS_NOTHING
    for row in of_policy[says & (of_policy["n"] < LEAST)].itertuples():
        fleet = numbers.format_count(row.uavs, "UAV")
        sentences.append(f"The bounds of n = {row.n} missions with {fleet} are too few to tell.")
    if not says.all():
        fleets = [numbers.format_count(int(uavs), "UAV") for uavs in of_policy.loc[~says, "uavs"]]
        sentences.append(
            f"The upper bound is 100 % for {numbers.join_words(fleets)}, "
            "so there is no useful bound."
        )
    return " ".join(sentences)


def _format_gap(mean: float, low: float, high: float) -> str:
    """A gap in points, as ``4.6 [4.1, 5.1]``."""
    return numbers.format_points(mean, low, high).replace("+", "")
