"""The base of all sections, and the types of their fields."""

from typing import Annotated, Any, Self

from numba.extending import overload
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

# A strict integer: 2.0, true and "2" are refused.
Integer = Annotated[int, Field(strict=True)]
# A finite number, integer or not. All numbers of a scenario are made of it: -0.0 becomes 0.0, since
# compiled code divides by some of them and would then count time backwards.
Number = Annotated[float, Field(allow_inf_nan=False), AfterValidator(lambda value: value + 0.0)]
# A probability that something happens in a mission slot.
Probability = Annotated[Number, Field(ge=0, le=1)]
# A mean duration; 0 has a meaning of its own, which the description tells.
Slots = Annotated[Number, Field(ge=0, le=1_000_000)]


def tuples(value: Any) -> Any:
    """Convert the lists that TOML gives to tuples, nested ones and those of tables included."""
    if isinstance(value, dict):
        return {key: tuples(item) for key, item in value.items()}
    return tuple(tuples(item) for item in value) if isinstance(value, list | tuple) else value


class Section(BaseModel):
    """A section of a scenario, frozen and validated; off if all fields have their defaults."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    @model_validator(mode="before")
    @classmethod
    def _lists_to_tuples(cls, values: Any) -> Any:
        return tuples(values)

    @property
    def is_on(self) -> bool:
        """Whether a field differs from its default."""
        return self != self.off()

    def constants(self) -> dict[str, Any]:
        """The fields of ``MISSION`` that the section sets, for compiled code."""
        return {}

    @classmethod
    def off(cls) -> Self:
        """The section with all fields at their defaults."""
        return cls.model_validate({})


def is_extended(mission: Any) -> bool:
    """Whether a section of the scenario of a ``MISSION`` record is on; for compiled code.

    Of a record without this field, the compiler knows that none is: it leaves out the code of the
    sections, which would make the mission slots of all other scenarios slower.
    """
    return bool(mission["is_extended"])


@overload(is_extended, jit_options={"forceinline": True})
def _is_extended(mission):
    if "is_extended" in mission.fields:
        return lambda mission: mission.is_extended != 0
    return lambda mission: False
