"""Write the computed part of a model card, policies/trained/NAME/README.md.

The tool replaces the text between two marks in the file, and keeps the text around them.

    python -m benchmarks.model_cards policies/trained/ddqn --command "dess train ddqn --out DIR"
"""

import argparse
from pathlib import Path

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from dess import load_scenario, simulate_batch
from dess.analysis import load_study, numbers
from dess.analysis.answers.training.curves import read_curve
from dess.analysis.metrics import METRICS, PRODUCT
from dess.analysis.paper import values
from dess.analysis.stats.differences import compare_pairs
from dess.analysis.stats.intervals import interval_of
from dess.analysis.stats.weights import post_stratified
from dess.base.files.reading import read_text
from dess.base.files.writing import write_file
from dess.policies.learner.config import MISSION_SEED, load_config
from dess.policies.learner.description import read_description
from dess.policies.learner.trained import read_weights
from dess.policies.registry import CARD, load
from dess.policies.shipped import HEURISTICS

# The seed of the missions of model cards, which neither training nor selection of weights uses.
EVALUATION_SEED = 20_261_121
# The study whose heuristics a learned policy is compared with: those with the aim of the paper.
STUDY = "table4"
ROWS = 12  # of the learning curve
BENCHMARKS = Path(__file__).parent


def card(folder: Path, command: str, missions: int) -> str:
    """The computed part of a card, from its first mark to its last one."""
    described = read_description(folder)
    config = described.training
    if load_config(config.name, seed=config.seed) != config:
        raise SystemExit(f"{folder}: was not trained by the config of its name")
    space = load_config(config.name).space
    policy = load(folder)
    curve = read_curve(folder / "training.parquet")
    learned = simulate_batch(space, policy, EVALUATION_SEED, missions).missions
    others = {
        f"`{name}`": simulate_batch(space, load(name), EVALUATION_SEED, missions).missions
        for name in load_study(STUDY).policies
        if name in HEURISTICS
    }
    fleets = {f"{n} UAV(s)": learned[learned["uavs"] == n] for n in np.unique(learned["uavs"])}
    cases = {
        f"I = {n}": simulate_batch(
            load_scenario("fig4", uavs=n), policy, EVALUATION_SEED, missions
        ).missions
        for n in values.FIG_4
    }
    environment = Environment(
        loader=FileSystemLoader(BENCHMARKS), undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters |= {"percent": numbers.format_percent, "whole": "{:,.0f}".format}
    evaluated = {"success": "evaluation_success", "product": f"evaluation_{PRODUCT}"}
    shown = np.unique(np.linspace(0, len(curve) - 1, ROWS).round().astype(int))
    return environment.get_template("model_card.md").render(
        name=folder.name,
        command=command,
        missions=missions,
        seed=EVALUATION_SEED,
        mission_seed=MISSION_SEED,
        described=described,
        weights=sum(weight.size for weight in read_weights(folder).values()),
        curve=curve.assign(**{name: curve[of] for name, of in evaluated.items()}).iloc[shown],
        random_missions=_means({folder.name: learned} | fleets | others),
        gains={
            name: tuple(
                100 * x
                for x in compare_pairs(
                    *(_values(of, PRODUCT) for of in (learned, other)), metric=PRODUCT
                )[:3]
            )
            for name, other in others.items()
        },
        cases=_means(cases),
        paper=values,
    )


def _means(of: dict[str, np.ndarray]) -> dict[str, list[str]]:
    """Success, collection ratio and product of missions, with their intervals."""
    return {
        name: [
            numbers.format_interval(*interval_of(metric, _values(missions, metric)))
            for metric in METRICS
        ]
        for name, missions in of.items()
    }


def _values(missions: np.ndarray, metric: str) -> np.ndarray:
    return post_stratified(missions[metric].astype(float), missions["uavs"])


def main() -> None:
    """Write the computed part into the card."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--command", required=True, help="that trained it")
    parser.add_argument("--missions", type=int, default=1000)
    arguments = parser.parse_args()
    path = arguments.folder / CARD
    text = read_text(path) if path.exists() else f"# {arguments.folder.name}\n\n"
    computed = card(arguments.folder, arguments.command, arguments.missions)
    begin, *_, end = computed.splitlines()
    before, _, rest = text.partition(begin)
    write_file(path, before + computed + (rest.partition(end)[2] or "\n"))


if __name__ == "__main__":
    main()
