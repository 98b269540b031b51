"""Single missions of a study: what each collected and left behind, and what its UAVs did.

mission = logged_mission(results, "greedy", point=0, replication=0)
outcome_table([mission])
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from analysis import numbers
from analysis.names import PRODUCT, RATIO
from analysis.results.tables import Results
from analysis.stats.intervals import summary
from dess.scenario import SAMPLED, Scenario

ENDS = {"quota": "quota filled", "battery": "battery empty", "truncated": "out of time"}


@dataclass(frozen=True, eq=False)
class LoggedMission:
    """A mission of a study whose event log is kept.

    Attributes:
        row: Its row of ``Results.missions``.
        uavs: Its rows of ``Results.uavs``.
        scenario: What its replication drew.
        log: Its event log.
    """

    row: pd.Series
    uavs: pd.DataFrame
    scenario: Scenario
    log: pd.DataFrame

    @property
    def collected(self) -> str:
        """What it collected, as a part of a sentence."""
        total = self.row["initial"] + self.row["arrived"]
        return f"{self.row['collected']:.0f} of {total:.0f} data units collected"


def logged_mission(
    results: Results, policy: str, point: int = 0, replication: int = 0
) -> LoggedMission:
    """A mission of a study.

    Raises:
        InputError: If its event log has not been kept.
    """
    log = results.events(policy, point, replication)
    of_mission = "policy == @policy and point == @point and replication == @replication"
    row = results.missions.query(of_mission).iloc[0]
    sampled = {key: int(row[key]) for key in SAMPLED}
    scenario = results.scenario(point).scenario_at(**sampled)
    return LoggedMission(row, results.uavs.query(of_mission), scenario, log)


def estimate(results: Results, policy: str, metric: str = PRODUCT, point: int | None = None) -> Any:
    """The mean of a metric over the missions of a policy, at a design point or at all of them.

    Returns:
        A row of ``analysis.summary``.
    """
    missions = results.missions[results.missions["policy"] == policy]
    if point is not None:
        missions = missions[missions["point"] == point]
    rows = summary(missions, by=["policy"])
    return rows[rows["metric"] == metric].iloc[0]


def outcome_table(missions: Sequence[LoggedMission]) -> pd.DataFrame:
    """A row per mission; data in data units."""
    return pd.DataFrame([_outcome(mission) for mission in missions])


def uav_table(missions: Sequence[LoggedMission]) -> pd.DataFrame:
    """A row per UAV of some missions."""
    return pd.concat([_uavs(mission) for mission in missions], ignore_index=True)


def growth_in_words(
    results: Results, missions: Sequence[LoggedMission], printed: Sequence[float]
) -> str:
    """How the collection ratio changes from the smallest fleet to the largest.

    Args:
        results: The study of the missions.
        missions: Of one policy, by the number of UAVs.
        printed: The collection ratios that the paper prints for them.
    """
    first, last = missions[0].row, missions[-1].row
    of_ends = [estimate(results, row["policy"], RATIO, row["point"]) for row in (first, last)]
    ratios = [first[RATIO], last[RATIO], *(row["mean"] for row in of_ends), printed[0], printed[-1]]
    texts = [numbers.percent(ratio) for ratio in ratios]
    return (
        f"From {first['uavs']} to {last['uavs']} UAVs, the collection ratio goes from {texts[0]} "
        f"to {texts[1]} in these missions, from {texts[2]} to {texts[3]} in the mean of "
        f"{first['policy']}, and from {texts[4]} to {texts[5]} in the paper."
    )


def _outcome(mission: LoggedMission) -> dict[str, Any]:
    row, log = mission.row, mission.log
    served = log.loc[log["event"] == "communication", "node"].nunique()
    left = log[(log["event"] == "mission_end") & (log["node"] >= 0)]
    fullest = left.loc[left["value"].idxmax()]
    return {
        "UAVs": row["uavs"],
        "Success": "yes" if row["success"] else "no",
        "Collected": numbers.percent(row[RATIO]),
        "Mission slots": row["slots"],
        "Charging sessions": (log["event"] == "charge_start").sum(),
        "Nodes never served": f"{len(left) - served} of {len(left)}",
        "Data left": f"{row['residual']:.1f}",
        "Fullest node left": f"{fullest['value']:.1f} at ({fullest['x']:.0f}, {fullest['y']:.0f})",
    }


def _uavs(mission: LoggedMission) -> pd.DataFrame:
    uavs = mission.uavs
    columns = {
        "UAVs": mission.scenario.uavs,
        "UAV": uavs["uav"] + 1,
        "Communications": [f"{filled} of {mission.scenario.quota}" for filled in uavs["quota"]],
        "Data collected": uavs["collected"].map("{:.1f}".format),
        "Slots flying": uavs["slots_flying"],
        "Slots charging": uavs["slots_charging"],
        "Slots waiting": uavs["slots_waiting"],
        "Battery at the end": uavs["battery"].map("{} %".format),
        "End": uavs["end"].map(ENDS),
    }
    return pd.DataFrame(columns)
