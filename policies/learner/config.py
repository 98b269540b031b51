"""The settings of a training.

>>> config = load_config("quick", seed=2)      # shipped, or the path of a TOML file
>>> config.seed, config.observation
(2, 'vector')
"""

import hashlib
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    StrictBool,
    model_validator,
)

from dess.base.commands import command_line, command_options
from dess.base.errors import InputError, shown, validated
from dess.base.files.reading import Shipped
from dess.base.files.writing import toml_value
from dess.scenario.families import SETS, seas_of
from dess.scenario.scenario import ScenarioSpace, load_scenario

_CONFIGS = Shipped("config", "dess.policies.learner", "configs")

# The file of a training that can go on.
CHECKPOINT = "checkpoint.safetensors"

# Seed of training missions: this plus the seed of the training.
MISSION_SEED = 500_000_000

# An evaluation is a row of the curve, which a checkpoint holds as text.
MOST_EVALUATIONS = 50_000

# Settings that are newer than some policies, whose identifiers do not have them.
_LATER = {"set", "seas", "seas_per_tick", "evaluation_seas", "short_ranges"}

# Settings that only one of the algorithms has: double DQN and proximal policy optimization.
_SETTINGS_OF = {
    "dqn": {
        *("low_battery_starts", "early_returns", "replay", "n_step", "reward_scale", "loss"),
        *("target_rate", "discount", "checkpoint_replay", "epsilon", "epsilon_decay"),
    },
    "ppo": {"seas", "evaluation_seas", "seas_per_tick", "short_ranges"},
}

Count = Annotated[int, Field(strict=True, ge=1)]
Width = Annotated[int, Field(strict=True, ge=1, le=4096)]
Share = Annotated[float, Field(strict=True, ge=0.0, le=1.0)]
# Smaller rates and factors would change no weight in single precision.
Rate = Annotated[float, Field(strict=True, ge=1e-12, le=1.0)]
Factor = Annotated[float, Field(strict=True, ge=1e-6, le=1e6)]


def _in_one_line(text: str) -> str:
    """Refuse what a terminal would not show as it is: a name appears in messages and tables."""
    if not text.isprintable():
        raise InputError("", f"{shown(text)} has control characters", "printable characters")
    return text


Place = Annotated[str, Field(min_length=1, max_length=4096)]  # a scenario, or a set of seas
Name = Annotated[str, Field(min_length=1, max_length=100), AfterValidator(_in_one_line)]


class _Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Phase(_Settings):
    """One phase of Algorithm 1."""

    name: Name = Field(description="name in curves and files")
    ticks: Count = Field(le=10**8, description="mission slots of every environment")
    battery: StrictBool = Field(True, description="whether flying costs battery (line 7, 19)")
    epsilon: tuple[Share, Share] = Field(
        (0.1, 0.1), description="share of random actions at the beginning and the end"
    )
    epsilon_decay: Rate = Field(1.0, description="share of the phase over which epsilon moves")
    temperature: float = Field(
        0.0,
        strict=True,
        ge=0.0,
        le=1e6,
        description="of softmax exploration in scaled values; 0 for argmax, not with sets",
    )
    learning_rate: tuple[Rate, Rate] = Field(
        (1e-3, 1e-4), description="of Adam at the beginning and the end"
    )

    @model_validator(mode="after")
    def _is_a_temperature(self) -> "Phase":
        if 0.0 < self.temperature < 1e-6:  # values divided by it would be infinite
            raise InputError("temperature", f"{self.temperature} is too low", "0, 1e-6..1e6")
        return self


