"""The sentences that answer how many pads, how old the data, and what failures cost."""

import pandas as pd

from analysis import numbers
from analysis.names import AGE, PRODUCT, RATIO, value_text
from analysis.questions import settings
from analysis.questions.operations.effects import changes
from analysis.results.tables import Results
from analysis.stats.intervals import LEVEL

# The published changes of the average age of information, from one UAV to this number, in another
# model of the same kind (Mathematics 13(21) 3564).
PUBLISHED = {2: -0.46, 10: -0.79}
RATE, REPAIR = "failures.uav_rate", "failures.uav_repair"


def enough_pads(results: Results, margin: float) -> pd.DataFrame:
    """The fewest pads that are enough for every fleet.

    A number of pads is enough if with it, and with every larger number, the product is at most
    ``margin`` below that with most pads: the lower end of the 95 % interval says so.

    Args:
        results: The study ``pads``, or another one that varies ``uavs`` and ``pads``.
        margin: The difference that does not matter, as a share.

    Returns:
        A row per policy and fleet: ``policy``, ``uavs``, ``pads`` (the fewest that are enough),
        ``mean``, ``low``, ``high``: the change of the product with one pad fewer; nan for one pad.

    Raises:
        InputError: If the study does not vary these fields.
    """
    most = max(settings.varied(results).get("pads", [0]))
    lost = changes(results, "pads", most, PRODUCT)
    rows = []
    for (policy, uavs), part in lost.groupby(["policy", "uavs"], sort=False):
        short = part[part["low"] < -margin].sort_values("pads").tail(1)
        if short.empty:
            rows.append((policy, uavs, int(part["pads"].min()), *[float("nan")] * 3))
            continue
        more = [pads for pads in (*part["pads"], most) if pads > short["pads"].iloc[0]]
        rows.append((policy, uavs, int(min(more)), *short[["mean", "low", "high"]].iloc[0]))
    return pd.DataFrame(rows, columns=["policy", "uavs", "pads", "mean", "low", "high"])


def short_of_pads(results: Results, margin: float) -> list[int]:
    """The design points with one pad, and with one pad less than is enough, for every fleet."""
    table, found = settings.points(results), enough_pads(results, margin)
    rows = found[found["policy"] == results.policies[0]]
    shown = {
        (row.uavs, max((p for p in table["pads"] if p < row.pads), default=1))
        for row in rows.itertuples()
    }
    shown |= {(uavs, table["pads"].min()) for uavs in rows["uavs"]}
    return [n for n, row in table.iterrows() if (row["uavs"], row["pads"]) in shown]


def pads(results: Results, margin: float) -> str:
    """How many pads are enough for every fleet, by the first policy of the study."""
    found = enough_pads(results, margin)
    rows = found[found["policy"] == results.policies[0]]
    fleets = [f"{row.uavs} UAVs need {row.pads}" for row in rows.itertuples()]
    lost = [
        f"{numbers.points(row.mean, row.low, row.high)} points for {row.uavs} UAVs"
        for row in rows.dropna().itertuples()
    ]
    cost = f" The next smaller number of pads changes the product by {numbers.words(lost)}."
    return (
        f"**Charging pads: {numbers.words(fleets)}** (policy `{results.policies[0]}`). With fewer, "
        f"the product may be more than {numbers.margin(margin)} below that with a pad for every "
        f"UAV.{cost if lost else ''} Intervals are {numbers.level(LEVEL)} intervals of paired "
        "differences."
    )


def age_changes(results: Results) -> pd.DataFrame:
    """The change of the average age from one UAV to more, as a share, by arrival rate.

    Returns:
        The rows of ``changes``, with the column ``published`` (nan where nothing is).
    """
    table = changes(results, "uavs", 1, AGE, relative=True)
    return table.assign(published=table["uavs"].map(PUBLISHED))


def age(results: Results) -> str:
    """How the average age falls with the fleet, at every arrival rate, by the first policy."""
    table = age_changes(results).dropna(subset=["published"])
    table = table[table["policy"] == results.policies[0]]
    parts = []
    for uavs, rows in table.groupby("uavs"):
        at_rates = [
            f"{relative(row.mean, row.low, row.high)} (arrival rate {value_text(row.arrival_rate)})"
            for row in rows.itertuples()
        ]
        parts.append(f"from 1 to {uavs} UAVs by {numbers.words(at_rates)}")
    printed = [f"{numbers.minus(f'{100 * PUBLISHED[n]:+.0f}')} %" for n in table["uavs"].unique()]
    return (
        f"**The average age of information changes {'; '.join(parts)}** (policy "
        f"`{results.policies[0]}`). Published for another model: {numbers.words(printed)}."
    )


def failures(results: Results) -> str:
    """What the lowest and the highest failure rate cost, by the first policy."""
    lost, data = (changes(results, RATE, 0.0, metric) for metric in (PRODUCT, RATIO))
    both = lost.merge(data, on=["policy", "uavs", RATE, REPAIR], suffixes=("", "_data"))
    both = both[both["policy"] == results.policies[0]]
    fleet, rate = both["uavs"].min(), both[RATE].min()
    rows = both[(both["uavs"] == fleet) & (both[RATE] == rate)]
    parts = [
        f"by {numbers.points(row['mean'], row['low'], row['high'])} points if it is "
        + (f"repaired in {row[REPAIR]:g} slots" if row[REPAIR] else "lost")
        for _, row in rows.iterrows()
    ]
    collected = rows[rows[REPAIR] == 0]
    rest = "".join(
        f" The collection ratio changes by only "
        f"{numbers.points(row['mean_data'], row['low_data'], row['high_data'])} points if UAVs are "
        "lost, since the others go on."
        for _, row in collected.iterrows()
    )
    return (
        f"**A UAV that fails in a mission slot with probability {value_text(rate)} changes the "
        f"product of {fleet} UAVs {numbers.words(parts)}** "
        f"(policy `{results.policies[0]}`).{rest}"
    )


def relative(mean: float, low: float, high: float) -> str:
    """A relative change with its interval, as ``−46.0 % [−47.1, −44.9]``."""
    middle, *ends = [numbers.minus(f"{100 * value:+.1f}") for value in (mean, low, high)]
    return f"{middle} % [{ends[0]}, {ends[1]}]"
