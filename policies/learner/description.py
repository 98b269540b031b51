"""The description of a trained policy: ``config.json``, which stands beside its weights.

description = read_description(Path("runs/quick"))
description.training.seed, description.layout.nodes, description.model_sha256
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from dess.base.elementary import log10
from dess.base.files.documents import Document, Sha256
from dess.policies.learner.config import Name, TrainingConfig
from dess.scenario.scenario import ScenarioSpace

FORMAT: Literal[1] = 1
MODEL, CONFIG = "model.safetensors", "config.json"
LIMIT = 2**20  # bytes of the file

Number = Annotated[int, Field(ge=0, lt=2**63)]


class LayoutTable(Document):
    """The grid, zone and nodes of the training, as in a scenario."""

    grid: Number
    zone: Annotated[list[Number], Field(min_length=4, max_length=4)]
    nodes: Annotated[
        list[Annotated[list[Number], Field(min_length=2, max_length=2)]],
        Field(min_length=1, max_length=1024),
    ]


class Run(Document):
    """The training so far, for readers; a policy that was only saved has none of it."""

    dess: str = Field("", max_length=100)
    torch: str = Field("", max_length=100)
    device: str = Field("", max_length=200)
    threads: Number = 0
    ticks: Number | None = None
    updates: Number = 0
    uav_slots: Number = 0
    seconds: Number = 0
    selection_score: float | None = None


class Description(Document):
    """The content of ``config.json``."""

    format: Literal[1] = Field(description="version of the file")
    name: Name = Field(description="name of the policy")
    observation_version: Number = Field(description="version of the encoding of observations")
    layout: LayoutTable | None = Field(
        default=None, description="grid, zone and nodes of the training; none for any sea"
    )
    training: TrainingConfig = Field(description="settings of the training")
    ranges: dict[str, Annotated[list[float], Field(min_length=2, max_length=2)]] = Field(
        {}, max_length=100, description="least and largest value of each field in the training"
    )
    run: Run = Field(description="the training so far")
    model_sha256: list[Sha256] | None = Field(
        default=None,
        min_length=1,
        max_length=2,
        description="checksum of model.safetensors; two while it is replaced, none before dess 0.3",
    )


_PLACES = {"grid", "rows", "cell_size", "max_slots", "zones.pads", "wind.seed"}
# The SNR of a scenario is given at a distance of its own, and compared at this one.
_SNR, _SNR_DISTANCE = "SNR at 1 km [dB]", 1000.0


def field_ranges(spaces: Iterable[ScenarioSpace]) -> dict[str, list[float]]:
    """The least and the largest value of each numeric field in the missions of scenarios.

    Left out is what decides nothing, as rewards, or cannot be compared by a range, as the map. In
    the place of ``edge_snr`` stands the mean SNR at 1 km.
    """
    ranges: dict[str, list[float]] = {}
    for space in spaces:
        fields = {field: space.value(field) for field in space.numeric if field not in _PLACES}
        fields["pads"] = space.charging_pads
        loss = 10 * space.path_loss_exponent * log10(_SNR_DISTANCE / space.snr_distance)
        fields[_SNR] = round(fields.pop("edge_snr") - loss, 1)
        for field, value in fields.items():
            if "reward" in field:
                continue
            if not isinstance(value, tuple):
                value = (value,)
            values = [*value, *ranges.get(field, [])]
            ranges[field] = [min(values), max(values)]
    return ranges


def read_description(folder: Path) -> Description:
    """The description of the trained policy in a folder.

    Raises:
        InputError: If there is none, or it is damaged or of another version.
    """
    absent = "the folder of a trained policy"
    fixed = {"format": FORMAT}
    return Description.load(folder / CONFIG, "", absent, fixed, LIMIT)