class TrainingConfig(_Settings):
    """All settings of a training."""

    name: Name = Field(description="name of the policy")
    description: str = Field("", max_length=10_000, description="purpose of the policy")
    scenario: str = Field(
        "paper", max_length=4096, description="scenario that missions are drawn from"
    )
    seas: tuple[Place, ...] = Field(
        (),
        max_length=2000,
        description="scenarios in place of the one scenario; FAMILY:FIRST..LAST are generated "
        "seas, and train, validation and test are sets of them",
    )
    set: dict[str, Any] = Field({}, description="fields of the scenario, in all missions")
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**31)] = Field(
        1, description="of the training: weights, exploration, missions"
    )

    observation: Literal["vector", "maps", "sets"] = Field(
        "vector",
        description="vector: (b); maps: the paper's (a); sets: for "
        "any sea, learned by proximal policy optimization and not by double DQN",
    )
    hidden: tuple[Width, ...] = Field(
        (512, 512),
        max_length=8,
        description="units of the dueling network's layers; maps have the paper's",
    )
    precision: Literal["float32", "bfloat16"] = Field(
        "float32", description="of the hidden layers while training"
    )

    guard: StrictBool = Field(True, description="whether the return guard masks actions")
    low_battery_starts: Share = Field(
        0.0, description="share of training missions that start in the zone on a low battery"
    )
    short_ranges: Share = Field(
        0.0,
        description="share of the seas of a tick with smaller batteries and quotas, with sets",
    )
    early_returns: Share = Field(
        0.0,
        description="share of UAVs that return, in training, as soon as they may charge",
    )
    phases: tuple[Phase, ...] = Field(
        min_length=1, max_length=8, description="of Algorithm 1, in order"
    )
    num_envs: Count = Field(
        64, le=100_000, description="missions that are simulated side by side, on each sea"
    )
    seas_per_tick: Count = Field(
        1, le=100, description="seas on which a tick has missions, and of which a minibatch is"
    )
    learning_starts: Count = Field(
        1000,
        le=10**6,
        description="slots of random actions per environment before learning starts;"
        " with sets, ticks in which only the critic learns",
    )
    replay: Count = Field(
        8000, le=10**7, description="slots per environment that the replay memory holds"
    )
    batch: Count = Field(512, le=10**6, description="transitions per update")
    updates: Count = Field(1, le=100, description="updates per tick")

    n_step: Count = Field(5, le=1000, description="n of the n-step return")
    discount: Rate = Field(0.99, description="gamma per slot")
    reward_scale: Factor = Field(0.05, description="factor of all rewards")
    loss: Literal["huber", "mse"] = Field("huber", description="loss function")
    gradient_norm: Factor = Field(10.0, description="to which gradients are clipped")
    target_rate: Rate = Field(0.005, description="tau of the soft target update (eq. 28)")
    average_rate: Rate = Field(
        1.0,
        description="rate of the slow copy of the weights that is evaluated; 1 for no copy",
    )

    evaluate_every: Count = Field(2000, le=10**6, description="ticks between evaluations")
    evaluation_missions: Count = Field(300, le=10**6, description="missions of an evaluation")
    evaluation_seas: tuple[Place, ...] = Field(
        (), max_length=2000, description="as seas, for evaluations; by default the same"
    )
    evaluation_seed: Annotated[int, Field(strict=True, ge=0, lt=2**64)] = Field(
        700_000_001, description="of the evaluations that select the weights"
    )
    window: Count = Field(3, le=1000, description="evaluations in the moving average that selects")
    checkpoint_replay: StrictBool = Field(
        True, description="whether checkpoints hold the replay memory; if not, a resumed training "
        "differs from an uninterrupted one"
    )  # fmt: skip

    @model_validator(mode="after")
    def _is_consistent(self) -> "TrainingConfig":
        if self.ticks // self.evaluate_every > MOST_EVALUATIONS:
            raise InputError(
                "evaluate_every",
                f"{self.evaluate_every} makes more than {MOST_EVALUATIONS:,} evaluations in "
                f"{self.ticks:,} ticks",
                "more ticks between evaluations",
            )
        if self.evaluation_seed == MISSION_SEED + self.seed:
            raise InputError(
                "evaluation_seed", f"{self.evaluation_seed} is that of the training", "another"
            )
        names = [phase.name for phase in self.phases]
        if len(set(names)) < len(names):
            raise InputError("phases", f"{shown(names)} are not distinct", "distinct names")
        return self

    @model_validator(mode="after")
    def _suits_its_algorithm(self) -> "TrainingConfig":
        unused = _SETTINGS_OF["dqn" if self.algorithm == "ppo" else "ppo"]
        for part in (self, *self.phases):
            fields = type(part).model_fields
            for name in fields:
                if name in unused and getattr(part, name) != fields[name].default:
                    raise InputError(
                        name,
                        f"{shown(getattr(part, name))} has no effect with the observation "
                        f"{self.observation}",
                        "to leave it out",
                    )
        if self.algorithm == "ppo":
            if len(self.hidden) != 3:
                raise InputError("hidden", f"{list(self.hidden)} are not three", "three")
            for phase in self.phases:
                if not phase.temperature:
                    raise InputError("phases", f"{phase.name} has no temperature", "above 0")
            return self
        if self.replay < self.n_step + 2:  # of two slots an environment has simulated at least one
            raise InputError(
                "replay", f"{self.replay} is too few", f"n_step {self.n_step} + 2 or more"
            )
        if self.learning_starts <= self.n_step:
            raise InputError(
                "learning_starts",
                f"{self.learning_starts} is too few",
                f"more than n_step {self.n_step}",
            )
        return self

    @property
    def algorithm(self) -> Literal["dqn", "ppo"]:
        """Double DQN or, with sets, proximal policy optimization."""
        return "ppo" if self.observation == "sets" else "dqn"

    @property
    def ticks(self) -> int:
        """Ticks of all phases."""
        return sum(phase.ticks for phase in self.phases)

    @property
    def space(self) -> ScenarioSpace:
        """The scenario that missions are drawn from, with the fields that ``set`` changes.

        Raises:
            InputError: If it does not exist or is not valid.
        """
        return load_scenario(self.scenario, **self.set)

    def mission_spaces(self, of_evaluations: bool = False) -> list[ScenarioSpace]:
        """The scenarios that missions are drawn from: the seas or, without them, the one scenario.

        Args:
            of_evaluations: Whether those of the missions that select weights are asked for.

        Raises:
            InputError: If one of them does not exist or is not valid.
        """
        parts = (of_evaluations and self.evaluation_seas) or self.seas or (self.scenario,)
        return [load_scenario(name, **self.set) for part in parts for name in _names_in(part)]


