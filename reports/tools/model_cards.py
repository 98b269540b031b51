"""Write the computed part of a model card, policies/trained/NAME/README.md.

The tool replaces the text between two marks in the file, and keeps the text around them.

    python -m reports.tools.model_cards policies/trained/ddqn --command "dess train ddqn --out DIR"
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from analysis import load_study, numbers
from analysis.names import METRICS, PRODUCT
from analysis.questions.learning.files import read_curve
from analysis.replication import paper
from analysis.stats.intervals import interval_of, mean_interval
from dess import load_scenario, simulate_batch
from dess.files.reading import read_text
from dess.files.writing import write_file
from policies.about import CARD
from policies.ddqn.config import MISSION_SEED, load_config
from policies.ddqn.description import read_description
from policies.registry import HEURISTICS, load

BEGIN, END = (
    "<!-- computed by reports/tools/model_cards.py -->",
    "<!-- end of the computed part -->",
)
# The seed of the missions of model cards, which neither training nor selection of weights uses.
EVALUATION_SEED = 20_261_121
# The study whose heuristics a learned policy is compared with: those with the aim of the paper.
STUDY = "table4"


def _row(name: str, missions: np.ndarray) -> str:
    """A table row with success, collection ratio and product, and their intervals."""
    ends = [interval_of(metric, missions[metric]) for metric in METRICS]
    return f"| {name} | {' | '.join(numbers.interval(*interval) for interval in ends)} |"


HEAD = "| | success | collection ratio | product per mission |\n| --- | --- | --- | --- |"


def card(folder: Path, command: str, missions: int) -> Iterator[str]:
    """The computed part of a card, paragraph by paragraph."""
    described = read_description(folder)
    config, run = described.training, described.run
    curve = read_curve(folder / "training.parquet")
    if load_config(config.name, seed=config.seed) != config:
        raise SystemExit(f"{folder}: was not trained by the config of its name")
    space, policy = load_config(config.name).space, load(folder)
    learned = simulate_batch(space, policy, EVALUATION_SEED, missions).missions

    yield "## Training"
    phases = ", ".join(
        f"{p.name} ({p.ticks} ticks{'' if p.battery else ', no battery decrease'})"
        for p in config.phases
    )
    entries = {
        "Command": f"`{command}`",
        "Config": f"`policies/ddqn/configs/{config.name}.toml`, whole in `config.json`",
        "Observation and network": f"{config.observation}, {_count(policy):,} weights",
        "Phases": phases,
        "Hardware": f"{run.device}, {run.threads} thread(s), torch {run.torch}",
        "Wall time": f"{run.seconds / 60:.0f} min",
        "Updates": f"{run.updates:,} of {config.batch} transitions",
        "Experience": f"{run.uav_slots:,} UAV-slots",
        "Seeds": f"training {config.seed} (missions of seed {MISSION_SEED} + that); "
        f"selection {config.evaluation_seed}; evaluation below {EVALUATION_SEED}",
        "Selection": f"moving average of {config.window} evaluations of "
        f"{config.evaluation_missions} missions; best product {run.selection_score:.4f}",
    }
    yield "\n".join(f"- {name}: {text}" for name, text in entries.items())
    yield (
        "The learning curve (`training.parquet`): evaluations during training, without battery "
        "decrease in a phase without it:"
    )
    rows = curve.iloc[np.unique(np.linspace(0, len(curve) - 1, 12).round().astype(int))]
    table = ["| tick | phase | minutes | success | product |", "| --- | --- | --- | --- | --- |"]
    table += [
        f"| {r.tick} | {r.phase} | {r.seconds / 60:.0f} | {numbers.percent(r.evaluation_success)} "
        f"| {numbers.percent(getattr(r, 'evaluation_' + PRODUCT))} |"
        for r in rows.itertuples()
    ]
    yield "\n".join(table)

    yield "## Evaluation"
    yield (
        f"Means over {missions} random missions of Table II (seed {EVALUATION_SEED}, 95 % "
        f"intervals): `dess evaluate --policy {folder.name} --missions {missions} "
        f"--seed {EVALUATION_SEED}`."
    )
    others = {
        name: simulate_batch(space, load(name), EVALUATION_SEED, missions).missions
        for name in load_study(STUDY).policies
        if name in HEURISTICS
    }
    rows = [_row(folder.name, learned)]
    rows += [_row(f"{n} UAV(s)", learned[learned["uavs"] == n]) for n in np.unique(learned["uavs"])]
    rows += [_row(f"`{name}`", other) for name, other in others.items()]
    printed = " | ".join(map(numbers.percent, paper.TABLE_IV.values()))
    rows.append(f"| paper, Table IV | {printed} |")
    yield "\n".join([HEAD, *rows])
    gains = {
        name: mean_interval(100 * (learned[PRODUCT] - other[PRODUCT]))
        for name, other in others.items()
    }
    yield (
        "Points of the product more than the heuristics on the same missions, paired: "
        + ", ".join(
            f"`{name}` {g.mean:+.2f} [{g.low:.2f}, {g.high:.2f}]" for name, g in gains.items()
        )
        + "."
    )
    rows = [
        _row(f"I = {n}", simulate_batch(case, policy, EVALUATION_SEED, missions).missions)
        for n, case in ((n, load_scenario("fig4", uavs=n)) for n in (1, 2, 3))
    ]
    for n, means in paper.FIG_4.items():
        cells = " | ".join(
            numbers.percent(means[metric]) for metric in ("success", "collection_ratio")
        )
        rows.append(f"| paper, I = {n} | {cells} | not printed |")
    yield f"The cases of Fig. 4, {missions} missions each:"
    yield "\n".join([HEAD, *rows])


def _count(policy: Any) -> int:
    return sum(weight.numel() for weight in policy.network.parameters())


def main() -> None:
    """Write the computed part into the card."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--command", required=True, help="that trained it")
    parser.add_argument("--missions", type=int, default=1000)
    arguments = parser.parse_args()
    path = arguments.folder / CARD
    text = read_text(path) if path.exists() else f"# {arguments.folder.name}\n\n"
    before, _, rest = text.partition(BEGIN)
    after = rest.partition(END)[2]
    parts = card(arguments.folder, arguments.command, arguments.missions)
    computed = "\n\n".join([BEGIN, *parts, END])
    write_file(path, before + computed + (after or "\n"))


if __name__ == "__main__":
    main()
