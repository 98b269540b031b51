"""The section ``[weather]``: a series of hours from a file, and which of them UAVs may fly in.

    [weather]                       # in the TOML file of a scenario with a data sheet
    file = "buoy.csv"
    limits = {waves = "1.5 m"}
    operating = "daylight"

With it, a replication is a calendar year of the series (``dess.scenario.weather.hours``). The
series takes the place of the wind, the horizon and the idle time of the data sheet.
"""

import re
from collections.abc import Iterable
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import AfterValidator, Field, model_validator

from dess.base.descriptions import Description
from dess.base.errors import InputError, shown
from dess.physics.section import Number, Section
from dess.scenario.data_sheet.quantities import check_limits
from dess.scenario.quantities import form_of, measured
from dess.scenario.weather.formats import UNITS, known_name, unit_of_column
from dess.scenario.weather.series import Series, digest_of, read_series

ALWAYS, DAYLIGHT = "always", "daylight"
_CLOCK = re.compile(r"([01]?\d|2[0-4]):([0-5]\d)\s*-\s*([01]?\d|2[0-4]):([0-5]\d)")
_OPERATING = 'always, daylight, or local solar time such as "06:00-18:00"'
_LIMIT = re.compile(r"([<>]?)=?\s*(.*\S)\s*")
_NUMBER = re.compile(r"[-+]?\d+(\.\d*)?")
_FORM = 'a largest value such as "12 m/s", or a least one such as "> 2 km"'
# The folder of the files that are shipped, which have plain names.
_SHIPPED = Path(str(resources.files("dess").joinpath("scenarios")))
# What of a data sheet the series takes the place of.
REPLACED = ("wind", "horizon", "idle")


class Table(dict[str, str]):
    """A table of texts, which has a hash as all fields of a scenario."""

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(frozenset(self.items()))


Texts = Annotated[dict[str, str], AfterValidator(Table)]


class Limit(NamedTuple):
    """What a column of the series may be in an hour in which UAVs fly.

    Attributes:
        column: The name of the column.
        is_least: Whether the value is the least, and not the largest.
        value: The value, in SI units.
    """

    column: str
    is_least: bool
    value: float


