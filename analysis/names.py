"""How metrics and parameters are called, in code and on pages: the one home of these names."""

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
# The same in a terminal, where space is short.
SHORT_METRICS = {SUCCESS: "success", RATIO: "collection ratio", PRODUCT: "product"}

# All metrics of a mission: shares of missions, and means over missions.
SHARES = (SUCCESS,)
MEANS = (RATIO, PRODUCT, REWARD)
COST = "cost"  # of a study with prices
LESS_IS_BETTER = (COST,)


class Parameter(NamedTuple):
    """How pages call a parameter of a scenario."""

    name: str
    short: str
    unit: str = ""

    @property
    def within(self) -> str:
        """The name inside a sentence."""
        return self.name[0].lower() + self.name[1:]

    @property
    def plain(self) -> str:
        """The name without the symbol of the model, for where no index can be written."""
        return re.sub(r" C_[SC]$", "", self.name)

    @property
    def label(self) -> str:
        """The name in a figure, with its unit, and indices as TeX has them."""
        return _tex(f"{self.name} [{self.unit}]".removesuffix(" []"))

    @property
    def tick(self) -> str:
        """The short name in a figure."""
        return _tex(self.short)


# The parameters of the paper (its Fig. 5), which every mission has values of.
PARAMETERS = {
    "uavs": Parameter("Number of UAVs", "UAVs"),
    "charge_start": Parameter("Charging start capacity C_S", "C_S", "%"),
    "charge_complete": Parameter("Charging complete capacity C_C", "C_C", "%"),
    "initial_data": Parameter("Initial data per node", "Initial data", "data units"),
    "flying_time": Parameter("Flying time", "Flying time", "mission slots"),
}
# Others that studies vary.
_OTHERS = {
    "pads": Parameter("Number of charging pads", "Pads"),
    "zone": Parameter("Start and charging zone", "Zone"),
    "nodes": Parameter("Sensor nodes", "Nodes"),
    "quota": Parameter("Communication quota", "Quota", "communication slots"),
    "arrival_rate": Parameter("Arrival rate", "Arrivals", "data units per node and slot"),
}


# The fields that an operator decides on. All others are conditions, which a fleet has to meet.
DECISIONS = (
    *("uavs", "pads", "zone", "forbid_swaps", "altitude"),
    *("flying_time", "charge_start", "charge_complete", "charge_rate"),
)


def parameter(field: str) -> Parameter:
    """How a field of a scenario is called; by the name of the field, if it has no other."""
    return (PARAMETERS | _OTHERS).get(field, Parameter(field, field))


def metric_name(metric: str) -> str:
    """What a metric is called on pages."""
    return METRICS.get(metric, metric.replace("_", " ").capitalize())


def value_text(value: object) -> str:
    """A value of a parameter: ``12.5``, ``5–7.5`` of a range, ``yes``; text as it is."""
    if isinstance(value, list | tuple):
        return "–".join(map(value_text, value))
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    return value if isinstance(value, str) else f"{value:g}"


def _tex(text: str) -> str:
    return re.sub(r"\bC_[SC]\b", r"$\g<0>$", text)
