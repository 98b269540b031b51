"""The names of metrics and parameters, as code, figures and pages use them."""

import re
from collections.abc import Container
from typing import Any, NamedTuple

import numpy as np

from dess.errors import form_of, kind_of
from dess.record import OPERATIONS
from dess.scenario import SAMPLED, ZONE_PADS, Scenario, ScenarioSpace, fields_of

SUCCESS, RATIO = "success", "collection_ratio"
PRODUCT, REWARD = "collection_ratio_and_communication", "reward"

# The paper's metrics, in its order (Section VI-A). It calls them successful communication,
# collection ratio, and collection ratio and communication; the last is here the product of each
# mission.
METRICS = {SUCCESS: "Success", RATIO: "Collection ratio", PRODUCT: "Product"}
# Their names for the terminal.
SHORT_METRICS = {metric: name.lower() for metric, name in METRICS.items()}

# The description of the studies of sweeps, and the folder of their results folders.
SWEEP, SWEEPS = "a sweep: every combination of the values", "sweeps"

# Short names of metrics on the command line.
ALIASES = {"ratio": RATIO, "product": PRODUCT}


class Measure(NamedTuple):
    """What pages call a column of ``OPERATIONS``, which only extended scenarios measure.

    Attributes:
        name: The name.
        unit: The unit; empty for shares and counts.
        less_is_better: Whether a lower value is better.
    """

    name: str
    unit: str = ""
    less_is_better: bool = True

    @property
    def label(self) -> str:
        """The name with its unit."""
        return f"{self.name} [{self.unit}]".removesuffix(" []")


_SLOTS = "mission slots"
AGE, UTILISATION = "age", "utilisation"
MEASURES = {
    AGE: Measure("Age of information", _SLOTS),
    "peak_age": Measure("Peak age of information", _SLOTS),
    "age_p99": Measure("99th percentile of the age", _SLOTS),
    "latency": Measure("Latency", _SLOTS),
    "latency_p99": Measure("99th percentile of the latency", _SLOTS),
    "generated": Measure("Packets generated", less_is_better=False),
    "delivered": Measure("Packets delivered", less_is_better=False),
    "lost_packets": Measure("Packets lost"),
    "lost": Measure("Data lost", "data units"),
    "queue": Measure("UAVs waiting for a pad"),
    "waiting": Measure("Waiting time for a pad", _SLOTS),
    "pad_requests": Measure("Requests for a pad", less_is_better=False),
    UTILISATION: Measure("Utilisation of the pads", less_is_better=False),
    "failures": Measure("Failures of UAVs"),
    "slots_grounded": Measure("Time under repair", _SLOTS),
}

# All metrics of a mission: shares of missions, and means over missions.
SHARES = (SUCCESS,)
MEANS = (RATIO, PRODUCT, REWARD)
COST = "cost"  # of a study with prices
# Of a study with bounds: the bound, and the bound minus the product.
BOUND, GAP = "upper_bound", "optimality_gap"
BOUNDED = (RATIO, PRODUCT, UTILISATION)  # those whose values lie between 0 and 1
LESS_IS_BETTER = (COST, GAP, *(name for name, of in MEASURES.items() if of.less_is_better))


class Parameter(NamedTuple):
    """What figures and pages call a parameter of a scenario."""

    name: str
    short: str
    unit: str = ""

    @property
    def within(self) -> str:
        """The name as it is written inside a sentence."""
        return self.name[0].lower() + self.name[1:]

    @property
    def plain(self) -> str:
        """The name without the symbol C_S or C_C, for text in which no index can be written."""
        return re.sub(r" C_[SC]$", "", self.name)

    @property
    def label(self) -> str:
        """The name with its unit as a label in a figure, with indices in TeX (``parse_math``)."""
        return _tex(f"{self.name} [{self.unit}]".removesuffix(" []"))

    @property
    def tick(self) -> str:
        """The short name in a figure, with indices in TeX (``parse_math``)."""
        return _tex(self.short)


# The parameters of the paper's Fig. 5; the record of every mission has their values.
PARAMETERS = {
    "uavs": Parameter("Number of UAVs", "UAVs"),
    "charge_start": Parameter("Charging start capacity C_S", "C_S", "%"),
    "charge_complete": Parameter("Charging complete capacity C_C", "C_C", "%"),
    "initial_data": Parameter("Initial data per node", "Initial data", "data units"),
    "flying_time": Parameter("Flying time", "Flying time", "mission slots"),
}
# Other parameters that studies vary.
_OTHERS = {
    "scenario": Parameter("Sea", "Sea"),
    "pads": Parameter("Number of charging pads", "Pads"),
    "zone": Parameter("Start and charging zone", "Zone"),
    "zones": Parameter("Further charging zones", "Zones"),
    ZONE_PADS: Parameter("Pads of each further zone", "Further pads"),
    "nodes": Parameter("Sensor nodes", "Nodes"),
    "quota": Parameter("Communication quota", "Quota", "communication slots"),
    "arrival_rate": Parameter("Arrival rate", "Arrivals", "data units per node and slot"),
    "arrivals.buffer": Parameter("Buffer of a node", "Buffer", "packets"),
    "charging.order": Parameter("Order of the queue for pads", "Order"),
    "charging.power": Parameter("Power limit of all pads", "Power", "% per slot"),
    "failures.uav_rate": Parameter("Failure rate of a UAV", "Failures", "per mission slot"),
    "failures.uav_repair": Parameter("Mean time of a repair", "Repair", "mission slots"),
    "failures.pad_rate": Parameter("Failure rate of a pad", "Pad failures", "per mission slot"),
    "failures.node_rate": Parameter("Failure rate of a node", "Node failures", "per mission slot"),
    "wind.strength": Parameter("Wind", "Wind", "% battery per move"),
}


