"""What each means of learning is worth: trainings that differ in one setting, same budget.

Runs the variants of ``VARIANTS`` from the shipped config ``quick``, each with several training
seeds, and gathers their curves in one table. A training whose curve is already there is not run
again. With ``--table`` it prints what the curves say instead: the product of the selected weights
on missions that no training and no selection has seen.

    python benchmarks/learning.py --out runs/learning --seeds 1 2 3
    python benchmarks/learning.py --out runs/learning --gather policies/trained/curves.parquet
"""

import argparse
from pathlib import Path
from typing import Any

import pandas as pd
import torch

from dess import load_scenario, simulate_batch
from policies.ddqn.config import TrainingConfig, load_config
from policies.ddqn.training import Training

EVALUATION_SEED = 900_000_001


def _variants() -> dict[str, dict[str, Any]]:
    """Name -> settings that differ from those of ``quick``."""
    quick = load_config("quick")
    last = quick.phases[-1].model_dump()
    alone = {"phases": [last | {"ticks": quick.ticks}]}
    means = {"guard": False, "low_battery_starts": 0.0, "early_returns": 0.0}
    return {
        "quick": {},
        "no transfer": alone,
        "no guard": {"guard": False},
        "no low-battery starts": {"low_battery_starts": 0.0},
        "no early returns": {"early_returns": 0.0},
        "neither of both": {"low_battery_starts": 0.0, "early_returns": 0.0},
        "none of the three": means,
        "none of the three, no transfer": means | alone,
        "1-step returns": {"steps": 1},
        "discount 0.99": {"discount": 0.99},
        "64 lanes": {"lanes": 64, "replay": 8000},
        "relations": {"observation": "relations", "hidden": (64, 256, 256)},
        "maps": {"observation": "maps"},
    }


VARIANTS = _variants()


def run(config: TrainingConfig, missions: int) -> tuple[pd.DataFrame, dict[str, float]]:
    """The curve of a training, and the metrics of its selected weights on unseen missions."""
    training = Training(config, torch.device("cpu"))
    training.run(config.ticks)
    policy = training.policy(training.best)
    records = simulate_batch(load_scenario(config.scenario), policy, EVALUATION_SEED, missions)
    names = ("success", "collection_ratio", "collection_ratio_and_communication")
    metrics = {f"final_{name}": float(records.missions[name].mean()) for name in names}
    return pd.DataFrame(training.curve), metrics


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the curves")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--variants", nargs="+", default=list(VARIANTS), choices=VARIANTS)
    parser.add_argument("--missions", type=int, default=1000, help="of the final evaluation")
    parser.add_argument("--gather", type=Path, help="only gather all curves into this file")
    arguments = parser.parse_args()
    if arguments.gather:
        files = sorted(arguments.out.glob("*.parquet"))
        pd.concat(map(pd.read_parquet, files)).to_parquet(arguments.gather, index=False)
        return
    torch.set_num_threads(1)
    arguments.out.mkdir(parents=True, exist_ok=True)
    for seed in arguments.seeds:
        for variant in arguments.variants:
            path = arguments.out / f"{variant.replace(',', '').replace(' ', '-')}-{seed}.parquet"
            if path.exists():
                continue
            config = load_config("quick", seed=seed, **VARIANTS[variant])
            curve, final = run(config, arguments.missions)
            curve.insert(0, "variant", variant)
            curve.insert(1, "seed", seed)
            curve.assign(**final).to_parquet(path, index=False)
            print(variant, seed, final, f"{curve['seconds'].iloc[-1]:.0f} s", flush=True)


if __name__ == "__main__":
    main()