def _names_in(part: str) -> list[str]:
    """The names of scenarios that a part of ``seas`` stands for."""
    if part in SETS:
        return seas_of(part)
    if several := re.fullmatch(r"(\w+):(\d{1,9})\.\.(\d{1,9})", part):
        family, first, last = several.groups()
        return [f"{family}:{seed}" for seed in range(int(first), int(last) + 1)]
    return [part]


def config_names() -> list[str]:
    """The names of the shipped configs."""
    return _CONFIGS.names()


def load_config(
    name_or_path: str | Path, /, fields: Mapping[str, Any] | None = None, **overrides: Any
) -> TrainingConfig:
    """A shipped config by name, or one from a TOML file.

    Args:
        name_or_path: One of ``config_names()``, or the path of a TOML file.
        fields: Fields of the scenario to set on top of those that the config sets.
        **overrides: Settings of ``TrainingConfig`` in place of those of the config.

    Raises:
        InputError: If the config does not exist, or it or its scenario is not valid.
    """
    where, values = _CONFIGS.load(name_or_path)
    config = validate_config(values | overrides, where)
    config = config.model_copy(update={"set": config.set | dict(fields or {})})
    for key in sorted(config.set.keys() & TrainingConfig.model_fields.keys()):
        raise InputError(
            where,
            f"{key} is a setting of the training, not a field of the scenario",
            f"{key} = VALUE in a config file",
        )
    try:
        config.space  # noqa: B018 - it is checked when it is made
    except InputError as error:
        raise error.within(f"{where}: scenario") from None
    return config


def validate_config(values: dict[str, Any], where: str) -> TrainingConfig:
    """Validate plain values, read from ``where``; the scenario's file need not exist.

    Raises:
        InputError: If the values are not valid.
    """
    for key in sorted(values.keys() & ScenarioSpace.model_fields.keys()):
        raise InputError(
            where,
            f"{key} is a field of the scenario",
            f"{command_options(set={key: toml_value(values[key])})}, or {key} in the table [set]",
        )
    return validated(TrainingConfig, values, where)


def learner_identifier(config: TrainingConfig) -> str:
    """An identifier that trainings share if they differ only in the seed: name and hash."""
    settings = config.model_dump(mode="json", exclude={"seed", "description"})
    parts: list[tuple[dict[str, Any], type[BaseModel]]] = [(settings, TrainingConfig)]
    parts += [(phase, Phase) for phase in settings["phases"]]
    for part, kind in parts:
        for name in _LATER & part.keys():  # policies have been trained before they existed
            if part[name] in ([], {}, [0.0, 0.0], kind.model_fields[name].default):
                del part[name]
    return f"{config.name} {hashlib.sha256(json.dumps(settings).encode()).hexdigest()[:8]}"


def resume_command(config: TrainingConfig, name: str, out: Path, device: str = "auto") -> str:
    """The command that continues a training.

    Args:
        config: The settings of the training.
        name: The name or path of the config.
        out: The folder of the training.
        device: The device of the training.
    """
    try:
        original = load_config(name)
    except InputError:  # only its path is unknown
        original = config
    changed: dict[str, Any] = {}
    if config.seed != original.seed:
        changed["seed"] = config.seed
    if config.scenario != original.scenario:
        changed["scenario"] = config.scenario
    changed["set"] = {
        key: toml_value(value)
        for key, value in config.set.items()
        if original.set.get(key) != value
    }
    if device != "auto":
        changed["device"] = device
    return command_line("train", name, out=out, **changed, resume=True)