# The fields that an operator decides on. All other fields are conditions that a fleet has to meet.
DECISIONS = (
    *("uavs", "pads", "zone", "zones", ZONE_PADS, "forbid_swaps", "altitude"),
    *("flying_time", "charge_start", "charge_complete", "charge_rate"),
)


def parameter(field: str) -> Parameter:
    """The parameter that belongs to a field of a scenario; without one, named after the field."""
    return (PARAMETERS | _OTHERS).get(field, Parameter(field, field))


class Field(NamedTuple):
    """A field of a scenario, as the model declares it, and its value in a scenario.

    Attributes:
        name: The name, as in ``--set``.
        meaning: What it is, with the symbol of the paper in parentheses.
        unit: Its unit; empty for counts and for what is no number.
        allowed: The values that it may have, in words.
        default: Its value where a scenario does not set it: Section VI-A and Table II.
        value: Its value in the scenario.
    """

    name: str
    meaning: str
    unit: str
    allowed: str
    default: Any
    value: Any


def fields(space: ScenarioSpace) -> list[Field]:
    """Every field of a scenario, in the order of the model."""
    default = ScenarioSpace.of()
    return [
        Field(
            name,
            *_meaning(name),
            _allowed(space, name),
            *(_single(side.plain_value(name)) for side in (default, space)),
        )
        for name in fields_of(ScenarioSpace)
    ]


def _meaning(name: str) -> tuple[str, str]:
    """What a field is, and its unit, from its description ``meaning [unit] (symbol): form``."""
    description = fields_of(ScenarioSpace)[name].description or ""
    meaning = description.partition(": ")[0]
    unit = re.search(r" \[([^\],]+)\]", meaning)
    return (meaning.replace(unit[0], ""), unit[1]) if unit else (meaning, "")


def _allowed(space: ScenarioSpace, name: str) -> str:
    """The allowed values in words, such as ``an integer 1..16 or [low, high]``."""
    if name not in (*SAMPLED, "pads"):
        return form_of(fields_of(ScenarioSpace)[name])
    low, high = space.limits(name)
    kind = kind_of(Scenario.model_fields[name])
    return f"{kind} {low:g}..{high:g}" + (" or [low, high]" if name in SAMPLED else "")


def _single(value: Any) -> Any:
    """A range of one value as this value."""
    is_range = isinstance(value, list) and len(value) == 2
    return value[0] if is_range and value[0] == value[1] else value


def metric_name(metric: str) -> str:
    """The name of a metric on pages."""
    if metric in MEASURES:
        return MEASURES[metric].name
    return METRICS.get(metric, metric.replace("_", " ").capitalize())


def metric_label(metric: str) -> str:
    """The name of a metric with its unit, in figures."""
    return MEASURES[metric].label if metric in MEASURES else metric_name(metric)


def measured_in(missions: Container[str]) -> list[str]:
    """The metrics of extended scenarios that a table of missions, or a row of it, has."""
    return [name for name in OPERATIONS.names or () if name in missions]


def metrics_in(missions: Container[str]) -> list[str]:
    """The metrics that a table of missions has: those of the paper, then all others."""
    of_bounds = [name for name in (BOUND, GAP) if name in missions]
    return [*SHARES, *MEANS, *of_bounds, *measured_in(missions)]


def value_text(value: object) -> str:
    """A value of a parameter as text: ``12.5``, ``yes``, or ``5–7.5`` for a range."""
    if isinstance(value, dict):  # a type of UAVs
        given = {key: of_key for key, of_key in value.items() if of_key is not None}
        return " ".join(f"{key} {value_text(of_key)}" for key, of_key in given.items())
    if isinstance(value, list | tuple):
        joint = ", " if any(isinstance(item, dict) for item in value) else "–"
        return joint.join(map(value_text, value)) or "none"
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    return value if isinstance(value, str) else f"{value:g}"


def _tex(text: str) -> str:
    return re.sub(r"\bC_[SC]\b", r"$\g<0>$", text)
