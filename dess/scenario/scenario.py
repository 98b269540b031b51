"""Scenarios: all constants of the model, and the ranges from which missions draw parameters.

>>> space = load_scenario("paper", uavs=3)             # Table II, with three UAVs
>>> space = ScenarioSpace.of(space, quota=200)         # the same with another quota
>>> scenario = Scenario.of(uavs=2, forbid_swaps=True)  # a single one; Table III for the rest
"""

from collections.abc import Iterator, Mapping
from functools import cache, partial
from itertools import chain
from math import inf
from pathlib import Path
from typing import Annotated, Any, Self

import tomli_w
from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    model_serializer,
    model_validator,
)

from dess.base.descriptions import Description
from dess.base.errors import (
    InputError,
    check_type,
    form_of,
    listed,
    shown,
    unknown_name,
    validated,
)
from dess.base.files.reading import Shipped, parse_toml
from dess.physics.fleet import UavType
from dess.physics.section import Integer, Section, tuples
from dess.scenario.consistency import (
    TOLD_ERROR,
    distance_error,
    distance_sentence,
    problems,
)
from dess.scenario.data_sheet import OPEN, DataSheet
from dess.scenario.families import FAMILIES, is_generated, sea_of
from dess.scenario.fields import (
    AS_RANGE,
    GEOMETRY,
    LANDING,
    MOST_DATA,
    MOST_UAVS,
    SAMPLED,
    SECTIONS,
    ZONE_PADS,
    Fields,
    fields_of,
    is_number,
)
from dess.scenario.nodes import AMOUNTS
from dess.scenario.notes import notes_after, tell
from dess.scenario.own_sea import OwnSea, Positions, unread
from dess.scenario.values import dotted, merged
from dess.scenario.weather import REPLACED, Weather, in_weather

# What a design calls the scenario of its points, if it differs from point to point.
SEA = "scenario"

_SCENARIOS = Shipped("scenario", "dess", "scenarios")

_CRUISE = "data_sheet.cruise"

# The context of a scenario whose cells may be where they must not be.
DRAFT = "draft"


def changed(values: Mapping[str, Any], changes: Mapping[str, Any], where: str) -> dict[str, Any]:
    """The values of a scenario with changes of some of them.

    Args:
        values: The values.
        changes: What replaces some of them, as for ``merged``. Where that is the cruise of the data
            sheet, the cell stays, and the endurance is still that of the cruise before.
        where: What names the scenario in messages.

    Raises:
        InputError: If the changes do not fit, or the data sheet is not valid.
    """
    return merged(merged(dict(values), dict(changes)), _kept_at_cruise(values, changes, where))


def _kept_at_cruise(
    values: Mapping[str, Any], changes: Mapping[str, Any], where: str
) -> dict[str, Any]:
    """What a data sheet keeps where its cruise is replaced."""
    replaced = dotted(dict(changes))
    others = {field: value for field, value in replaced.items() if field != _CRUISE}
    sheet = merged(dict(values), others).get("data_sheet")
    if _CRUISE not in replaced or not (isinstance(sheet, dict) and sheet.get("cruise")):
        return {}
    of_file = validated(DataSheet, sheet, where)
    kept = {}
    if not of_file.cell:
        kept["data_sheet.cell"] = f"{of_file.units.cell!r} m"
    if "data_sheet.endurance" not in replaced and " at " not in (of_file.endurance or ""):
        kept["data_sheet.endurance"] = f"{of_file.endurance} at {of_file.cruise}"
    return kept


