"""Age of information: how old the newest data are that have been collected from a node."""

from pydantic import Field

from dess.sections.section import Number, Section


class Age(Section):
    """The age of information of the nodes, in the records and in the reward."""

    measured: bool = Field(False, description="whether records have the age of information")
    reward: Number = Field(
        0.0,
        ge=-1_000_000,
        le=1_000_000,
        description="reward per slot and unit of the mean age of all nodes [slots]",
    )
