"""The commands that simulate a mission of a study again."""

from pathlib import Path
from typing import Any

from dess.analysis.results.manifest import Cell, Manifest
from dess.analysis.results.provenance import Origin
from dess.base.commands import command_line
from dess.base.files.writing import toml_value
from dess.scenario.scenario import SEA, is_scenario_name, load_scenario
from dess.scenario.values import dotted


def of_folder(folder: str | Path, manifest: Manifest, cell: Cell, replication: int) -> str:
    """The command that reads all but the replication from a results folder.

    Args:
        folder: The results folder.
        manifest: What the folder is about.
        cell: The team and the design point of the mission.
        replication: Of the mission.
    """
    point = None
    if len(manifest.points) > 1:
        point = cell.point
    policy = manifest.policies[cell.team].policy
    process = [identity.process for identity in manifest.processes]
    return command_line(
        "simulate",
        of=folder,
        point=point,
        policy=policy,
        process=process,
        replication=replication,
    )


def of_fields(origin: Origin, policy: str, values: dict[str, Any], replication: int) -> str:
    """The command that needs no results folder, and sets the fields of the scenario itself.

    Where the scenario is not a shipped one, its file may be anywhere: the command sets all fields
    that differ from the paper's scenario.

    Args:
        origin: What the results were made with.
        policy: The team.
        values: Of the mission's design point.
        replication: Of the mission.
    """
    changes = origin.study.set | values
    name = changes.pop(SEA, origin.study.scenario)
    if not is_scenario_name(name):
        name = "paper"
        paper = load_scenario("paper").model_dump(mode="json")
        fields = origin.space(values).model_dump(mode="json")
        changes = {k: v for k, v in fields.items() if k not in paper or v != paper[k]}
    settings = {key: toml_value(value) for key, value in dotted(changes).items()}
    acting = ",".join(policy.split(",")[: origin.space(values).uavs[1]])  # the others have no UAV
    which: dict[str, Any] = {"policy": acting, "seed": origin.seed, "replication": replication}
    which["process"] = [identity.process for identity in origin.processes]
    return command_line("simulate", scenario=name, set=settings, **which)
