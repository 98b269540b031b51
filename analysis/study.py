"""Studies: policies x design points x replications, as data."""

from functools import cached_property
from importlib import resources
from itertools import product
from pathlib import Path
from typing import Any, Literal, NamedTuple, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    field_validator,
    model_validator,
)

from dess.errors import InputError
from dess.scenario import (
    Integer,
    ScenarioSpace,
    load_scenario,
    parse_toml,
    scenario_names,
    validation_line,
)
from dess.streams import MAX_REPLICATION, MAX_SEED
from policies import load_team


class Point(NamedTuple):
    """A design point: the values of the swept fields, and the scenario that they make."""

    values: dict[str, Any]
    scenario: ScenarioSpace


class Study(BaseModel):
    """Policies x design points x replications.

    Every policy meets the same replications (common random numbers). ``load_study`` makes one from
    a file, with one-line errors.

    Raises:
        pydantic.ValidationError: If a field, a policy or a design point's scenario is not valid.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    name: str = Field(
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", description="names the folder of results"
    )
    description: str = Field("", description="what the study is about, in a line")
    scenario: str = Field("paper", description="a shipped scenario or a TOML file")
    set: dict[str, Any] = Field({}, description="fields of the scenario, the same everywhere")
    sweep: dict[str, tuple[Any, ...]] = Field(
        {}, description="field -> values; the design points are their cartesian product, in order"
    )
    policies: tuple[str, ...] = Field(min_length=1, description='teams: "P" or "P,P,..."')
    missions: Integer = Field(
        1000, ge=1, le=MAX_REPLICATION + 1, description="per design point and policy"
    )
    seed: Integer = Field(0, ge=0, le=MAX_SEED)
    engine: Literal["batch", "events"] = "batch"
    logged: Integer = Field(
        0, ge=0, description="first replications of every cell whose event log is kept"
    )

    @field_validator("policies", mode="before")
    @classmethod
    def _list_to_tuple(cls, value: Any) -> Any:
        return tuple(value) if isinstance(value, list) else value

    @field_validator("sweep", mode="before")
    @classmethod
    def _lists_to_tuples(cls, value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        return {key: tuple(v) if isinstance(v, list) else v for key, v in value.items()}

    @field_validator("policies")
    @classmethod
    def _are_known(cls, teams: tuple[str, ...]) -> tuple[str, ...]:
        teams = tuple(",".join(name.strip() for name in team.split(",")) for team in teams)
        for team in teams:
            load_team(team)
            if teams.count(team) > 1:
                raise ValueError(f"{team} is listed twice; allowed: distinct teams")
        return teams

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        for key, values in self.sweep.items():
            if key in self.set:
                raise ValueError(f"sweep: {key} is also in set; allowed: either")
            if not values:
                raise ValueError(f"sweep: {key} has no values; allowed: one or more")
        if self.logged > self.missions:
            raise ValueError(
                f"logged: {self.logged} is more than the missions; allowed: 0..{self.missions}"
            )
        scenarios = [point.scenario for point in self.points]
        for number, point in enumerate(self.points):
            if point.scenario in scenarios[:number]:
                raise ValueError(f"sweep: {_shown(point.values)} is there twice; allowed: once")
        return self

    @cached_property
    def points(self) -> tuple[Point, ...]:
        """The design points: the cartesian product of the sweep, the last field varying fastest."""
        designs = (dict(zip(self.sweep, v, strict=True)) for v in product(*self.sweep.values()))
        return tuple(Point(values, self._scenario_at(values)) for values in designs)

    def _scenario_at(self, values: dict[str, Any]) -> ScenarioSpace:
        try:
            return load_scenario(self.scenario, **self.set, **values)
        except InputError as error:
            raise InputError(f"at {_shown(values)}: {error}" if values else str(error)) from None


def load_study(name_or_path: str | Path, /, **overrides: Any) -> Study:
    """A shipped study by name, or one from a TOML file.

    Args:
        name_or_path: One of ``study_names()``, or the path of a TOML file. A file that names no
            study gives it its own name; its scenario, if a file, is looked for beside it.
        **overrides: Fields of ``Study`` to set on top.

    Raises:
        InputError: If there is no such study, or it is not valid.
    """
    text = str(name_or_path)
    shipped = text in study_names()
    content = _folder().joinpath(f"{text}.toml").read_text("utf-8") if shipped else _read(text)
    where = f"study {text}" if shipped else text
    values = {"name": Path(text).stem if not shipped else text} | parse_toml(content, where)
    scenario = values.get("scenario")
    if isinstance(scenario, str) and scenario not in scenario_names():
        values["scenario"] = str(Path(text).parent / scenario)
    values |= overrides
    if unknown := sorted(values.keys() - Study.model_fields.keys()):
        allowed = ", ".join(Study.model_fields)
        raise InputError(f"{where}: {unknown[0]}: unknown key; allowed: {allowed}")
    try:
        return Study.model_validate(values)
    except ValidationError as error:
        raise InputError(validation_line(error, where)) from None


def study_names() -> list[str]:
    """The names of the shipped studies."""
    names = (entry.name for entry in _folder().iterdir())
    return sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml"))


def _folder() -> Any:
    return resources.files("analysis").joinpath("studies")


def _read(path: str) -> str:
    try:
        return Path(path).read_text("utf-8")
    except FileNotFoundError:
        allowed = ", ".join(study_names())
        raise InputError(f"{path}: no such study; allowed: {allowed}, or a TOML file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from None


def _shown(values: dict[str, Any]) -> str:
    return ", ".join(f"{key}={value}" for key, value in values.items())
