"""Experimental designs: the points of the parameter space that a study simulates.

A design is the table ``[design]`` of a study's TOML file. There are six kinds: ``grid``,
``one-at-a-time``, ``table``, ``seas``, ``latin-hypercube`` and ``saltelli``. The design points are
a pure function of the fields of the design, in the order in which these are written.
"""

import sys
from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import prod
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from dess import InputError
from dess.analysis.study.stopping import StrictTable, of_its_kind
from dess.base.errors import shown
from dess.physics.section import Integer, tuples
from dess.physics.streams import MAX_REPLICATION, MAX_SEED
from dess.scenario.families import seas_of
from dess.scenario.fields import fields_of
from dess.scenario.scenario import SEA, Scenario
from dess.scenario.values import dotted

# The factor of a Saltelli design that is not a field of the scenario: the replication.
NOISE = "replication (noise)"

MAX_SIZE = 100_000  # design points; each takes some 12 kB of memory during a run

# Fields whose values are integers. A name that is not a field is refused when the study is loaded.
INTEGERS = {
    name for name, field in fields_of(Scenario).items() if field.annotation in (int, Integer | None)
}


@dataclass(frozen=True)
class DesignPoint:
    """A design point: values of fields of the scenario, and the first of its replications."""

    values: dict[str, Any]
    replication: int = 0


def by_field(value: Any) -> Any:
    """The values of a design by field: tables of sections become fields, lists tuples."""
    if isinstance(value, dict):
        return tuples(dotted(value))
    return value


def _rows_by_field(value: Any) -> Any:
    if isinstance(value, list | tuple):
        return tuple(map(by_field, value))
    return value


def _have_values(fields: dict[str, tuple[Any, ...]]) -> dict[str, tuple[Any, ...]]:
    for field, values in fields.items():
        if not values:
            raise InputError("", f"{field} has no values", "one or more")
    return fields


def _are_ranges(ranges: dict[str, Any]) -> dict[str, Any]:
    for field, ends in ranges.items():
        if not _is_range(field, ends):
            if field in INTEGERS:
                numbers = "integers"
            else:
                numbers = "numbers"
            printed = shown(list(ends) if isinstance(ends, tuple) else ends)
            raise InputError(
                field, f"{printed} is not a range", f"[low, high], {numbers} with low <= high"
            )
    return ranges


def _is_range(field: str, ends: Any) -> bool:
    kinds: tuple[type, ...] = (int, float)
    if field in INTEGERS:
        kinds = (int,)
    return (
        isinstance(ends, tuple)
        and len(ends) == 2
        # Booleans, nan and inf cannot be the ends of a range.
        and all(type(end) in kinds and abs(end) <= sys.float_info.max for end in ends)
        and ends[0] <= ends[1]
    )


def _is_power_of_two(number: int) -> int:
    if number & (number - 1):
        raise InputError("", f"{number} is not a power of two", "1, 2, 4, 8, ...")
    return number


Values = Annotated[
    dict[str, tuple[Any, ...]], BeforeValidator(by_field), AfterValidator(_have_values)
]
Rows = Annotated[tuple[dict[str, Any], ...], BeforeValidator(_rows_by_field)]
Ranges = Annotated[dict[str, Any], BeforeValidator(by_field), AfterValidator(_are_ranges)]
PowerOfTwo = Annotated[Integer, AfterValidator(_is_power_of_two)]


class _Design(StrictTable):
    @property
    @abstractmethod
    def count(self) -> int:
        """Number of design points, known without making them."""

    @cached_property
    def points(self) -> tuple[DesignPoint, ...]:
        """The design points, in order.

        Raises:
            InputError: If there are more than ``MAX_SIZE``; none of them is made.
        """
        if self.count > MAX_SIZE:
            raise InputError("design", f"{self.count:,} points", f"{MAX_SIZE:,} at most")
        return tuple(self._points())

    @abstractmethod
    def _points(self) -> Iterator[DesignPoint]: ...


class GridDesign(_Design):
    """Every combination of the values, the last field varying fastest."""

    kind: Literal["grid"] = "grid"
    values: Values = Field(
        {}, description="field -> values; without any, the one point is the scenario as it is"
    )

    @property
    def count(self) -> int:
        """The product of the numbers of values."""
        return prod(map(len, self.values.values()))

    def _points(self) -> Iterator[DesignPoint]:
        for row in product(*self.values.values()):
            yield DesignPoint(dict(zip(self.values, row, strict=True)))


class OneAtATime(_Design):
    """Each point fixes one field; the other fields keep the values or ranges of the scenario.

    So the mean at a point averages over the other sampled parameters, as in the paper's Fig. 5.
    """

    kind: Literal["one-at-a-time"] = "one-at-a-time"
    values: Values = Field(min_length=1, description="field -> values")

    @property
    def count(self) -> int:
        """The sum of the numbers of values."""
        return sum(map(len, self.values.values()))

    def _points(self) -> Iterator[DesignPoint]:
        for field, values in self.values.items():
            yield from (DesignPoint({field: value}) for value in values)


