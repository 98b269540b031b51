"""What fleets cost: their purchase, their missions, and the Pareto front of cost and a metric.

    results = load_results("results/fleets")  # of a study with a table [costs]
    price_facts(results)  # what is paid for
    cost_front(results, "success")  # cost and success, with the probability of being on the front

A setting is a policy at a design point, which is a fleet under a condition. Fleets are compared
under one condition at a time. The cheapest fleet that meets requirements is found by ``cheapest``.
"""

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers.fleet.requirements import metric_asked_for, requirements_of
from dess.analysis.answers.settings.points import (
    conditions_in_words,
    fleets_in_words,
    intervals_in_words,
)
from dess.analysis.answers.settings.ranking import rank_settings
from dess.analysis.facts import Fact, known_facts
from dess.analysis.metrics import (
    COLLECTED,
    COST,
    METRICS,
    PRODUCT,
    SUCCESS,
    Metric,
    column_in_sheet_unit,
    metric_of,
)
from dess.analysis.results.tables import Results, compute_once
from dess.analysis.stats.front import front_membership, on_front
from dess.analysis.study.prices import PURCHASE, stranded_uavs
from dess.analysis.tables import MOST_ROWS, Table
from dess.base.errors import unknown_name

CERTAIN = 0.01  # settings with a lower probability of being on a front are not in the table
# What the parts of a cost are called.
_PART_NAMES = {
    "packs": "battery packs",
    "charging": "charging",
    "hours": "hours",
    "losses": "lost UAVs",
}
_PER_GB = "cost_per_gb"  # of a year, with a data sheet
_MB_PER_GB = 1000
_MOST_PER_UNIT = 1000  # above it, the cost of a smaller unit of data is told


@compute_once
def priced_settings(results: Results) -> pd.DataFrame:
    """The settings with their costs: condition by condition, the cheapest first.

    Returns:
        A row per policy and design point: ``condition`` and ``fleet`` in words, ``policy``,
        ``point``, the varied fields, for every metric and for ``cost`` the mean and the ends of its
        95 % interval (as in ``ranking.rank_settings``), and ``n`` missions.

    Raises:
        InputError: If the study has no prices.
    """
    words = fleets_in_words(results)
    table = rank_settings(results, COST).drop(columns=["rank", "standing", "tied"])
    table = table.drop(columns="fleet", errors="ignore")  # types of UAVs, which words name
    of_points = conditions_in_words(results)
    table.insert(0, "condition", [of_points[point] for point in table["point"]])
    table.insert(1, "fleet", [words[point] for point in table["point"]])
    order = {"kind": "stable", "key": lambda texts: texts.map(of_points.index)}
    return table.sort_values("condition", ignore_index=True, **order)


def price_facts(results: Results) -> list[Fact]:
    """What is paid for, and what for nothing."""
    prices = results.prices
    amounts = prices.amounts_on(results.store.manifest.scenarios)
    paid = [f"{thing} {amount}" for thing, amount in amounts.items() if amount]
    free = [thing for thing, amount in amounts.items() if not amount]
    missions = numbers.format_count(prices.paid_missions, "mission")
    planned = ""
    if prices.years is not None:
        planned = prices.annuity_in_words
        if not results.study.years:
            planned += f"; {missions} a year"
        if prices.pack:
            planned += f"; a pack is worn after {prices.pack_cycles:g} full charges"
    elif prices.pays_for_missions:
        planned = f"the purchase and {missions}"
    return known_facts(
        [
            Fact("prices", ", ".join(paid)),
            Fact("paid for", planned),
            Fact("without a price", ", ".join(free)),
        ]
    )


