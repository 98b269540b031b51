"""The names of metrics and parameters, as code, figures and pages use them."""

import re
from typing import NamedTuple

import numpy as np

SUCCESS, RATIO = "success", "collection_ratio"
PRODUCT, REWARD = "collection_ratio_and_communication", "reward"

# The paper's metrics, in its order and words (Section VI-A).
METRICS = {
    SUCCESS: "Successful communication",
    RATIO: "Collection ratio",
    PRODUCT: "Collection ratio and communication",
}
# Shorter names for the terminal.
SHORT_METRICS = {SUCCESS: "success", RATIO: "collection ratio", PRODUCT: "product"}

# All metrics of a mission: shares of missions, and means over missions.
SHARES = (SUCCESS,)
MEANS = (RATIO, PRODUCT, REWARD)
BOUNDED = (RATIO, PRODUCT)  # those of the means whose values lie between 0 and 1
COST = "cost"  # of a study with prices
LESS_IS_BETTER = (COST,)


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
        """The name with its unit as a label in a figure, with indices in TeX notation."""
        return _tex(f"{self.name} [{self.unit}]".removesuffix(" []"))

    @property
    def tick(self) -> str:
        """The short name in a figure."""
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
    "pads": Parameter("Number of charging pads", "Pads"),
    "zone": Parameter("Start and charging zone", "Zone"),
    "nodes": Parameter("Sensor nodes", "Nodes"),
    "quota": Parameter("Communication quota", "Quota", "communication slots"),
    "arrival_rate": Parameter("Arrival rate", "Arrivals", "data units per node and slot"),
}


# The fields that an operator decides on. All other fields are conditions that a fleet has to meet.
DECISIONS = (
    *("uavs", "pads", "zone", "forbid_swaps", "altitude"),
    *("flying_time", "charge_start", "charge_complete", "charge_rate"),
)


def parameter(field: str) -> Parameter:
    """The parameter that belongs to a field of a scenario; without one, named after the field."""
    return (PARAMETERS | _OTHERS).get(field, Parameter(field, field))


def metric_name(metric: str) -> str:
    """The name of a metric on pages."""
    return METRICS.get(metric, metric.replace("_", " ").capitalize())


def value_text(value: object) -> str:
    """A value of a parameter as text: ``12.5``, ``yes``, or ``5–7.5`` for a range."""
    if isinstance(value, list | tuple):
        return "–".join(map(value_text, value))
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    return value if isinstance(value, str) else f"{value:g}"


def _tex(text: str) -> str:
    return re.sub(r"\bC_[SC]\b", r"$\g<0>$", text)
