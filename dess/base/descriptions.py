"""What the fields of a model are: the parts of their descriptions, where they are declared.

cell_size: float = Field(800.0, description=Description("side of a cell", unit="m", symbol="c"))
"""

from typing import TYPE_CHECKING, Any, Self

if TYPE_CHECKING:  # messages need this module long before anything needs pydantic
    from pydantic.fields import FieldInfo


class Description(str):
    """The description of a field, made of its parts; messages and schemas print it as any text.

    Attributes:
        meaning: What the field is.
        unit: Its unit; empty for counts and for what is no number.
        symbol: Its symbol in the paper.
        note: What else is to be known, such as what a value of 0 says.
        form: What its value may be where its type does not say so, or what its values mean.
    """

    meaning: str
    unit: str
    symbol: str
    note: str
    form: str

    def __new__(
        cls, meaning: str, unit: str = "", symbol: str = "", note: str = "", form: str = ""
    ) -> Self:
        """The text ``meaning [unit] (symbol); note: form`` without the parts that are empty."""
        text = meaning
        if unit:
            text += f" [{unit}]"
        if symbol:
            text += f" ({symbol})"
        if note:
            text += f"; {note}"
        if form:
            text += f": {form}"
        description = super().__new__(cls, text)
        vars(description).update(meaning=meaning, unit=unit, symbol=symbol, note=note, form=form)
        return description

    def __getnewargs__(self) -> Any:
        """The parts, for copies."""
        return self.meaning, self.unit, self.symbol, self.note, self.form

    @property
    def brief(self) -> str:
        """What the field is with unit and symbol, without what else is to be known."""
        return str(type(self)(self.meaning, self.unit, self.symbol))

    @property
    def without_unit(self) -> str:
        """All but the form and the unit, where the unit is told apart."""
        return str(type(self)(self.meaning, "", self.symbol, self.note))


def description_of(field: "FieldInfo") -> Description:
    """The description of a field; one that is plain text is its meaning, and has no other parts."""
    if isinstance(field.description, Description):
        return field.description
    return Description(field.description or "")