@compute_once
def mean_cost_parts(results: Results) -> pd.DataFrame:
    """The mean parts of the cost of every setting.

    Returns:
        A row per policy and design point: ``policy``, ``point``, ``purchase``, ``charging``,
        ``hours``, ``losses``, and ``cost``, their sum; ``stranded``, the mean number of UAVs of a
        mission that cannot fly home, beyond those that ``losses`` pays for. Where costs are those
        of a year, also ``packs`` and, with a data sheet, ``gb``, the data collected in the year
        [GB], and ``cost_per_gb``.

    Raises:
        InputError: If the study has no prices.
    """
    prices = results.prices
    missions = results.missions
    uavs = results.uavs
    amounts = prices.parts(results.store.manifest.scenarios, missions, uavs)
    columns = [*prices.part_names, COST]
    table = missions[["policy", "point", COST]].assign(**amounts)
    collected = column_in_sheet_unit(COLLECTED, missions)
    if prices.years is not None and collected != COLLECTED:
        columns.append("gb")
        table["gb"] = prices.paid_missions * missions[collected] / _MB_PER_GB
    means = table.groupby(["policy", "point"], sort=False, as_index=False)[columns].mean()
    means = _with_cost_per_gb(means)
    is_recorded = "down" in uavs and uavs["down"].notna().all()  # results of before are not
    number = uavs[["policy", "point"]].assign(stranded=np.nan)
    if is_recorded:
        number["stranded"] = stranded_uavs(uavs)
    sums = number.groupby(["policy", "point"], sort=False)["stranded"].sum(min_count=1)
    per_setting = missions.groupby(["policy", "point"], sort=False).size()
    return means.join((sums / per_setting).rename("stranded"), on=["policy", "point"])


def _with_cost_per_gb(parts: pd.DataFrame) -> pd.DataFrame:
    """Rows of ``mean_cost_parts`` with the cost of a GB, where the data are known."""
    if "gb" not in parts:
        return parts
    return parts.assign(**{_PER_GB: parts[COST] / parts["gb"].where(parts["gb"] > 0)})


@compute_once
def yearly_parts(results: Results) -> pd.DataFrame:
    """The parts of the cost of every fleet in a year, means over the conditions.

    Args:
        results: A study whose costs are those of a year.

    Returns:
        A row per policy and fleet: ``policy``, ``fleet`` in words, ``packs``, ``charging``,
        ``hours``, ``losses`` and, with a data sheet, ``gb`` and ``cost_per_gb``.
    """
    means = mean_cost_parts(results).drop(columns=["stranded", PURCHASE])
    words = fleets_in_words(results)
    means.insert(1, "fleet", [words[point] for point in means["point"]])
    fleets = means.drop(columns="point").groupby(["policy", "fleet"], sort=False, as_index=False)
    return _with_cost_per_gb(fleets.mean()).drop(columns=COST)


@compute_once
def cost_front(results: Results, metric: str = SUCCESS) -> pd.DataFrame:
    """The Pareto front of cost and a metric: the settings that no other one dominates.

    Args:
        results: The study.
        metric: A metric of the paper, or a required one.

    Returns:
        The rows of ``priced_settings`` with two more columns. ``on_front`` tells whether the
        setting is on the front of the estimates, under its condition. ``probability`` is the
        probability that it is on the front of the true means (``stats.front.front_membership``).

    Raises:
        InputError: If the study has no prices, or there is no such metric.
    """
    columns = [*METRICS, *(requirement.column for requirement in requirements_of(results))]
    if metric not in columns:
        raise unknown_name("metric", f"{metric!r} is unknown", metric, METRICS)
    sign = 1
    if metric_of(metric).less_is_better:
        sign = -1
    generator = np.random.default_rng(results.store.manifest.seed)
    tables = []
    for _, rows in priced_settings(results).groupby("condition", sort=False):
        costs, values = (_mission_values(results, rows, name) for name in (COST, metric))
        estimates = on_front(rows[COST].to_numpy(), sign * rows[metric].to_numpy())
        share = front_membership(costs, sign * values, metric == SUCCESS, generator)
        tables.append(rows.assign(on_front=estimates, probability=share))
    return pd.concat(tables, ignore_index=True)


@compute_once
def purchase_prices(results: Results) -> list[float]:
    """The price of the UAVs and pads at every design point, the same with every policy."""
    return mean_cost_parts(results).groupby("point")[PURCHASE].mean().sort_index().tolist()


def format_amount(value: float) -> str:
    """An amount without its currency, for a cell of a table."""
    return numbers.format_amounts(value, value, value)


