"""What policies see of the state, and how their actions are written into it.

view = View(state, world, mission, uav)   # one row per UAV that must act
view.own["battery"], view.residual, view.legal
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from dess.base.errors import InputError, shown
from dess.base.kernels import kernel
from dess.model.channel import World
from dess.model.rules import legal_moves, may_act
from dess.model.state import HOVER, State, part_of
from dess.model.ways import Ways
from dess.scenario.scenario import ScenarioSpace

_POLICY = "a name such as greedy, an object with act(view), or a list of them"


class View:
    """What a policy may use to decide: one row per UAV that must act, over any number of missions.

    What missions share (``world``) is read-only, and policies must not write to the rest either. In
    the shapes below, R is the number of rows, K the number of
    nodes and I the number of UAVs in the largest mission.

    Attributes:
        state: The arrays of the batch that the rows belong to.
        world: The nodes and the tables of the channel.
        mission: (R,) index of each row's mission in ``state``.
        uav: (R,) index of each row's UAV in its mission.
    """

    def __init__(
        self,
        state: State,
        world: World,
        mission: np.ndarray,
        uav: np.ndarray,
        ways: Ways | None = None,
    ):
        self.state, self.world, self.mission, self.uav = state, world, mission, uav
        self._ways = ways

    @property
    def ways(self) -> Ways:
        """The battery that the ways between cells take."""
        if self._ways is None:
            self._ways = Ways(self.state.missions, self.world.chart)
        return self._ways

    def __len__(self) -> int:
        return len(self.mission)

    @cached_property
    def constants(self) -> np.ndarray:
        """(R,) ``MISSION`` records: constants and progress of each row's mission."""
        return self.state.missions[self.mission]

    @cached_property
    def own(self) -> np.ndarray:
        """(R,) ``UAV`` records: each row's own state."""
        return self.state.uavs[self.mission, self.uav]

    @cached_property
    def team(self) -> np.ndarray:
        """(R, I) ``UAV`` records of each row's team, the row's own UAV included.

        A mission with fewer than I UAVs has inactive records in the other columns.
        """
        return self.state.uavs[self.mission]

    @cached_property
    def residual(self) -> np.ndarray:
        """(R, K) residual data of the nodes [data units], 0 where a node is silent."""
        return self.state.residual[self.mission]

    @cached_property
    def age(self) -> np.ndarray:
        """(R, K) age of information of the nodes [slots]: how old the newest collected data are.

        In the slotted model this is the time since the node was last emptied.
        """
        newest = self.state.sensors["newest"][self.mission]
        return self.constants["slot"][:, None] - newest

    @cached_property
    def silent(self) -> np.ndarray:
        """(R, K) whether the nodes are silent."""
        return self.state.sensors["silent"][self.mission]

    @cached_property
    def pads_working(self) -> np.ndarray:
        """(R,) charging pads that are not out of order."""
        constants = self.constants
        return constants["pads"] - constants["pads_out"].sum(1)

    def rows_by(self, kind: np.dtype) -> Iterator[tuple[bytes, np.ndarray]]:
        """The rows of missions that are equal in a part, with that part as bytes.

        Args:
            kind: The type of the part (``mission_part``).
        """
        missions = self.state.missions.view(np.uint8).reshape(len(self.state.missions), -1)
        columns = _columns_of(self.state.missions.dtype, kind)
        if _are_equal(missions, columns):
            yield missions[0, columns].tobytes(), np.arange(len(self))
            return
        parts = part_of(self.state.missions, kind).view(np.dtype((np.void, kind.itemsize)))
        numbers: dict[bytes, int] = {}
        of_mission = np.array([numbers.setdefault(part, len(numbers)) for part in parts.tolist()])
        of_row = of_mission[self.mission]
        for part, number in numbers.items():
            rows = np.flatnonzero(of_row == number)
            if len(rows):
                yield part, rows

    @cached_property
    def legal(self) -> np.ndarray:
        """(R, 5) mask of the legal actions: Hover, and the moves that stay on the open grid."""
        zones = self.world.chart.zones
        return legal_actions(self.state.uavs, zones, self.mission, self.uav)


@lru_cache
def _columns_of(missions: np.dtype, part: np.dtype) -> np.ndarray:
    """The numbers of the bytes of records that a part of them has."""
    assert missions.fields and part.names
    places = [missions.fields[name][:2] for name in part.names]
    return np.concatenate([at + np.arange(kind.itemsize) for kind, at in places])


@kernel
def _are_equal(records, columns):
    """Whether some columns of all (B, bytes) records are equal."""
    for b in range(1, len(records)):
        for column in columns:
            if records[b, column] != records[0, column]:
                return False
    return True


