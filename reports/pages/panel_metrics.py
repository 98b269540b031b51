"""What a panel says of metrics, of prices, and of what a search can require."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from dess.analysis.metrics import AGE, PRODUCT, RATIO, SUCCESS, metric_of
from dess.analysis.study.cheapest import Cheapest, horizon_of
from dess.analysis.study.prices import Costs
from dess.analysis.wasm.entry import METRICS, PRICES
from dess.base.files.documents import Document
from dess.model.record import measures_of
from dess.scenario.scenario import ScenarioSpace

# What is paid for, in words.
_PRICED = {
    "uav": "A UAV",
    "pad": "A charging pad",
    "charge": "A full charge",
    "hour": "An hour of a mission",
    "lost_uav": "A lost UAV",
    "missions": "Missions planned for the fleet",
    "days": "Days of a year with a mission",
    "pack": "A battery pack",
    "pack_cycles": "Full charges after which a pack is worn",
}
_WHOLE = ("missions", "days")  # what is counted, 1 at least
_MOST = {"days": 365}
_MOST_AMOUNT = 10**12
# What a search can require, by the names of the command line.
_REQUIRED = {SUCCESS: "success", RATIO: "ratio", PRODUCT: "product", AGE: "age"}


class Search(Document):
    """The search of a page for the cheapest fleet, of which the grid of its panel is a part.

    Attributes:
        policy: The policy of its answer.
        fleet: The fleet of its answer, in words; empty if there is none.
        rule: The rule by which the search spends its missions, and the grid too.
    """

    policy: str
    fleet: str
    rule: Cheapest


def describe_prices(costs: Costs | None) -> Iterator[dict[str, Any]]:
    """The prices that a reader may change, in the order in which the module has them."""
    if costs is None:
        return
    names = list(PRICES[: PRICES.index("seconds")])
    if costs.years is None:
        names = names[: names.index("pack")]
    else:
        names[names.index("missions")] = "days"
    for name in names:
        value = getattr(costs, name)
        if name == "lost_uav" and value is None and not costs.pays_for_losses:
            value = 0.0
        yield {
            "name": name,
            "label": _PRICED[name],
            "value": value,
            "least": int(name in (*_WHOLE, "pack_cycles")),
            "most": _MOST.get(name, _MOST_AMOUNT),
            "isWhole": name in _WHOLE,
        }


def other_prices(costs: Costs | None) -> Iterator[str]:
    """What commands say of prices beside them."""
    if costs is not None:
        yield f"currency={costs.currency}"
        if costs.slot_seconds is not None:
            yield f"slot_seconds={costs.slot_seconds:g}"
        if costs.years is not None:
            yield f"years={costs.years:g}"
            yield f"interest={costs.interest:g}"


def describe_metrics(
    space: ScenarioSpace, costs: Costs | None, search: Search | None = None
) -> Iterator[dict[str, Any]]:
    """What the panel writes of each metric, by its column in the values of missions."""
    tolerance = Cheapest.model_fields["tolerance"].default
    if search is not None:
        tolerance = search.rule.tolerance
    offered = {*METRICS[: METRICS.index("reward")], *measures_of(space)}
    if costs is not None:
        offered.add("cost")
    for column, name in enumerate(METRICS):
        metric = metric_of(name)
        if metric.kind == "cost" and costs is not None:
            metric = replace(metric, unit=costs.unit)
        if space.units:
            metric = metric.in_units
        yield {
            "column": column,
            "key": name,
            "name": metric.name,
            "percent": metric.in_percent,
            "unit": metric.unit,
            "less": metric.less_is_better,
            "neutral": metric.is_neutral,
            "isOutcome": metric.is_outcome,
            "isOffered": name in offered and not metric.is_neutral,
            "isListed": name == PRODUCT or (name == "cost" and costs is not None),
            "option": _REQUIRED.get(name, ""),
            "tolerance": _tolerance_of(name, tolerance, space),
            "suffix": f" {metric.unit}" if name == AGE and space.units else "",
        }


def _tolerance_of(name: str, share: float, space: ScenarioSpace) -> float:
    """How far from a bound of a metric either verdict of the grid is right."""
    if name == AGE:
        return share * horizon_of(space)
    if name in _REQUIRED:
        return share
    return 0.0


def describe_requirements(
    requirements: Mapping[str, float], metrics: Sequence[Mapping[str, Any]]
) -> Iterator[tuple[str, str]]:
    """The metric and the bound of each line of requirements; there is one line at least."""
    percent = {metric["key"]: metric["percent"] for metric in metrics}
    for name, bound in requirements.items():
        yield name, f"{100 * bound if percent[name] else bound:.10g}"
    if not requirements:
        yield "", ""
