"""Components of an observation for what is beyond the paper, where the scenario has it."""

from typing import NamedTuple

from dess.code.kernels import kernel
from dess.rules import on_grid
from dess.scenario import ScenarioSpace
from dess.sections.wind import move_surcharge
from dess.state import ACTION_NAMES, HOVER, STEP_X, STEP_Y


class Extensions(NamedTuple):
    """What of it an observation has.

    Attributes:
        grounded: UAVs can be grounded for repair.
        pads_out: Pads can be out of order.
        silent: Nodes can be silent.
        wind: There is wind.
        age: The age of information is measured or rewarded.
    """

    grounded: bool
    pads_out: bool
    silent: bool
    wind: bool
    age: bool


def extensions_of(space: ScenarioSpace) -> Extensions:
    """What an observation of a scenario has."""
    failures = space.failures
    return Extensions(
        grounded=failures.uav_rate > 0,
        pads_out=failures.pad_rate > 0,
        silent=failures.node_rate > 0,
        wind=space.wind.is_on,
        age=space.age.is_on,
    )


def extension_names(space: ScenarioSpace) -> list[str]:
    """The names of the components, in their order; none for the paper's scenarios."""
    has, nodes = extensions_of(space), range(len(space.nodes))
    mates = [f"mate_{j}_grounded" for j in range(1, space.uavs[1])]
    names = []
    names += ["grounded", *mates] if has.grounded else []
    names += ["pads_out"] if has.pads_out else []
    names += [f"silent_{k}" for k in nodes] if has.silent else []
    names += [f"wind_{name}" for name in ACTION_NAMES if name != "hover"] if has.wind else []
    names += [f"age_{k}" for k in nodes] if has.age else []
    return names


@kernel
def encode_extensions(has, mission, uavs, i, sensors, out):
    """Write the components of UAV ``i`` in the order of ``extension_names``.

    Args:
        has: The ``Extensions`` of the scenario.
        mission: ``MISSION`` record.
        uavs: (I,) ``UAV`` records.
        i: Index of the UAV.
        sensors: (K,) ``SENSOR`` records.
        out: The components.
    """
    u, at = uavs[i], 0
    if has.grounded:
        out[0] = u.grounded
        at = 1
        for j in range(len(uavs)):
            if j != i:
                out[at] = uavs[j].grounded
                at += 1
    if has.pads_out:
        out[at] = mission.pads_out[: mission.pads].sum() / mission.pads
        at += 1
    if has.silent:
        for k in range(mission.nodes):
            out[at + k] = sensors[k].silent
        at += mission.nodes
    if has.wind:
        for action in range(HOVER):
            x, y = u.x + STEP_X[action], u.y + STEP_Y[action]
            if on_grid(mission, x, y):
                extra = move_surcharge(mission, STEP_X[action], STEP_Y[action], x, y)
                out[at + action] = mission.flight_cost * extra / 100.0
        at += HOVER
    if has.age:
        for k in range(mission.nodes):
            out[at + k] = (mission.slot - sensors[k].newest) / mission.max_slots
