"""Scenarios: all constants of the model, and the ranges from which missions draw parameters.

space = load_scenario("paper", uavs=3)             # Table II, with three UAVs
space = ScenarioSpace.of(space, quota=200)         # the same with another quota
scenario = Scenario.of(uavs=2, forbid_swaps=True)  # a single scenario; Table III for the rest
"""

from collections.abc import Iterator, Mapping
from functools import cache
from math import inf
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field
from pydantic.fields import FieldInfo

from dess.constants import (
    AS_RANGE,
    EXTENSIONS,
    GEOMETRY,
    MOST_CELLS,
    MOST_DATA,
    MOST_NODES,
    MOST_SLOTS,
    MOST_UAVS,
    ZONE_PADS,
    Constants,
    Zone,
    dotted,
    is_number,
    merged,
    validated,
)
from dess.errors import InputError, one_of, shown
from dess.files.shipped import Shipped
from dess.sea.families import FAMILIES, is_generated, sea_of
from dess.sea.no_fly import no_fly_in
from dess.sea.nodes import nodes_in, projection_in
from dess.sections.section import Integer, Number, Section

__all__ = ["SAMPLED", "Scenario", "ScenarioSpace", "fields_of", "load_scenario", "scenario_names"]
__all__ += [
    "scenario_description",
    "scenario_families",
    "scenario_at",
    "SEA",
    "is_scenario_name",
    "dotted",
    "merged",
    "validated",
    "Integer",
    "Number",
]
__all__ += ["EXTENSIONS", "GEOMETRY", "MOST_CELLS", "MOST_NODES", "MOST_SLOTS", "MOST_UAVS"]
__all__ += ["ZONE_PADS"]

# The parameters that vary from mission to mission (Table II), in the order in which they are drawn.
SAMPLED = ("uavs", "flying_time", "charge_start", "charge_complete")

# What a design calls the scenario of its points, if it differs from point to point.
SEA = "scenario"

_SCENARIOS = Shipped("scenario", "dess", "scenarios")


class _Sampled(Constants):
    """The checks of the sampled parameters."""

    def _problems(self) -> Iterator[str]:
        yield from super()._problems()
        ends = {name: self._ends(name) for name in SAMPLED}
        for name, (low, high) in ends.items():
            least, most = self._limits(name)
            if not least <= low <= high <= most:
                given = low if low == high else [low, high]
                reason = f" (cells of the zone, at most {MOST_UAVS})" if name == "uavs" else ""
                yield f"{name}: {given} is out of range; allowed: {least}..{most}{reason}"
        start, complete = ends["charge_start"][1], ends["charge_complete"][0]
        if start >= complete:
            yield (
                f"charge_start: {start} is not below charge_complete {complete}; "
                "allowed: 10 <= charge_start < charge_complete <= 100 (eq. 1)"
            )

    def _ends(self, name: str) -> tuple[int, int]:
        """The least and the largest value of a sampled parameter."""
        value = getattr(self, name)
        return value if isinstance(value, tuple) else (value, value)

    @property
    def numeric(self) -> list[str]:
        """The fields that hold a number, or a range of numbers."""
        others = (*SAMPLED, "initial_data", "pads", *([ZONE_PADS] if self.zones else []))
        return [
            name for name in fields_of(type(self)) if name in others or is_number(self.value(name))
        ]

    def limits(self, field: str) -> tuple[float, float]:
        """The least and the largest value that a numeric field may have, infinite without a limit.

        Constraints between fields, such as ``charge_start < charge_complete``, are not included.

        Raises:
            InputError: If the field does not exist, or holds no numbers.
        """
        if field not in self.numeric:
            raise InputError(f"field: {field!r} is not a number{one_of(field, self.numeric)}")
        return self._limits(field)

    def _limits(self, field: str) -> tuple[float, float]:
        cells = self.zone_cells
        between = {
            "uavs": (1, min(cells, MOST_UAVS)),
            "pads": (1, cells),
            ZONE_PADS: (1, min((w * h for *_, w, h in self.rectangles[1:]), default=1)),
            "initial_data": (0, MOST_DATA),
        }
        limits = fields_of(Scenario)[field].metadata
        least = [m.ge for m in limits if hasattr(m, "ge")]
        most = [m.le for m in limits if hasattr(m, "le")]
        return between.get(field) or (max(least, default=-inf), min(most, default=inf))


class Scenario(_Sampled):
    """Every constant of one mission (Sections II and VI-A of the paper), frozen and validated.

    Raises:
        InputError: From ``Scenario.of``, for unknown keys, wrong types and values out of range.
    """

    uavs: Integer = Field(2, ge=1, description="number of UAVs (I)")
    flying_time: Integer = Field(75, ge=1, le=100, description="battery at the start [%] (b(0))")
    charge_start: Integer = Field(
        30, ge=10, le=100, description="battery at which charging may start [%] (C_S)"
    )
    charge_complete: Integer = Field(
        80, ge=10, le=100, description="battery at which charging ends [%] (C_C)"
    )


IntegerRange = Annotated[tuple[Integer, Integer], AS_RANGE]


