"""The words of messages: what is allowed, and what may have been meant."""

import pickle
from pathlib import Path
from typing import Annotated, Literal

import pytest
from IPython.core.interactiveshell import InteractiveShell
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from dess.base.errors import InputError, to_input_error, unknown_name, validated

MANY = [f"field_{number:02}" for number in range(20)] + ["uavs"]
FIRST = ", ".join(MANY[:18])


@pytest.mark.parametrize(
    ("name", "names", "also", "end"),
    [
        ("gredy", ["tour", "greedy"], "", " (did you mean greedy?); allowed: tour, greedy"),
        ("GREEDY", ["tour", "Greedy"], "", " (did you mean Greedy?); allowed: tour, Greedy"),
        ("other", ["tour"], "a file", "; allowed: tour, or a file"),
        ("other", [], "a file", "; allowed: a file"),
        ("other", [], "", "; allowed: none"),
        (None, ["tour"], "", "; allowed: tour"),
        ("uvs", MANY, "", " (did you mean uavs?); allowed: uavs and 20 others"),
        ("speed", MANY, "", f"; allowed: {FIRST} and 3 others"),
        ("speed", ["x" * 4000, "y"], "", f"; allowed: {'x' * 4000} and 1 others"),
    ],
)
def test_a_close_name_comes_first(name, names, also, end):
    assert str(unknown_name("plan", "who?", name, names, also)) == f"plan: who?{end}"


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (InputError("uavs", "0 is too few", "1..64"), "uavs: 0 is too few; allowed: 1..64"),
        (InputError(Path("a.csv"), "is empty"), "a.csv: is empty"),
        (InputError("", "5 m is too far", "4 m"), "5 m is too far; allowed: 4 m"),
    ],
)
def test_a_message_is_made_of_where_what_and_what_is_allowed(error, line):
    assert str(error) == line
    assert str(error.within("plan")) == f"plan: {line}"
    again = pickle.loads(pickle.dumps(error))
    assert (again.where, again.problem, again.allowed) == error.args


def test_bad_input_in_a_notebook_is_a_line(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))
    cell = "from dess import InputError; raise InputError('settings', 'uavs is 5', '6')"
    InteractiveShell().run_cell(cell)
    assert capsys.readouterr().out.strip() == "InputError: settings: uavs is 5; allowed: 6"


def refuse(number: int) -> int:
    raise InputError("at noon", f"{number} is odd", "2, 4")


class Part(BaseModel):
    model_config = ConfigDict(extra="forbid")

    price: float = Field(0.0, ge=0, description="price of a part")
    kind: Literal["small", "large"] = "small"


class Whole(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)

    name: str = Field(min_length=1, max_length=8, description="name of the whole")
    count: int | None = Field(None, ge=1, le=1000)
    ready: bool = False
    size: tuple[int, int] = Field((1, 1), description="width and height")
    part: Part | None = None
    parts: tuple[Part, ...] = Field((), strict=False, min_length=1, max_length=3)
    prices: dict[Literal["a", "b"], float] = {}


PARTS = "a list of length 1..3, each item a table of "
LINES: list[tuple[dict, str]] = [
    ({}, "name: is missing; allowed: text in quotes of length 1..8 (name of the whole)"),
    ({"part": {"price": -1}, "nam": "x"}, "nam: unknown key (did you mean name?); allowed: name, "),
    ({"count": 0}, "count: 0 is out of range; allowed: an integer 1..1,000"),
    ({"name": "x" * 9}, "name: 'xxxxxxxxx' is too long; allowed: text in quotes of length 1..8"),
    ({"prices": {"a": "b"}}, "prices.a: 'b' is not a number; allowed: a table, each value a nu"),
    ({"prices": {"c": 1}}, "prices.c: 'c' is unknown; allowed: a, b"),
    ({"parts": ()}, f"parts: () is too short; allowed: {PARTS}"),
    ({"parts": [3]}, f"parts.0: 3 is not a table; allowed: {PARTS}"),
    ({"ready": 1}, "ready: 1 is not a truth value; allowed: true or false"),
    ({"size": (1,)}, "size: (1,) is too short; allowed: [an integer, an integer] (width and heig"),
    ({"part": {"prize": 1}}, "part.prize: unknown key (did you mean price?); allowed: price, kind"),
    ({"part": {"kind": "smal"}}, "part.kind: 'smal' is unknown (did you mean small?); allowed: sm"),
    ({"parts": ({"price": 1}, {"prize": 1})}, "parts.1.prize: unknown key (did you mean price?)"),
]


@pytest.mark.parametrize(("values", "line"), LINES)
def test_an_error_is_a_line_about_the_innermost_field(values, line):
    with pytest.raises(ValidationError) as error:
        Whole.model_validate({"name": "x"} | values if values else {})
    found = str(to_input_error(error.value, "plan", Whole))
    assert found.startswith(f"plan: {line}") and "\n" not in found


class Plan(BaseModel):
    size: Annotated[int, AfterValidator(refuse)]


def test_an_error_of_a_validator_keeps_its_parts():
    with pytest.raises(InputError) as error:
        validated(Plan, {"size": 5}, "plan")
    assert error.value.args == ("plan: size: at noon", "5 is odd", "2, 4")
