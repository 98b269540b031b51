"""The model described after the STRESS-DES checklist, filled in from what studies were run with.

Monks, Currie, Onggo, Robinson, Kunc, Taylor (2019), "Strengthening the reporting of empirical
simulation studies: Introducing the STRESS guidelines", Journal of Simulation 13(1), 55-67.
"""

from collections.abc import Mapping, Sequence
from importlib import metadata
from typing import Any, NamedTuple

import pandas as pd

from analysis.numbers import words
from analysis.stats.intervals import LEVEL
from dess.record import EVENT_NAMES
from dess.scenario import SAMPLED, Scenario, ScenarioSpace
from policies.registry import descriptions

Manifest = Mapping[str, Any]

SECTIONS = {
    "1": "Objectives",
    "2": "Logic",
    "3": "Data",
    "4": "Experimentation",
    "5": "Implementation",
    "6": "Code access",
}
NAMES = {
    "1.1": "Purpose of the model",
    "1.2": "Model outputs",
    "1.3": "Experimentation aims",
    "2.1": "Base model overview diagram",
    "2.2": "Base model logic",
    "2.3": "Scenario logic",
    "2.4": "Algorithms",
    "2.5.1": "Components: entities",
    "2.5.2": "Components: activities",
    "2.5.3": "Components: resources",
    "2.5.4": "Components: queues",
    "2.5.5": "Components: entry and exit points",
    "3.1": "Data sources",
    "3.2": "Pre-processing",
    "3.3": "Input parameters",
    "3.4": "Assumptions",
    "4.1": "Initialisation",
    "4.2": "Run length",
    "4.3": "Estimation approach",
    "5.1": "Software or programming language",
    "5.2": "Random sampling",
    "5.3": "Model execution",
    "5.4": "System specification",
    "6.1": "Computer model sharing statement",
}


class Item(NamedTuple):
    """An item of the checklist: its number, its name and what there is to say, as Markdown."""

    number: str
    name: str
    text: str


class Overview(NamedTuple):
    """The order of events, for ``analysis.figures.verification.slot``."""

    steps: list[tuple[str, str]]
    repeated: str
    end: str


def report(manifest: Manifest, others: Sequence[Manifest] = ()) -> list[Item]:
    """All items of the checklist.

    Args:
        manifest: Of the study whose scenario is the base model.
        others: Of further studies with the model.
    """
    space = ScenarioSpace.of(**manifest["scenario"])
    studies = [manifest, *others]
    texts = (
        _objectives(studies)
        | _logic(space, studies)
        | _components(space)
        | _data(space)
        | _experimentation(space, studies)
        | _implementation(space, manifest)
    )
    return [Item(number, name, texts[number]) for number, name in NAMES.items()]


def overview(space: ScenarioSpace) -> Overview:
    """What happens before the first mission slot, in each, and when there is another (III-C)."""
    low, high = space.initial_data
    steps = [
        ("Start", f"{_range(space.uavs)} UAVs in the zone, data {_range((low, high))} per node"),
        ("1  Actions", "every active UAV: north, east, south, west or hover"),
        ("2  Safety controller", "a move off the grid or into a taken cell: hover"),
        ("3  Pads and energy", f"+{space.charge_rate} % charging, −{space.flight_cost} % else"),
        (f"4  Communication, {space.communication_slots} times",
         "each flying UAV serves the node that it hears best"),
        ("5  Arrivals", f"Poisson, {space.arrival_rate:g} data units per node"),
        ("6  Rewards and status", f"quota of {space.quota:,} filled, battery empty, or active"),
    ]  # fmt: skip
    repeated = f"next slot, while a UAV is active; at most {space.max_slots:,}"
    return Overview(steps, repeated, "End: the record of the mission")


