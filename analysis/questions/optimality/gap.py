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
    rows = rows[rows["metric"].isin(_SHOWN)].set_index(["uavs", "policy", "n", "metric"])
    order = rows.droplevel("metric").index.unique()
    wide = rows.unstack("metric").loc[order]
    wide.columns = [name if end == "mean" else f"{name}_{end}" for end, name in wide.columns]
    wide[f"{BOUND}_high"] = wide[f"{BOUND}_high"].clip(upper=1.0)
    return wide[[f"{m}{end}" for m in _SHOWN for end in ("", "_low", "_high")]].reset_index()


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
    ends = table.assign(text=[f"{100 * end:.1f}" for end in table[f"{GAP}_high"]])
    wide = ends.pivot(index="policy", columns="uavs", values="text")
    wide = wide[[*dict.fromkeys(table["uavs"])]]
    closest = table[table["uavs"] == table["uavs"].iloc[-1]].sort_values(GAP, kind="stable")
    wide = wide.loc[closest["policy"]].rename_axis(columns=None)
    heads = {name: "all missions" if name == ALL else fleet(name) for name in wide}
    return wide.rename(columns=heads).reset_index(names="Policy")


def in_words(results: Results, policy: str | None = None) -> str:
    """How far a policy is from the best possible at most, by number of UAVs.

    Args:
        results: A study with bounds.
        policy: The policy; by default the best of the study.
    """
    policy = policy or summary.best_policy(results.missions)
    table = by_fleet(results)
    rows = table[(table["policy"] == policy) & (table["uavs"] != ALL)]
    parts = [
        f"{100 * row[f'{GAP}_high']:.1f} points with {fleet(row['uavs'])} (mean gap "
        f"{_points(row[GAP], row[f'{GAP}_low'], row[f'{GAP}_high'])})"
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
