"""Commands that simulate a mission of a study again.

of_folder("results/fleets", manifest, cell, replication=17)
# dess simulate --of results/fleets --point 2 --policy greedy --replication 17
"""

import json
import shlex
from pathlib import Path
from typing import Any

from analysis.results.manifest import Cell, Manifest
from analysis.results.provenance import Origin
from dess.scenario import SEA, dotted, is_scenario_name, load_scenario


def of_folder(folder: str | Path, manifest: Manifest, cell: Cell, replication: int) -> str:
    """The command that reads all but the replication from a results folder.

    Args:
        folder: The results folder.
        manifest: What the folder is about.
        cell: The team and the design point of the mission.
        replication: Of the mission.
    """
    point = ["--point", str(cell.point)] if len(manifest.points) > 1 else []
    policy = manifest.policies[cell.team].policy
    which = [*point, "--policy", policy, "--replication", str(replication)]
    return shlex.join(["dess", "simulate", "--of", str(folder), *which])


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
    changes = origin.study["set"] | values
    name = changes.pop(SEA, origin.study["scenario"])
    if not is_scenario_name(name):
        name, paper = "paper", load_scenario("paper").model_dump(mode="json")
        fields = origin.space(values).model_dump(mode="json")
        changes = {k: v for k, v in fields.items() if k not in paper or v != paper[k]}
    settings = [w for k, v in dotted(changes).items() for w in ("--set", f"{k}={_as_toml(v)}")]
    acting = ",".join(policy.split(",")[: origin.space(values).uavs[1]])  # the others have no UAV
    which = ["--policy", acting, "--seed", str(origin.seed), "--replication", str(replication)]
    return shlex.join(["dess", "simulate", "--scenario", name, *settings, *which])


def _as_toml(value: Any) -> str:
    """A value in the syntax of TOML: as in JSON, but for tables, such as a type of UAVs."""
    if isinstance(value, list):
        return f"[{', '.join(map(_as_toml, value))}]"
    if isinstance(value, dict):
        given = {key: of_key for key, of_key in value.items() if of_key is not None}
        return f"{{{', '.join(f'{key} = {_as_toml(of_key)}' for key, of_key in given.items())}}}"
    return json.dumps(value)