def parameters(space: ScenarioSpace) -> pd.DataFrame:
    """Every input parameter: ``Field``, ``Value`` and ``Meaning [unit]``."""
    fields = {**ScenarioSpace.model_fields, **Scenario.model_fields}
    rows = [(field, _value(space, field), fields[field].description) for field in fields]
    return pd.DataFrame(rows, columns=["Field", "Value", "Meaning [unit]"])


def _objectives(studies: Sequence[Manifest]) -> dict[str, str]:
    return {
        "1.1": "UAVs collect the data of sensor nodes that float at sea, over a shadowed radio "
        "channel, while new data arrive. They must recharge in time in a zone of their own, and "
        "each has a quota of communication to fill. The model measures how well policies do this, "
        "heuristic ones and learned ones, beside the figures of the paper that describes the "
        "system (Multi-UAV Trajectory Optimizer, manuscript EAAI-22-4101).",
        "1.2": "Per mission, when it has ended: *success*, whether every UAV has filled its quota; "
        "*collection ratio*, collected / (initial + arrived) data; *collection ratio and "
        "communication*, the product of the two; *reward*, summed over slots and UAVs (eq. 14-18). "
        f"Reported are means over missions with intervals at {_percent(LEVEL)}: Wilson's for "
        "success, Student's t for the others.",
        "1.3": "The studies whose results lie beside these pages:\n\n"
        + "\n".join(map(_aim, studies)),
    }


def _aim(manifest: Manifest) -> str:
    """What a study is for: its scenarios, its design and, if it optimises, how."""
    study = manifest["study"]
    rule, kind = study["selection"], (study["design"] or {}).get("kind")
    text = f"- `{study['name']}`: {study['description'] or 'no description'}. Scenario "
    text += f"`{study['scenario']}`, "
    text += f"{_count(len(manifest['points']), 'design point')}" + (f" ({kind})" if kind else "")
    text += f", policies {words(study['policies'])}"
    if rule:
        text += f"; optimised: {rule['metric']} by `{rule['procedure']}`"
    return f"{text}."


def _logic(space: ScenarioSpace, studies: Sequence[Manifest]) -> dict[str, str]:
    m = space.communication_slots
    swept = dict.fromkeys(
        field
        for manifest in studies
        for values in (manifest["study"]["set"], *(p["values"] for p in manifest["points"]))
        for field in values
    )
    flown = dict.fromkeys(
        name.strip()
        for manifest in studies
        for team in manifest["study"]["policies"]
        for name in team.split(",")
    )
    known = descriptions()
    return {
        "2.1": "The figure below: the order of events in a mission slot.",
        "2.2": f"A grid of {space.grid} x {space.grid} cells of {space.cell_size:g} m holds "
        f"{_count(len(space.nodes), 'sensor node')}, and a start and charging zone of "
        f"{space.zone[2]} x {space.zone[3]} cells. Time passes in mission slots, in which all "
        f"active UAVs act at once; each has {_count(m, 'communication slot')}, in which a UAV is "
        "on the way to its new cell and serves one node. A UAV whose battery is low may charge in "
        "the zone, and then does so until it is full enough. With its quota of "
        f"{_count(space.quota, 'communication slot')} filled, or its battery empty, it leaves the "
        "mission.",
        "2.3": "Studies change input parameters, never the logic. "
        + (
            f"Those that they set: {words([f'`{field}`' for field in swept])}."
            if swept
            else "These set none: all is drawn as the scenario says."
        ),
        "2.4": "- Safety controller: a move off the grid, or into a cell that another active UAV "
        "will occupy, becomes hovering, until nothing changes"
        + ("; so do two moves that swap cells" if space.forbid_swaps else "")
        + ".\n"
        f"- Charging: allowed in the zone, hovering, once the battery was at C<sub>S</sub> or "
        f"below (eq. 1-4); +{space.charge_rate} % a slot up to C<sub>C</sub> (eq. 8).\n"
        f"- Channel: SNR [dB] = {_number(space.edge_snr)} − "
        f"{10 * space.path_loss_exponent:g} log<sub>10</sub>(d / d<sub>edge</sub>) + η, η normal "
        f"with variance {space.shadowing_variance:g} dB², d<sub>edge</sub> half the diagonal of "
        "the grid; R = δ log<sub>2</sub>(1 + SNR) with δ = "
        f"{space.slot_length / m:g} (eq. 9-11). A UAV takes min(R, D) of the best node of those "
        "that have data D.\n"
        "- Policies: "
        + "; ".join(f"`{name}`, {known.get(name, 'of another package')}" for name in flown)
        + ".",
    }


