"""The fields of a study and their limits, as study files and results have them."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, SerializerFunctionWrapHandler, model_serializer

from dess import InputError
from dess.analysis.study.cheapest import AnySelection, Cheapest
from dess.analysis.study.design import Design
from dess.analysis.study.prices import Costs
from dess.analysis.study.stopping import MOST_MISSIONS, Precision, StrictTable, Text
from dess.base.descriptions import Description
from dess.physics.section import Integer, tuples
from dess.physics.streams import MAX_SEED
from dess.scenario.scenario import ScenarioSpace
from dess.scenario.values import dotted

Engine = Literal["batch", "events"]

# Years with weather that are simulated, if nothing else is asked for, and at most.
YEARS, MOST_YEARS = 10, 1000
# The longest name of a study, which is part of the names of files.
MOST_CHARACTERS = 100

# The first replication of the missions that check a selected setting. They are independent of the
# missions on which the selection was based.
CHECK = MOST_MISSIONS


def _by_field(values: Any) -> Any:
    if isinstance(values, dict):
        return dotted(values)
    return values


class StudyData(StrictTable):
    """The fields of a study and their limits, as study files and results have them.

    No policy and no scenario is loaded, so that the data may come from anybody.

    Raises:
        pydantic.ValidationError: If a field is not valid.
    """

    name: str = Field(
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$",
        max_length=MOST_CHARACTERS,
        description="names the folder of results",
    )
    description: Text = Field("", description="what the study is about, in a line")
    scenario: Text = Field("paper", description="a shipped scenario or a TOML file")
    set: Annotated[dict[str, Any], BeforeValidator(_by_field)] = Field(
        {}, description="fields of the scenario, the same everywhere"
    )
    design: Design | None = Field(
        None,
        description=Description(
            "the design points",
            form="a table with the kind of the design; without one, the scenario is the only point",
        ),
    )
    policies: Annotated[tuple[Text, ...], BeforeValidator(tuples)] = Field(
        min_length=1, description=Description("teams", form='"P" or "P,P,..."')
    )
    missions: Integer = Field(
        1000,
        ge=1,
        le=MOST_MISSIONS,
        description="per design point and policy; with a rule, not given",
    )
    years: Integer | None = Field(
        None,
        ge=1,
        le=MOST_YEARS,
        description="years of weather per design point and policy, in place of missions; "
        f"{YEARS} where a scenario has weather",
    )
    precision: Precision | None = Field(
        None, description="a rule that asks for as many missions as narrow intervals take"
    )
    selection: AnySelection | None = Field(
        None, description="a rule that asks for as many missions as finding the best point takes"
    )
    costs: Costs | None = Field(None, description="prices, for questions about costs")
    seed: Integer = Field(0, ge=0, le=MAX_SEED)
    engine: Engine = Field(
        "batch", description="by default batch, or events if a design point needs it"
    )
    logged: Integer = Field(
        0,
        ge=0,
        le=MOST_MISSIONS,
        description="first replications of every cell whose event log is kept",
    )
    bounds: bool = Field(
        False, strict=True, description="whether every mission has an upper bound, for the gap"
    )

    @model_serializer(mode="wrap")
    def _without_years(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave the years out where there are none: such studies are stored as before."""
        values = handler(self)
        if self.years is None:
            values.pop("years", None)
        return values

    @property
    def replication_name(self) -> str:
        """What a replication is: a ``mission``, or a ``year`` where scenarios have weather."""
        return "year" if self.years else "mission"

    @property
    def rule(self) -> Precision | AnySelection | None:
        """The rule that decides the number of replications; None if the number is fixed."""
        return self.precision or self.selection

    @property
    def is_search(self) -> bool:
        """Whether the study searches for the cheapest setting."""
        return isinstance(self.selection, Cheapest)

    @property
    def first(self) -> int:
        """The number of replications of every cell, before a rule asks for more."""
        if self.years:
            return self.years
        if self.rule:
            return self.rule.first
        return self.missions

    @property
    def most(self) -> int:
        """The largest number of replications of a cell that a rule may ask for."""
        if self.years:
            return self.years
        if self.rule:
            return self.rule.budget
        return self.missions

    @property
    def most_missions(self) -> int:
        """The largest number of missions of a policy that the study may need."""
        if not self.selection:
            return self.most * self.size
        checked = 1
        if self.is_search:
            checked = self.size
        return self.selection.budget + self.selection.check * checked

    @property
    def size(self) -> int:
        """The number of design points, computed without making them."""
        return self.design.count if self.design else 1


def replications_of(
    space: ScenarioSpace, missions: int | None, years: int | None, default: int
) -> dict[str, int]:
    """The field of a study that tells its replications: missions, or years with weather.

    Raises:
        InputError: If the other one is given.
    """
    if space.weather.is_on:
        if missions is not None:
            raise InputError("missions", "are years, with weather", "years")
        return {"years": YEARS if years is None else years}
    if years is not None:
        raise InputError("years", "are of a scenario with weather", "missions")
    return {"missions": default if missions is None else missions}
