"""Fly ``generalist`` and ``greedy`` on the test seas, for its model card and ``seas.csv``.

python -m benchmarks.seas

Prints what the card has of them, with 95 % intervals over seas, paired, of which each counts once,
and replaces their rows in ``seas.csv``. Those of the planners are kept.
"""

from pathlib import Path

import pandas as pd
from scipy import stats

from dess import load_scenario, simulate_batch
from dess.analysis.metrics import PRODUCT, SUCCESS
from dess.policies.registry import load
from dess.scenario.families import seas_of

SEED = 20_261_127  # of the missions
MISSIONS = 12  # of each sea
OF_FAMILY = 48  # of each sea of the family whose failures are rare
FAMILY = "clustered"
POLICIES = ("greedy", "generalist")
COLLECTION = "collection_ratio"
TABLE = Path(__file__).with_name("seas.csv")


def fly(seas: list[str], missions: int) -> pd.DataFrame:
    """A row for each sea, policy and mission."""
    rows = []
    for sea in seas:
        for policy in POLICIES:
            records = simulate_batch(load_scenario(sea), load(policy), SEED, missions).missions
            columns = {name: records[name] for name in ("uavs", SUCCESS, COLLECTION, PRODUCT)}
            rows.append(pd.DataFrame({"sea": sea, "policy": policy, **columns}))
    return pd.concat(rows, ignore_index=True)


def describe(flown: pd.DataFrame) -> str:
    """The products of both, the points between them, and their success."""
    means = flown.groupby(["sea", "policy"])[[PRODUCT, SUCCESS]].mean().unstack()
    greedy, generalist = (means[PRODUCT][policy] for policy in POLICIES)
    points = 100 * (generalist - greedy)
    half = stats.t.ppf(0.975, len(points) - 1) * points.sem()
    gained = f"{points.mean():+.1f} [{points.mean() - half:+.1f}, {points.mean() + half:+.1f}]"
    products = f"{greedy.mean():.1%} | {generalist.mean():.1%}"
    success = " | ".join(f"{means[SUCCESS][policy].mean():.1%}" for policy in POLICIES)
    return f"{products} | {gained} | {success} | lowest {points.idxmin()} {points.min():+.1f}"


def replace_rows(flown: pd.DataFrame) -> None:
    """Write the means of each sea into the table."""
    table = pd.read_csv(TABLE)
    means = flown.groupby(["sea", "policy"])[[SUCCESS, COLLECTION, PRODUCT]].mean().round(6)
    for sea, policy in means.index:
        row = (table.sea == sea) & (table.policy == policy)
        table.loc[row, ["missions", *means.columns]] = [MISSIONS, *means.loc[sea, policy]]
    table.to_csv(TABLE, index=False)


def main() -> None:
    """Print a line for each family and number of UAVs, and write the table."""
    seas = seas_of("test")
    flown = fly(seas, MISSIONS)
    for family, rows in flown.groupby(flown.sea.str.partition(":")[0], sort=False):
        print(f"| {family} | {describe(rows)}")
    for uavs, rows in flown.groupby("uavs"):
        print(f"| {uavs} UAVs | {describe(rows)}")
    print(f"| all | {describe(flown)}", flush=True)
    replace_rows(flown)
    of_family = fly([sea for sea in seas if sea.startswith(FAMILY)], OF_FAMILY)
    print(f"| {FAMILY}, {OF_FAMILY} missions each | {describe(of_family)}")


if __name__ == "__main__":
    main()