def _components(space: ScenarioSpace) -> dict[str, str]:
    pads = _pads(space)
    waits = (
        "nobody ever waits"
        if pads >= space.uavs[1]
        else "UAVs in excess wait, and waiting costs battery like flying"
    )
    return {
        "2.5.1": f"UAVs ({_range(space.uavs)} a mission), with cell, battery, latch for charging "
        f"and communication count; sensor nodes ({len(space.nodes)}), passive, with cell and "
        "residual data.",
        "2.5.2": "Moving, hovering, charging and communicating of UAVs. The event log of a mission "
        f"has {words([f'`{name}`' for name in EVENT_NAMES])}.",
        "2.5.3": f"{_count(pads, 'charging pad')}, each held by a UAV until it is charged.",
        "2.5.4": "One queue for the pads, first come first served; UAVs that ask in the same slot "
        "queue in index order, and one that may no longer charge leaves it. With "
        f"{_count(pads, 'pad')} for {_range(space.uavs)} UAVs, {waits}.",
        "2.5.5": "UAVs enter at time 0, on distinct cells of the zone. They leave at the end of "
        "the slot in which their quota is filled or their battery is empty, or when the mission is "
        "truncated. Data enter at the nodes, at time 0 and at the end of every slot, and leave "
        "when they are collected.",
    }


def _data(space: ScenarioSpace) -> dict[str, str]:
    return {
        "3.1": "The paper's Sections II and VI-A and its Tables II and III. No data of a real "
        "system are used. Where the paper is silent or contradicts itself, a decision stands in "
        "docs/model.md, with the parameter that changes it.",
        "3.2": "There is nothing to process.",
        "3.3": "The table below: all of them. "
        + (
            f"Drawn anew for every mission, uniformly: {words(_drawn(space))}; and the initial "
            "data of every node, where they are a range."
            if _drawn(space)
            else "All are the same in every mission but the initial data of the nodes, where they "
            "are a range."
        ),
        "3.4": "- Shadowing is independent between communication slots, UAVs and nodes.\n"
        "- UAVs do not interfere with each other; each hears all nodes and knows what they hold.\n"
        f"- Nothing is lost: what is not collected stays at its node.\n"
        f"- The zone is at cells x {_range((space.zone[0], space.zone[0] + space.zone[2] - 1))}, y "
        f"{_range((space.zone[1], space.zone[1] + space.zone[3] - 1))}, and the mean SNR at half "
        f"the diagonal of the grid {_number(space.edge_snr)} dB: the paper gives neither.\n"
        f"- Two UAVs may {'not ' if space.forbid_swaps else ''}swap cells. UAVs that have left "
        "block nobody.\n"
        "- Wind, acceleration and failures of nodes and UAVs are left out.",
    }


def _experimentation(space: ScenarioSpace, studies: Sequence[Manifest]) -> dict[str, str]:
    return {
        "4.1": "A mission is a terminating simulation and starts empty of history: no warm-up. "
        f"Batteries are at {_range(space.flying_time)} %, nodes hold {_range(space.initial_data)} "
        "data units.",
        "4.2": "Until no UAV is active. After "
        f"{_count(space.max_slots, 'mission slot')} a mission is truncated, and counts as "
        "unsuccessful.",
        "4.3": "Independent replications, of which every policy and every design point of a study "
        "meets the same ones (common random numbers). Missions per policy and design point: "
        + "; ".join(f"{_missions(m)} in `{m['study']['name']}`" for m in studies)
        + ".",
    }