class Constants(Fields):
    """The common base of both kinds of scenario: their fields agree with each other."""

    @model_validator(mode="before")
    @classmethod
    def _follow_the_data_sheet(cls, values: Any) -> Any:
        """Add the fields that follow from the data sheet, which may not be given as well."""
        if not (isinstance(values, dict) and values.get("data_sheet")):
            return values
        values = {
            n: dict(given_value) if isinstance(given_value, Section) else given_value
            for n, given_value in values.items()
        }
        try:
            weather = Weather.model_validate(values.get("weather", {}))
            if weather.is_on:
                values["data_sheet"] = in_weather(values["data_sheet"], weather)
            data_sheet = DataSheet.model_validate(values["data_sheet"])
        except ValidationError:  # it is told where the field is validated
            return values
        if not data_sheet.is_on:
            return values
        following = data_sheet.fields()
        for name in sorted(following.keys() & dotted(values).keys() - {*OPEN}):
            raise InputError(name, "follows from the data sheet", "without this field")
        for name, value in following.items():
            _check_following(data_sheet, name, value)
        if "fleet" in values:
            values["fleet"] = _types_in_slots(data_sheet, values["fleet"])
        return merged(following, values)

    @model_serializer(mode="wrap")
    def _without_what_is_off(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the sections that are off: so scenarios without them are stored as before.

        What follows from a data sheet is left out as well.
        """
        optional = (*SECTIONS, *GEOMETRY, *(() if self.data_sheet.is_on else (LANDING,)))
        off = [name for name in optional if not self.has(name)]
        values = {name: value for name, value in handler(self).items() if name not in off}
        if not self.data_sheet.is_on:
            return values
        follows = {
            name
            for name, value in self.data_sheet.fields().items()
            if self.value(name) in (value, (value, value))
        }
        return merged(
            {n: remaining for n, remaining in dotted(values).items() if n not in follows}, {}
        )

    @model_validator(mode="after")
    def _is_consistent(self, info: ValidationInfo) -> Self:
        all_problems = chain(problems(self), _out_of_range(self))
        for problem in () if info.context == DRAFT else all_problems:
            raise problem
        return self

    @classmethod
    def of(cls, scenario: "AnyScenario | None" = None, **values: Any) -> Self:
        """A scenario of the given values, on top of another one (default: the paper's).

        Raises:
            InputError: For unknown names and keys, wrong types and values out of range.
        """
        base = {}
        if scenario is not None:
            base = loaded(scenario).model_dump()
        return validated(cls, changed(base, values, "scenario"), "scenario")

    def limits(self, field: str) -> tuple[float, float]:
        """The least and the largest value that a numeric field may have, infinite without a limit.

        Constraints between fields, such as ``charge_start < charge_complete``, are not included.

        Raises:
            InputError: If the field does not exist, or holds no numbers.
        """
        if field not in SAMPLED and field not in self.numeric:
            raise unknown_name("field", f"{field!r} is not a number", field, self.numeric)
        between = {
            "uavs": (1, min(self.zone_cells, MOST_UAVS)),
            "pads": (1, self.zone_cells),
            ZONE_PADS: (0, min((w * h for *_, w, h in self.rectangles[1:]), default=1)),
            "initial_data": (0, MOST_DATA),
        }
        limits = fields_of(Scenario)[field].metadata
        least = [m.ge for m in limits if hasattr(m, "ge")]
        most = [m.le for m in limits if hasattr(m, "le")]
        return between.get(field) or (max(least, default=-inf), min(most, default=inf))

    def without_weather(self) -> Self:
        """The scenario of one mission in still air, if it is one of years, or else itself."""
        if not self.weather.is_on:
            return self
        return self.model_copy(update={"weather": type(self.weather).off()})

    def to_toml(self) -> str:
        """The scenario as TOML text that ``load_scenario`` reads back to an equal one."""
        return tomli_w.dumps(self.model_dump(mode="json", exclude_none=True))


class Scenario(Constants):
    """Every constant of one mission (Sections II and VI-A of the paper), frozen and validated.

    Raises:
        InputError: From ``Scenario.of``, for unknown keys, wrong types and values out of range.
    """

    uavs: Integer = Field(2, ge=1, description=Description("number of UAVs", symbol="I"))
    flying_time: Integer = Field(
        75, ge=1, le=100, description=Description("battery at the start", unit="%", symbol="b(0)")
    )
    charge_start: Integer = Field(
        30,
        ge=10,
        le=100,
        description=Description("battery at which charging may start", unit="%", symbol="C_S"),
    )
    charge_complete: Integer = Field(
        80,
        ge=10,
        le=100,
        description=Description("battery at which charging ends", unit="%", symbol="C_C"),
    )


IntegerRange = Annotated[tuple[Integer, Integer], AS_RANGE]


class ScenarioSpace(Constants):
    """The ranges from which a mission draws its parameters (Table II), both ends included.

    A single value is a range with one element. If one range is narrowed or fixed, the draws of the
    other parameters do not change.
    """

    uavs: IntegerRange = Field(
        (1, 3),
        description=Description("number of UAVs", symbol="I", form="an integer or [low, high]"),
    )
    flying_time: IntegerRange = Field(
        (70, 80),
        description=Description(
            "battery at the start", unit="%", symbol="b(0)", form="an integer or [low, high]"
        ),
    )
    charge_start: IntegerRange = Field(
        (10, 50),
        description=Description(
            "battery at which charging may start",
            unit="%",
            symbol="C_S",
            form="an integer or [low, high]",
        ),
    )
    charge_complete: IntegerRange = Field(
        (60, 100),
        description=Description(
            "battery at which charging ends",
            unit="%",
            symbol="C_C",
            form="an integer or [low, high]",
        ),
    )

    def scenario_at(self, **parameters: int) -> Scenario:
        """The scenario with the given value for each sampled parameter."""
        return Scenario.of(self, **parameters)


def load_scenario(name_or_path: str | Path = "paper", /, **overrides: Any) -> ScenarioSpace:
    """A shipped scenario by name, a generated one by family and seed, or one from a TOML file.

    Args:
        name_or_path: One of ``scenario_names()``, a sea such as ``archipelago:7``
            (``dess.scenario.families``), or the path of a TOML file. In such a file, ``nodes`` and
            ``no_fly`` may name files in its folder, and zones may have degrees
            (``dess.scenario.own_sea``).
        **overrides: Values that replace those of the file. A sampled field that is set to a single
            value is no longer sampled.

    Raises:
        InputError: If there is no such scenario, or it is not valid.
    """
    return _load(name_or_path, overrides)


def draft_scenario(name_or_path: str | Path, /, **overrides: Any) -> ScenarioSpace:
    """The scenario that ``load_scenario`` loads or refuses for where its cells are, to be drawn."""
    return _load(name_or_path, overrides, DRAFT)


def parsed_scenario(text: str, path: Path, context: str = "") -> ScenarioSpace:
    """The scenario that ``load_scenario`` would load if a file had this text.

    Args:
        text: The text.
        path: The file, in whose folder those lie that the text names.
        context: ``DRAFT`` for one that is loaded wherever its cells are.
    """
    return _load(path, {}, context, (str(path), parse_toml(text, str(path))))


def _load(
    name_or_path: str | Path, overrides: dict[str, Any], context: str = "", found: Any = None
) -> ScenarioSpace:
    has_sheet = any(field.partition(".")[0] == "data_sheet" for field in dotted(overrides))
    where, read = found or _read(name_or_path, has_sheet)
    with notes_after():
        return _of_values(name_or_path, where, read, overrides, context)


def _of_values(
    name_or_path: str | Path, where: str, read: dict[str, Any], overrides: Any, context: str
) -> ScenarioSpace:
    """The scenario of the values that its file has, and of those that replace them."""
    read.pop("description", None)
    values = changed(_with_weather_beside(name_or_path, read), overrides, where)
    if named := unread(read) | unread(values):
        draft = validated(ScenarioSpace, values | named, where, DRAFT)
        beside = partial(_SCENARIOS.beside, name_or_path)
        own_sea = OwnSea(where, beside, draft, dotted(overrides).keys())
        read_values = {
            field: value for field, value in values.items() if field not in unread(values)
        }
        placed = own_sea.placed(values, read.get("nodes"))
        of_nodes = {field: placed.pop(field) for field in AMOUNTS if field in placed}
        values = merged(placed, read_values)
        values = merged(values, of_nodes)
    space = validated(ScenarioSpace, values, where, context)
    _tell_of_weather(where, values, space)
    if not is_scenario_name(str(name_or_path)) and distance_error(space) >= TOLD_ERROR:
        tell(f"{where}: {distance_sentence(space)}")
    return space


def _with_weather_beside(name_or_path: str | Path, read: dict[str, Any]) -> dict[str, Any]:
    """The fields of a file; that of its weather has its whole path if it lies beside it."""
    weather = read.get("weather")
    if not isinstance(weather, dict) or is_scenario_name(str(name_or_path)):
        return read
    beside = Path(name_or_path).parent / str(weather.get("file"))
    if not beside.exists() or "file" not in weather:
        return read
    return {**read, "weather": {**weather, "file": str(beside.absolute())}}


def _tell_of_weather(where: str, values: dict[str, Any], space: ScenarioSpace) -> None:
    """Tell what of a data sheet the weather of the scenario has taken the place of."""
    if not space.weather.is_on:
        return
    typed = dotted(values)
    fields = [f"data_sheet.{name}" for name in REPLACED]
    names = [name for name in fields if name in typed and typed[name] != space.value(name)]
    if names:
        tell(f"{where}: the series of weather.file takes the place of {listed(names)}")


def positions_in(name_or_path: str | Path, /, **overrides: Any) -> Positions:
    """The places of the nodes and zones of a sea that its files and tables have in degrees.

    Args:
        name_or_path: The scenario, as for ``load_scenario``.
        **overrides: Values that replace those of its file, as for ``load_scenario``.

    Raises:
        InputError: If there is no such scenario, or it is not valid.
    """
    space = load_scenario(name_or_path, **overrides)
    where, read = _read(name_or_path)
    values = merged(read, overrides)
    own_sea = OwnSea(where, partial(_SCENARIOS.beside, name_or_path), space)
    return own_sea.positions(values, read.get("nodes"))


# What a function takes for a scenario: one, or what ``load_scenario`` takes.
AnyScenario = Constants | str | Path
_NAMED = "a name such as paper, or the path of a TOML file"


def loaded(scenario: AnyScenario) -> Constants:
    """A scenario, or the one that has this name or path.

    Raises:
        InputError: If there is no such scenario, or this is neither a scenario nor a name.
    """
    check_type("scenario", scenario, AnyScenario, f"{_NAMED}, Scenario or ScenarioSpace")
    if isinstance(scenario, str | Path):
        return load_scenario(scenario)
    return scenario


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
        seas = [*scenario_names(), *scenario_families()]
        raise unknown_name(SEA, f"{shown(name)} is unknown", name, seas)
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


def _read(name_or_path: str | Path, has_sheet: bool = False) -> tuple[str, dict[str, Any]]:
    """The name or path of a scenario, for messages, and its fields.

    Args:
        name_or_path: The scenario.
        has_sheet: Whether it gets a data sheet, which a generated sea does not have.
    """
    check_type("scenario", name_or_path, str | Path, _NAMED)
    name = str(name_or_path)
    if is_generated(name):
        return f"scenario {name}", sea_of(name, has_sheet)
    return _SCENARIOS.load(name_or_path, others=scenario_families())


def _types_in_slots(sheet: DataSheet, types: Any) -> Any:
    """The types of UAVs with what follows from their fields in units.

    What is no table of fields of a type is left as it is; it is refused where it is validated.
    """
    types = tuples(types)
    if not isinstance(types, tuple):
        return types
    following = []
    for number, kind in enumerate(types):
        table = kind
        if isinstance(kind, UavType):
            table = kind.model_dump()
        if isinstance(table, dict):
            try:
                table = table | sheet.type_in_slots(table)
            except InputError as error:
                where = f"fleet.{number}.{error.where}"
                raise InputError(where, error.problem, error.allowed) from None
        following.append(table)
    return tuple(following)


# How what follows from a data sheet is checked, where another field has the same limits.
_LIMITED = {"initial_data": "arrivals.initial"}


@cache
def _adapter(name: str) -> TypeAdapter:
    field = fields_of(Fields)[name]
    kind: Any = Annotated[field.annotation, field]
    return TypeAdapter(kind)


def _check_following(sheet: DataSheet, name: str, value: Any) -> None:
    """Refuse a data sheet from which a value follows that its field may not have."""
    limited = _LIMITED.get(name, name)
    if limited not in fields_of(Fields):
        return  # it is checked beside the others, whose limits it has
    try:
        _adapter(limited).validate_python(value)
    except ValidationError as error:
        number = error.errors()[0]["input"]
        raise InputError(
            "data_sheet",
            f"with {sheet.origin(name)}, {name} is {number:,g}",
            form_of(fields_of(Fields)[limited]),
        ) from None


def _out_of_range(c: Constants) -> Iterator[InputError]:
    """The sampled parameters lie within their limits, and C_S is below C_C."""
    values = {name: getattr(c, name) for name in SAMPLED}
    ends = {name: (value, value) if is_number(value) else value for name, value in values.items()}
    for name, (low, high) in ends.items():
        least, most = c.limits(name)
        if not least <= low <= high <= most:
            setting = [low, high]
            if low == high:
                setting = low
            reason = ""
            if name == "uavs":
                reason = ", one for each cell of the start zone; a wider zone has room for more"
                if most == MOST_UAVS:
                    reason = ""
            yield InputError(name, f"{setting} is out of range", f"{least}..{most}{reason}")
    start = ends["charge_start"][1]
    complete = ends["charge_complete"][0]
    if start >= complete:
        yield InputError(
            "charge_start",
            f"{start} is not below charge_complete {complete}",
            "10 <= charge_start < charge_complete <= 100 (eq. 1)",
        )