class Weather(Section):
    """Where the weather of a scenario comes from, and in which UAVs may fly."""

    file: str = Field(
        "",
        description=Description(
            "file of hourly weather",
            form="one that is shipped, or a CSV, NDBC or parquet file beside the scenario",
        ),
    )
    digest: str = Field(
        "",
        pattern="^([0-9a-f]{64})?$",
        description=Description("SHA-256 hash of this file", form="without it, that of the file"),
    )
    limits: Texts = Field(
        Table(),
        description=Description(
            "weather in which UAVs may fly, by columns of the file",
            form='a table such as {wind = "12 m/s", waves = "1.5 m", visibility = "> 2 km"}',
        ),
    )
    operating: str = Field(
        ALWAYS, description=Description("hours in which UAVs may fly", form=_OPERATING)
    )
    height: str = Field("10 m", description="height of the anemometer above the water")
    calm: bool = Field(
        False,
        description=Description(
            "whether UAVs fly as in still air", note="to see what the wind decides"
        ),
    )
    longitude: Number | None = Field(
        None,
        ge=-180,
        le=180,
        description=Description(
            "longitude of the place of the file", unit="degrees", note="without it, the sea's"
        ),
    )
    longest: str = Field(
        "6 h", description="longest window that UAVs fly at once, a forecast of which they know"
    )
    due: str = Field("24 h", description="age from which on data that come home are late")
    units: Texts = Field(
        Table(),
        description=Description(
            "units of columns that are not in SI units", form='a table such as {wind = "km/h"}'
        ),
    )
    stamps: Literal["begin", "end"] = Field(
        "begin", description="whether the times of rows begin or end what they tell of"
    )

    @model_validator(mode="before")
    @classmethod
    def _find_the_file(cls, values: Any) -> Any:
        """A file that is not shipped has its whole path; its hash is taken if it is not told."""
        if not (isinstance(values, dict) and isinstance(values.get("file"), str)):
            return values
        if not values["file"]:
            return values
        file = values["file"]
        if not is_shipped(file):
            file = str(Path(file).absolute())
        return {**values, "file": file, "digest": values.get("digest") or digest_of(_path(file))}

    @model_validator(mode="after")
    def _is_sound(self) -> "Weather":
        for name, unit, limits in (
            ("height", "m", (0.1, 1000)),
            ("longest", "s", (3600, 7 * 86_400)),
            ("due", "s", (1, 1e9)),
        ):
            try:
                check_limits(getattr(self, name), unit, [limits])
            except InputError as error:
                raise error.within(name) from None
        if measured(self.longest, "s")[0] % 3600:
            raise InputError("longest", f"{shown(self.longest)} is not whole", "whole hours")
        if self.operating not in (ALWAYS, DAYLIGHT):
            self.clock()
        self.bounds()
        for name, unit in self.units.items():
            try:
                column_unit = unit_of_column(known_name(name), unit)
            except InputError as error:
                raise error.within("units") from None
            if column_unit is None:
                raise InputError(f"units.{name}", f"{shown(unit)} is unknown", "such as km/h")
        if self.is_on and not self.file:
            raise InputError("file", "is missing", "the name of a file of hourly weather")
        return self

    @property
    def path(self) -> Path:
        """The path of the file."""
        return _path(self.file)

    @property
    def longest_hours(self) -> int:
        """The longest window [h]."""
        return round(measured(self.longest, "s")[0] / 3600)

    def clock(self) -> tuple[int, int]:
        """When UAVs may fly from and until [minutes of local solar time].

        Raises:
            InputError: If ``operating`` has no such times.
        """
        match = _CLOCK.fullmatch(self.operating)
        if not match:
            raise InputError("operating", f"{shown(self.operating)} is unknown", _OPERATING)
        hours, minutes, until_hours, until_minutes = map(int, match.groups())
        begin = 60 * hours + minutes
        until = 60 * until_hours + until_minutes
        if max(begin, until) > 24 * 60 or begin == until:
            raise InputError("operating", f"{shown(self.operating)} is no time", _OPERATING)
        return begin, until

    def bounds(self) -> list[Limit]:
        """The limits, in their order.

        Raises:
            InputError: If one is no quantity that its column can have.
        """
        return [_limit_of(name, text) for name, text in self.limits.items()]

    def series(self) -> Series:
        """The series of the file.

        Raises:
            InputError: If it cannot be read, has another hash, or lacks a column of the limits.
        """
        series = read_series(self.path, self.units, self.stamps)
        if series.digest != self.digest:
            problem = f"has other content than the scenario's: SHA-256 {series.digest[:12]}..."
            raise InputError(self.path, problem, f"the file with {self.digest[:12]}...")
        return series


def refuse_weather(weathers: Iterable[Weather]) -> None:
    """Refuse weather where single missions are simulated.

    Raises:
        InputError: If one of these sections is on.
    """
    if any(weather.is_on for weather in weathers):
        problem = "makes a replication a year, which evaluate, sweep, what-if and study simulate"
        raise InputError("weather", problem, "a scenario without it")


def is_shipped(file: str) -> bool:
    """Whether a file of weather is named as one that is shipped."""
    return Path(file).name == file and (_SHIPPED / file).is_file()


def _path(file: str) -> Path:
    if is_shipped(file):
        return _SHIPPED / file
    return Path(file)


def _limit_of(name: str, text: str) -> Limit:
    """The limit of a column as it is typed."""
    where = f"limits.{name}"
    match = _LIMIT.fullmatch(text)
    if not match:
        raise InputError(where, f"{shown(text)} is no limit", _FORM)
    sign, quantity = match.groups()
    column = known_name(name)
    if column not in UNITS and _NUMBER.fullmatch(quantity):
        return Limit(name, sign == ">", float(quantity))
    try:
        if _NUMBER.fullmatch(quantity):
            raise InputError("", "has no unit", form_of(UNITS[column][0]))
        unit = unit_of_column(column, quantity)
    except InputError as error:
        raise InputError(where, f"{shown(text)} is no limit of it", error.allowed) from None
    if unit is None:
        raise InputError(where, f"{shown(text)} is no limit", _FORM)
    return Limit(name, sign == ">", float(unit[1]))


def in_weather(sheet: Any, weather: Weather) -> Any:
    """A data sheet whose wind, horizon and idle time are those of the weather.

    The horizon is that of the longest window. What is no sheet stays as it is.
    """
    if not isinstance(sheet, dict) or all(value is None for value in sheet.values()):
        return sheet
    kept = {name: value for name, value in sheet.items() if name not in REPLACED}
    return {**kept, "horizon": weather.longest}