class TableDesign(_Design):
    """The points that the study lists one by one."""

    kind: Literal["table"] = "table"
    rows: Rows = Field(min_length=1, description="tables of field -> value, one per point")

    @property
    def count(self) -> int:
        """The number of rows."""
        return len(self.rows)

    def _points(self) -> Iterator[DesignPoint]:
        return map(DesignPoint, self.rows)


class Seas(_Design):
    """Generated seas: every sea of a set is a design point (``dess.scenario.families``)."""

    kind: Literal["seas"] = "seas"
    set: Literal["train", "validation", "test"] = Field("test", description="the set of seas")

    @property
    def count(self) -> int:
        """The number of seas."""
        return len(seas_of(self.set))

    def _points(self) -> Iterator[DesignPoint]:
        return (DesignPoint({SEA: name}) for name in seas_of(self.set))


class Sampled(_Design):
    """Points drawn uniformly from the ranges; integer fields take each integer equally often."""

    ranges: Ranges = Field(
        min_length=1, description="field -> [low, high], both ends included for integers"
    )
    seed: Integer = Field(0, ge=0, le=MAX_SEED, description="of the sample, not of the missions")

    @property
    @abstractmethod
    def _sample(self) -> np.ndarray:
        """(count, ...) points of the unit cube, one for each design point."""

    def _points(self) -> Iterator[DesignPoint]:
        for unit in self._sample:
            places = zip(self.ranges.items(), unit, strict=False)  # the noise is last
            values = {
                field: _scale_to_range(u, ends, field in INTEGERS) for (field, ends), u in places
            }
            yield DesignPoint(values, self._replication(unit))

    def _replication(self, unit: np.ndarray) -> int:
        """The first replication of a design point, by its point of the unit cube."""
        return 0


class LatinHypercube(Sampled):
    """A Latin hypercube: of ``size`` equal parts of each field's range, each contains one point."""

    kind: Literal["latin-hypercube"] = "latin-hypercube"
    size: Integer = Field(ge=1, le=MAX_SIZE, description="number of points")

    @property
    def count(self) -> int:
        """The field ``size``."""
        return self.size

    @cached_property
    def _sample(self) -> np.ndarray:
        from scipy.stats import qmc

        return qmc.LatinHypercube(len(self.ranges), rng=self.seed).random(self.size)


class Saltelli(Sampled):
    """The design of a global sensitivity analysis, in which the randomness is one of the factors.

    A mission is a deterministic function of its parameters and its replication. So the replication
    is one more factor, uniform over ``replications``, and stands for the noise. Each design point
    is one mission. With D factors (the fields and the replication), the points come in ``base``
    blocks of D + 2: a point of the sample A, then D points that differ from it in one factor each,
    whose value is taken from the sample B, then the point of B.
    ``dess.analysis.answers.settings.sobol.sobol_indices`` computes Sobol indices from the missions.

    Source: A. Saltelli et al., Variance based sensitivity analysis of model output, Comput. Phys.
    Commun. 181 (2010) 259-270.
    """

    kind: Literal["saltelli"] = "saltelli"
    base: PowerOfTwo = Field(
        ge=2, le=MAX_SIZE, description="size of the samples A and B, a power of two"
    )
    replications: Integer = Field(
        1_000_000,
        ge=1,
        le=MAX_REPLICATION + 1,
        description="number of replications that the noise is drawn from",
    )

    @property
    def count(self) -> int:
        """``base`` blocks of D + 2 points, for D factors."""
        return self.base * (len(self.ranges) + 3)

    @property
    def problem(self) -> dict[str, Any]:
        """The factors on the unit cube in the form that SALib takes; the noise is the last."""
        names = [*self.ranges, NOISE]
        return {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}

    @model_validator(mode="after")
    def _is_not_too_large(self) -> Self:
        if self.count > MAX_SIZE:
            most = 2 ** ((MAX_SIZE // (len(self.ranges) + 3)).bit_length() - 1)
            raise InputError(
                "base", f"{self.base:,} gives {self.count:,} design points", f"{most:,} at most"
            )
        return self

    @cached_property
    def _sample(self) -> np.ndarray:
        from SALib.sample import sobol

        return sobol.sample(self.problem, self.base, calc_second_order=False, seed=self.seed)

    def _replication(self, unit: np.ndarray) -> int:
        return _scale_to_range(unit[-1], (0, self.replications - 1), True)


def _scale_to_range(u: float, ends: tuple[Any, Any], is_integer: bool) -> Any:
    """Map a number of [0, 1] to a value of a range."""
    low, high = ends
    if is_integer:
        return min(high, low + int(u * (high - low + 1)))
    return min(float(high), float(low + u * (high - low)))


Design = Annotated[
    GridDesign | OneAtATime | TableDesign | Seas | LatinHypercube | Saltelli,
    Field(discriminator="kind"),
    of_its_kind("kind", GridDesign, OneAtATime, TableDesign, Seas, LatinHypercube, Saltelli),
]