class ScenarioSpace(_Sampled):
    """The ranges from which a mission draws its parameters (Table II), both ends included.

    A single value is a range with one element. If one range is narrowed or fixed, the draws of the
    other parameters do not change.
    """

    uavs: IntegerRange = Field((1, 3), description="number of UAVs (I): an integer or [low, high]")
    flying_time: IntegerRange = Field(
        (70, 80), description="battery at the start [%] (b(0)): an integer or [low, high]"
    )
    charge_start: IntegerRange = Field(
        (10, 50),
        description="battery at which charging may start [%] (C_S): an integer or [low, high]",
    )
    charge_complete: IntegerRange = Field(
        (60, 100), description="battery at which charging ends [%] (C_C): an integer or [low, high]"
    )

    def scenario_at(self, **parameters: int) -> Scenario:
        """The scenario with the given value for each sampled parameter."""
        return Scenario.of(self, **parameters)


@cache
def fields_of(model: type[Constants]) -> dict[str, FieldInfo]:
    """The fields of a kind of scenario; those of sections are named as ``failures.uav_rate``."""
    found: dict[str, FieldInfo] = {}
    for name, field in model.model_fields.items():
        kind = field.annotation
        if isinstance(kind, type) and issubclass(kind, Section):
            found |= {f"{name}.{part}": inner for part, inner in kind.model_fields.items()}
        else:
            found[name] = field
        if name == "zones":
            found[ZONE_PADS] = Zone.model_fields["pads"]
    return found


def load_scenario(name_or_path: str | Path = "paper", /, **overrides: Any) -> ScenarioSpace:
    """A shipped scenario by name, a generated one by family and seed, or one from a TOML file.

    Args:
        name_or_path: One of ``scenario_names()``, a sea such as ``archipelago:7``
            (``dess.sea.families``), or the path of a TOML file. In such a file, ``nodes`` may be
            the name of a file in the same folder, which ``dess.sea.nodes`` reads, and ``no_fly``
            one that ``dess.sea.no_fly`` reads.
        **overrides: Values that replace those of the file. A sampled field that is set to a single
            value is no longer sampled.

    Raises:
        InputError: If there is no such scenario, or it is not valid.
    """
    where, read = _read(name_or_path)
    read.pop("description", None)
    values = merged(read, overrides) | _from_files(name_or_path, where, read, overrides)
    return validated(ScenarioSpace, values, where)


def _from_files(
    name_or_path: str | Path, where: str, read: dict[str, Any], overrides: dict[str, Any]
) -> dict[str, Any]:
    """The nodes and no-fly cells that a scenario names files of, unless others replace them."""
    named = [key for key in ("nodes", "no_fly") if isinstance(read.get(key), str)]
    if not {*named} - overrides.keys():
        return {}
    placeless = {"nodes": [[0, 0]], "no_fly": [], "arrivals": {}}
    without = validated(ScenarioSpace, merged(read, overrides) | placeless, where)
    about = without.size, without.cell_size
    paths = {key: _SCENARIOS.beside(name_or_path, key, read[key]) for key in named}
    cells = {}
    if "nodes" in paths and "nodes" not in overrides:
        cells["nodes"] = nodes_in(paths["nodes"], *about)
    if "no_fly" in paths and "no_fly" not in overrides:
        projection = projection_in(paths["nodes"], *about) if "nodes" in paths else None
        cells["no_fly"] = no_fly_in(paths["no_fly"], without.size, projection)
    return cells


def scenario_names() -> list[str]:
    """The names of the shipped scenarios."""
    return _SCENARIOS.names()


def scenario_at(base: str | Path, values: Mapping[str, Any], /, **overrides: Any) -> ScenarioSpace:
    """The scenario of a design point: ``scenario`` among its values names another sea.

    Args:
        base: The scenario if the values name none.
        values: Fields of the scenario, and perhaps ``scenario``.
        **overrides: Fields that are set in both.

    Raises:
        InputError: If it does not exist, is a file, or is not valid.
    """
    name = values.get(SEA, base)
    if SEA in values and not (isinstance(name, str) and is_scenario_name(name)):
        known = [*scenario_names(), *scenario_families()]
        raise InputError(f"{SEA}: {shown(name)} is unknown{one_of(name, known)}")
    fields = {field: value for field, value in values.items() if field != SEA}
    return load_scenario(name, **overrides, **fields)


def scenario_families() -> dict[str, str]:
    """The families of generated seas as ``FAMILY:SEED``, each with its description."""
    return {f"{name}:SEED": f"{f.description}, e.g. {name}:7" for name, f in FAMILIES.items()}


def is_scenario_name(name: str) -> bool:
    """Whether a scenario is named by what is shipped or generated, and not by its file."""
    return name in scenario_names() or is_generated(name)


def scenario_description(name_or_path: str | Path) -> str:
    """What a scenario is about, as its file says under ``description``.

    Raises:
        InputError: If there is no such scenario.
    """
    return str(_read(name_or_path)[1].get("description", ""))


def _read(name_or_path: str | Path) -> tuple[str, dict[str, Any]]:
    """The name or path of a scenario, for messages, and its fields."""
    name = str(name_or_path)
    if is_generated(name):
        return f"scenario {name}", sea_of(name)
    return _SCENARIOS.load(name_or_path, others=scenario_families())
