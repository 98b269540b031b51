"""The optimality gap: how far policies are below the upper bound, in the same missions.

    results = load_results("results/gap")
    gap.by_fleet(results)  # a row per number of UAVs and policy
    gap.in_words(results)  # "**`planner` is at most ...**"

The bound of a mission holds for the expected product of every policy. So the mean over missions of
bound minus product estimates how far a policy is below the bound, and at most this far below the
best policy that is possible. The same missions give bound and product, so the interval is that of
paired differences.
"""

from pathlib import Path

import pandas as pd

from analysis import numbers
from analysis.names import BOUND, GAP, PRODUCT
from analysis.questions import summary
from analysis.results.files import MANIFEST
from analysis.results.tables import Results, load_results
from analysis.stats.intervals import LEVEL
from analysis.stats.intervals import summary as means_of

NOT_RUN = (
    "How far the policies are from the best possible is not known here: `dess study run gap` "
    "computes an upper bound of every mission."
)
ALL = "all"  # in place of a number of UAVs: the missions of fleets of any size
_SHOWN = {PRODUCT: "Product", BOUND: "Upper bound", GAP: "Gap [points]"}


def results_in(folder: Path) -> Results | None:
    """The results of the study in a folder; None if it has not been run."""
    return load_results(folder) if (folder / MANIFEST).exists() else None


def by_fleet(results: Results) -> pd.DataFrame:
    """The product, the upper bound and the gap of every policy, by number of UAVs and over all.

    Returns:
        A row per number of UAVs (or ``ALL``) and policy: ``uavs``, ``policy``, ``n`` missions, and
        for each of the columns ``collection_ratio_and_communication``, ``upper_bound`` and
        ``optimality_gap`` its mean, with its 95 % interval in ``NAME_low`` and ``NAME_high``. Empty
        if the study has no bounds.
    """
    if not results.bounds:
        return pd.DataFrame()
    overall = means_of(results.missions, by=["policy"]).assign(uavs=ALL)
    fleets = summary.by_fleet(results.missions).sort_values("uavs", kind="stable")
    rows = pd.concat([fleets, overall] if fleets["uavs"].nunique() > 1 else [fleets])
    keys = ["uavs", "policy", "n"]
    table = rows.drop_duplicates(keys)[keys]
    for metric in _SHOWN:
        names = {"mean": metric, "low": f"{metric}_low", "high": f"{metric}_high"}
        of_metric = rows[rows["metric"] == metric].rename(columns=names)
        table = table.merge(of_metric[[*keys, *names.values()]])
    return table.assign(**{f"{BOUND}_high": table[f"{BOUND}_high"].clip(upper=1.0)})


def listed(table: pd.DataFrame) -> pd.DataFrame:
    """The rows of ``by_fleet`` as a table of text."""
    columns = {"Policy": table["policy"], "UAVs": table["uavs"].astype(str)}
    columns["Missions"] = table["n"].map("{:,}".format)
    for metric, head in _SHOWN.items():
        write = _points if metric == GAP else numbers.interval
        columns[head] = numbers.estimates(table, metric, write)
    return pd.DataFrame(columns)


def at_most(table: pd.DataFrame) -> pd.DataFrame:
    """How far every policy is from the best possible at most, as a table of text.

    Args:
        table: Rows of ``by_fleet``.

    Returns:
        A row per policy, the closest one first, and a column per number of UAVs: the upper end of
        the interval of the gap, in points.
    """
    closest = table[table["uavs"] == table["uavs"].iloc[-1]].sort_values(GAP, kind="stable")
    columns = {"Policy": closest["policy"].to_numpy()}
    for uavs, rows in table.groupby("uavs", sort=False):
        ends = 100 * rows.set_index("policy").loc[closest["policy"], f"{GAP}_high"]
        head = "all missions" if uavs == ALL else fleet(int(str(uavs)))
        columns[head] = ends.map("{:.1f}".format).to_numpy()
    return pd.DataFrame(columns)


def in_words(results: Results, policy: str | None = None) -> str:
    """How far a policy is from the best possible at most, by number of UAVs.

    Args:
        results: A study with bounds.
        policy: The policy; by default the best of the study.
    """
    policy = policy or summary.best_policy(results.missions)
    table = by_fleet(results)
    table = table[(table["policy"] == policy) & (table["uavs"] != ALL)]
    rows = table.assign(text=numbers.estimates(table, GAP, _points))
    parts = [
        f"{100 * row[f'{GAP}_high']:.1f} points with {fleet(row['uavs'])} (mean gap {row['text']})"
        for _, row in rows.iterrows()
    ]
    return (
        f"**`{policy}` is at most {numbers.words(parts)} from the best possible.** The gap is the "
        "upper bound minus the mean product (collection ratio and communication); the first number "
        f"is the upper end of its {numbers.level(LEVEL)} interval."
    )


def fleet(uavs: int) -> str:
    """A number of UAVs as ``1 UAV`` or ``3 UAVs``."""
    return f"{uavs} UAV{'s' * (uavs != 1)}"


def _points(mean: float, low: float, high: float) -> str:
    """A gap in points, as ``4.6 [4.1, 5.1]``."""
    return numbers.points(mean, low, high).replace("+", "")
