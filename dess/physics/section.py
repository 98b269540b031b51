"""The base of all sections, and the types of their fields."""

from collections.abc import Callable
from functools import cache
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from dess.base.errors import InputError
from dess.base.kernels import inlined

# A strict integer: 2.0, true and "2" are refused.
Integer = Annotated[int, Field(strict=True)]
# A finite number, integer or not. All numbers of a scenario are made of it: -0.0 becomes 0.0, since
# compiled code divides by some of them and would then count time backwards.
Number = Annotated[float, Field(allow_inf_nan=False), AfterValidator(lambda value: value + 0.0)]
# A probability that something happens in a mission slot.
Probability = Annotated[Number, Field(ge=0, le=1)]


def _at_least_a_slot(mean: float) -> float:
    if 0 < mean < 1:
        raise InputError("", f"{mean} is less than a slot", "0, or 1 and more")
    return mean


# A mean duration; 0 has a meaning of its own, which the description tells.
Slots = Annotated[Number, Field(ge=0, le=1_000_000), AfterValidator(_at_least_a_slot)]


def plain(value: Any) -> Any:
    """What numpy or pandas holds as numbers and lists of Python: ``np.int64(3)`` as 3."""
    try:
        return value.tolist()
    except AttributeError:  # also of a quantity of pint, which has the method only for arrays
        return value


_SIMPLE = {bool, int, float, str, type(None)}


def tuples(value: Any) -> Any:
    """Convert the lists that TOML gives to tuples, nested ones and those of tables included."""
    if type(value) in _SIMPLE:  # nearly all, of a sea with many no-fly cells
        return value
    value = plain(value)
    if isinstance(value, dict):
        return {key: tuples(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return tuple(tuples(item) for item in value)
    return value


class Strict(BaseModel):
    """Frozen and validated data, whose numbers and words are not converted."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    @model_validator(mode="before")
    @classmethod
    def _lists_to_tuples(cls, values: Any) -> Any:
        return tuples(values)


class Section(Strict):
    """A section of a scenario; off if all fields have their defaults."""

    @property
    def is_on(self) -> bool:
        """Whether a field differs from its default."""
        return vars(self) != self._defaults()

    @classmethod
    @cache
    def _defaults(cls) -> dict[str, Any]:
        return {name: field.default for name, field in cls.model_fields.items()}

    @classmethod
    def off(cls) -> Self:
        """The section with all fields at their defaults."""
        return cls.model_validate({})


def for_sections(function: Callable) -> Any:
    """Compile a function like ``inlined`` for missions with sections; in others it does nothing.

    The first argument is the record of a mission. Of ``PLAIN_MISSION`` the compiler knows that no
    section is on: the function is not compiled, and returns 0.
    """

    def choose(mission: Any, *_: Any) -> Callable:
        if "is_plain" in mission.fields:
            return _nothing
        return function

    return inlined(function, choose)


def _nothing(_mission: Any, *_: Any) -> int:
    return 0