def _missions(manifest: Manifest) -> str:
    counts = [n for of_team in manifest["missions"] for n in of_team]
    ends = dict.fromkeys(f"{n:,}" for n in (min(counts), max(counts)))
    rule = manifest["study"]["precision"] or manifest["study"]["selection"]
    return " to ".join(ends) + (", as a rule asked for," if rule else "")


def _implementation(space: ScenarioSpace, manifest: Manifest) -> dict[str, str]:
    libraries = dict(manifest["libraries"])
    name, engine = manifest["study"]["name"], manifest["study"]["engine"]
    python = libraries.pop("python")
    about = metadata.metadata("dess")
    return {
        "5.1": f"Python {python}, `dess` {manifest['version']}, with "
        + words([f"{library} {version}" for library, version in libraries.items()])
        + ".",
        "5.2": "Counter-based: every draw is a function of seed, replication, purpose, slot, "
        "communication slot, UAV and node by Philox 4x32-10, and of nothing else; normal and "
        f"Poisson deviates by inversion. Seed {manifest['seed']}, replications from 0 on.",
        "5.3": "Two engines over the same rules: processes and events of SimPy, a process per UAV, "
        "and a compiled one that advances many missions slot by slot. Both leave the same records, "
        f"bit for bit. In a communication slot, at t + n/{space.communication_slots}, UAVs are "
        f"served in index order; ties between nodes go to the lower one. `{name}` was run by the "
        f"engine `{engine}`.",
        "5.4": "Not recorded, since no result depends on speed: one process or many, on one "
        "machine or several, leave the same bytes. `nox -s bench` measures how fast a machine is.",
        "6.1": f"`dess` is open ({about['License-Expression'] or about['License']} licence): the "
        "model, its scenarios, policies and studies, the statistics and the notebooks of these "
        f"pages are one repository, here at commit {manifest['commit'] or 'unknown'}. The results "
        f"of this page are made by `dess study run {name}`.",
    }


def _drawn(space: ScenarioSpace) -> list[str]:
    ranges = {field: getattr(space, field) for field in SAMPLED}
    return [f"`{field}` {_range(ends)}" for field, ends in ranges.items() if ends[0] < ends[1]]


def _value(space: ScenarioSpace, field: str) -> str:
    value = getattr(space, field)
    if field == "nodes":
        return _cells(value)
    if field == "pads":
        return f"{_pads(space):,}"
    if field in SAMPLED or field == "initial_data":
        return _range(value)
    if isinstance(value, bool):
        return "yes" if value else "no"
    return ", ".join(map(str, value)) if isinstance(value, tuple) else _number(value)


def _cells(nodes: Sequence[tuple[int, int]]) -> str:
    """Cells, in short where they are all combinations of columns and rows."""
    columns, rows = (sorted({node[axis] for node in nodes}) for axis in (0, 1))
    if len(columns) * len(rows) == len(nodes):
        return f"x in {_set(columns)}, y in {_set(rows)}"
    return ", ".join(f"({x}, {y})" for x, y in nodes)


def _set(numbers: Sequence[int]) -> str:
    return f"{{{', '.join(map(str, numbers))}}}"


def _pads(space: ScenarioSpace) -> int:
    return space.zone_cells if space.pads is None else space.pads


def _range(ends: tuple[float, float]) -> str:
    """``80``, or ``70 to 80``."""
    return " to ".join(dict.fromkeys(f"{end:g}" for end in ends))


def _number(value: float) -> str:
    return f"{value:,.12g}".replace("-", "−")


def _count(number: int, name: str) -> str:
    return f"{number:,} {name}{'' if number == 1 else 's'}"


def _percent(share: float) -> str:
    return f"{100 * share:g} %"
