"""Single scenarios, and spaces of them: the ranges from which missions draw parameters."""

from math import inf
from typing import Any, Self

from pydantic import BaseModel, Field, ValidationError, field_validator, model_validator

from dess.errors import InputError, one_of, validation_line
from dess.scenario.constants import Constants, is_number
from dess.scenario.fields import fields_of, merged
from dess.scenario.limits import MOST_DATA, SAMPLED, check_constants, check_sampled, sampled_limits
from dess.sections.section import Integer, tuples


class Scenario(Constants):
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

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        check_constants(self)
        check_sampled({name: (getattr(self, name),) * 2 for name in SAMPLED}, self.zone_cells)
        return self

    @classmethod
    def of(cls, **values: Any) -> Self:
        """A scenario with the given values, and the paper's values for all other fields.

        Raises:
            InputError: For unknown keys, wrong types and values out of range.
        """
        return validated(cls, merged({}, values), "scenario")


IntegerRange = tuple[Integer, Integer]


class ScenarioSpace(Constants):
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

    @field_validator(*SAMPLED, mode="before")
    @classmethod
    def _integer_to_range(cls, value: Any) -> Any:
        is_integer = isinstance(value, int) and not isinstance(value, bool)
        return (value, value) if is_integer else tuples(value)

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        check_constants(self)
        check_sampled({name: getattr(self, name) for name in SAMPLED}, self.zone_cells)
        return self

    @classmethod
    def of(
        cls, scenario: "Scenario | ScenarioSpace | None" = None, **values: Any
    ) -> "ScenarioSpace":
        """A space of the given values, on top of a scenario or space (default: the paper's)."""
        base = scenario.model_dump() if scenario is not None else {}
        return validated(cls, merged(base, values), "scenario")

    @property
    def numeric(self) -> list[str]:
        """The fields that hold a number, or a range of numbers."""
        others = (*SAMPLED, "initial_data", "pads")
        names = fields_of(ScenarioSpace)
        return [name for name in names if name in others or is_number(self.value(name))]

    def limits(self, field: str) -> tuple[float, float]:
        """The least and the largest value that a numeric field may have, infinite without a limit.

        Constraints between fields, such as ``charge_start < charge_complete``, are not included.

        Raises:
            InputError: If the field does not exist, or holds no numbers.
        """
        bounded: dict[str, tuple[float, float]] = {
            "pads": (1, self.zone_cells),
            "initial_data": (0, MOST_DATA),
            **{
                name: (low, high)
                for name, (low, high, _) in sampled_limits(self.zone_cells).items()
            },
        }
        if field not in self.numeric:
            raise InputError(f"field: {field!r} is not a number{one_of(field, self.numeric)}")
        if field in bounded:
            return bounded[field]
        metadata = fields_of(ScenarioSpace)[field].metadata
        least = [getattr(m, kind) for m in metadata for kind in ("ge", "gt") if hasattr(m, kind)]
        most = [getattr(m, kind) for m in metadata for kind in ("le", "lt") if hasattr(m, kind)]
        return max(least, default=-inf), min(most, default=inf)

    def scenario_at(self, **parameters: int) -> Scenario:
        """The scenario with the given value for each sampled parameter."""
        return Scenario.of(**(self.model_dump() | parameters))


def validated(model: type[BaseModel], values: dict[str, Any], where: str) -> Any:
    """The model of these values.

    Raises:
        InputError: If they are not valid; ``where`` is their name or path.
    """
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise InputError(validation_line(error, where, model)) from None