@kernel
def legal_actions(uavs, zones, rows_mission, rows_uav):
    """(R, 5) mask of the actions that stay on the grid and out of no-fly cells.

    Only Hover is allowed for a UAV that is not asked for an action, and where its index is -1.
    """
    legal = np.zeros((len(rows_mission), 5), np.bool_)
    for row in range(len(rows_mission)):
        b, i = rows_mission[row], rows_uav[row]
        moves = 1 << HOVER
        if i >= 0 and may_act(uavs[b, i]):
            moves = legal_moves(zones, uavs[b, i])
        for action in range(5):
            legal[row, action] = moves >> action & 1
    return legal


@kernel
def acting_rows(missions, uavs, policies, number):
    """The (R,) missions and (R,) UAV indices of the UAVs for which one policy must act.

    These UAVs are active, neither charge nor are grounded, and are not in the middle of a move. In
    a team of ``policies`` policies, UAV i follows policy number ``i % policies``; the function
    selects the UAVs that follow policy ``number``.
    """
    rows_mission = np.empty(uavs.size, np.int64)
    rows_uav = np.empty(uavs.size, np.int64)
    count = 0
    for b in range(len(missions)):
        if missions[b].active > 0:
            for i in range(number, missions[b].uavs, policies):
                if may_act(uavs[b, i]):
                    rows_mission[count] = b
                    rows_uav[count] = i
                    count += 1
    return rows_mission[:count], rows_uav[:count]


def team_of(policy: Any, spaces: Sequence[ScenarioSpace]) -> list[Any]:
    """The team of one policy, or of a list or tuple of policies.

    Args:
        policy: The policy or policies.
        spaces: The scenarios that the team is to act in.

    Raises:
        InputError: If there are no policies, or more than UAVs in the largest fleet of all
            scenarios; if something is not a policy.
    """
    team = [policy]
    if isinstance(policy, list | tuple):
        team = [*policy]
    for member in team:
        _check_policy(member)
    if not team:
        raise InputError("policy", "the team is empty", f"at least one policy, {_POLICY}")
    if spaces:
        check_team(len(team), spaces)
    return team


def _check_policy(policy: Any) -> None:
    """Refuse what is not a policy."""
    if isinstance(policy, type) or not callable(getattr(policy, "act", None)):
        kind = type(policy).__name__
        raise InputError("policy", f"{shown(policy)} is of type {kind}", _POLICY)


def check_team(policies: int, spaces: Iterable[ScenarioSpace]) -> None:
    """Refuse a team in which some policy would never act.

    Args:
        policies: The number of policies in the team.
        spaces: The scenarios that the team is to act in.

    Raises:
        InputError: If there are more policies than UAVs in the largest fleet of all scenarios.
    """
    fleet = max(space.uavs[1] for space in spaces)
    if policies > fleet:
        uavs = "1 UAV"
        if fleet > 1:
            uavs = f"{fleet} UAVs"
        raise InputError(
            "policy",
            f"the team has {policies} policies, but the largest fleet has {uavs}",
            f"{fleet} at most",
        )


def flight_of(team: Sequence[Any]) -> Callable[..., None] | None:
    """The function that flies a mission to its end in compiled code, if the whole team has it.

    It belongs to the method ``act``, so that a class with another method has none::

        fly(team, state, b, world, scratch, reach)   # mission b of the state
    """
    flights = {getattr(policy.act, "fly", None) for policy in team}
    return flights.pop() if len(flights) == 1 else None


def decide(team: Sequence[Any], state: State, world: World, ways: Ways) -> None:
    """Write the actions that the policies of a team choose into the state.

    UAV i follows policy ``team[i % len(team)]``. All policies decide before any action is written,
    so that no policy sees what a teammate decided in the same slot. ``world`` is what policies may
    see of it (``World.shown``), ``ways`` are those of the batch.

    Raises:
        ValueError: If a policy does not return one action per row.
    """
    decisions = []
    for number, policy in enumerate(team):
        mission, uav = acting_rows(state.missions, state.uavs, len(team), number)
        if len(mission):
            actions = np.asarray(policy.act(View(state, world, mission, uav, ways)))
            if actions.shape != mission.shape or actions.dtype.kind not in "iu":
                raise ValueError(
                    f"policy {policy.name}: act must return {len(mission)} integers, "
                    f"not {actions.dtype} of shape {actions.shape}"
                )
            decisions.append((policy, mission, uav, actions))
    for policy, mission, uav, actions in decisions:
        if not _write_actions(state.uavs, mission, uav, actions):
            raise ValueError(f"policy {policy.name}: act must return actions 0..4")


@kernel
def _write_actions(uavs, mission, uav, actions):
    for row in range(len(mission)):
        action = np.int64(actions[row])
        if not 0 <= action <= 4:
            return False
        uavs[mission[row], uav[row]].action = action
    return True