def cost_facts(results: Results, policy: str, fleet: Sequence[int]) -> list[Fact]:
    """The parts of the cost of a fleet, and what a unit of data costs; none if it has no parts.

    Args:
        results: The study.
        policy: The policy.
        fleet: Its design points, one for each condition.
    """
    prices = results.prices
    table = mean_cost_parts(results)
    rows = table[(table["policy"] == policy) & table["point"].isin(fleet)]

    def money(value: float) -> str:
        return numbers.format_money(value, prices.currency)

    facts = []
    if prices.pays_for_missions:
        means = rows[[*prices.part_names]].mean()
        running = [
            f"{name} {money(means[part])}"
            for part, name in _PART_NAMES.items()
            if part in prices.paid_parts
        ]
        simulated = "the flights of a year"
        if not results.study.years:
            simulated = numbers.format_count(prices.paid_missions, "mission")
        total = money(means.sum() - means[PURCHASE])
        facts.append(Fact("of it for the purchase", money(means[PURCHASE])))
        facts.append(Fact(f"of it for {simulated}", f"{total}: {', '.join(running)}"))
    facts.append(_cost_per_gb(results, rows))
    if prices.years is not None:
        price = prices.price_of_fleet(results.scenario(fleet[0]))
        facts.append(Fact("price when bought", money(price)))
    return known_facts(facts)


def _cost_per_gb(results: Results, rows: pd.DataFrame) -> Fact:
    """What a GB, MB or kB costs, where costs are those of a year.

    Args:
        results: The study.
        rows: Rows of ``mean_cost_parts`` of a fleet, one for each condition.
    """
    if "gb" not in rows or not rows["gb"].sum():
        return Fact("cost of data", "")
    per_unit = rows[COST].mean() / rows["gb"].mean()
    unit = "GB"
    for smaller in ("MB", "kB"):
        if per_unit >= _MOST_PER_UNIT:
            per_unit /= 1000
            unit = smaller
    amount = numbers.format_money(per_unit, results.prices.currency)
    return Fact("cost of data", f"{amount} per {unit} collected")


def _mission_values(results: Results, rows: pd.DataFrame, name: str) -> np.ndarray:
    """The (k, n) values of the settings of k rows; nan where a setting lacks a replication."""
    missions = results.missions[results.missions["point"].isin(rows["point"])]
    wide = missions.pivot(index="replication", columns=["policy", "point"], values=name)
    keys = pd.MultiIndex.from_frame(rows[["policy", "point"]])
    return wide.reindex(columns=keys).to_numpy(float).T


def cost_fronts(results: Results) -> dict[str, pd.DataFrame]:
    """The fronts of the required metrics, or of success and the product."""
    metrics = [requirement.column for requirement in requirements_of(results)] or [SUCCESS, PRODUCT]
    return {metric: cost_front(results, metric) for metric in metrics}


def setting_cells(rows: pd.DataFrame, metrics: Iterable[str | Metric]) -> pd.DataFrame:
    """Rows of ``priced_settings`` as text: condition, fleet, policy, cost and metrics."""
    columns = {}
    if rows["condition"].any():
        columns = {"Condition": rows["condition"]}
    columns |= {"Fleet": rows["fleet"], "Policy": rows["policy"]}
    for measure in map(metric_of, (COST, *metrics)):
        columns[measure.name] = numbers.format_estimates(rows, measure.column, measure.written)
    return pd.DataFrame(columns)


def cost_front_table(results: Results) -> Table:
    """The settings that may be on one of the fronts, with the probabilities."""
    fronts = cost_fronts(results)
    first = next(iter(fronts.values()))
    shares = pd.DataFrame({metric: front["probability"] for metric, front in fronts.items()})
    top = first[(shares >= CERTAIN).any(axis=1)].head(MOST_ROWS)
    shown = setting_cells(top, [metric_asked_for(results, metric) for metric in fronts])
    for metric in fronts:
        head = f"On the front of {metric_of(metric).within}"
        shown[head] = shares.loc[top.index, metric].map(numbers.format_percent)
    caption = (
        f"Settings that may be on a front: mean cost [{results.prices.unit}] and metrics "
        f"with {intervals_in_words(results)}, and the probability that they are on it"
    )
    data = first.drop(columns=["on_front", "probability"])
    return Table(shown, caption, data.join(shares.add_prefix("on_front_of_")))


def cost_parts_table(results: Results) -> Table:
    """The parts of the settings' costs."""
    rows = priced_settings(results).merge(
        mean_cost_parts(results).drop(columns=COST), on=["policy", "point"]
    )
    top = rows.head(MOST_ROWS)
    shown = setting_cells(top, [])
    for part in results.prices.part_names:
        shown[part.capitalize()] = top[part].map("{:,.0f}".format)
    caption = f"The mean cost of the settings [{results.prices.unit}], and its parts"
    return Table(shown, caption, rows)
