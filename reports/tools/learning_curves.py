"""Ablation of the learner's settings: trainings that differ in one setting, with equal budgets.

The tool trains every variant in ``VARIANTS``, a change of the shipped config ``quick``, with
several training seeds, and writes the learning curves. A training whose curve exists is not run
again. The final metrics are those of the selected weights, on missions that were used neither for
training nor for selecting weights.

    export OMP_NUM_THREADS=1
    python -m reports.tools.learning_curves --out runs/learning --seeds 1 2 3
    python -m reports.tools.learning_curves --out runs/learning \\
        --gather policies/trained/curves.parquet
    python -m reports.tools.learning_curves --table policies/trained/curves.parquet
"""

import argparse
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa

from analysis.names import METRICS, PRODUCT
from analysis.questions.learning.files import read_curves
from dess import simulate_batch
from dess.files.reading import paths_in
from dess.files.tables import read_table, write_table
from policies.ddqn.config import TrainingConfig, load_config
from policies.ddqn.session import device_of
from policies.ddqn.training import Training

EVALUATION_SEED = 900_000_001


def _variants() -> dict[str, dict[str, Any]]:
    """The settings that differ from ``quick``, by the name of the variant."""
    quick = load_config("quick")
    last = quick.phases[-1].model_dump()
    alone = {"phases": [last | {"ticks": quick.ticks}]}
    no_guard: dict[str, Any] = {"guard": False}
    no_starts, no_returns = {"low_battery_starts": 0.0}, {"early_returns": 0.0}
    return {
        "quick": {},
        "no transfer": alone,
        "no guard": no_guard,
        "no guard, no transfer": no_guard | alone,
        "no low-battery starts": no_starts,
        "no early returns": no_returns,
        "no low-battery starts, no early returns": no_starts | no_returns,
        "none of the three": no_guard | no_starts | no_returns,
        "none of the three, no transfer": no_guard | no_starts | no_returns | alone,
        "1-step returns": {"n_step": 1},
        "discount 0.99": {"discount": 0.99},
        "64 environments": {"num_envs": 64, "replay": 8000},
        "nodes": {"observation": "nodes", "hidden": (64, 256, 256)},
        "maps": {"observation": "maps"},
    }


VARIANTS = _variants()


def run(config: TrainingConfig, missions: int) -> tuple[pd.DataFrame, dict[str, float]]:
    """Train once; return the curve, and the metrics of the selected weights on new missions."""
    training = Training(config, device_of("cpu"))
    training.run(config.ticks)
    policy = training.policy(training.best)
    records = simulate_batch(config.space, policy, EVALUATION_SEED, missions)
    metrics = {f"final_{name}": float(records.missions[name].mean()) for name in METRICS}
    return pd.DataFrame(training.curve), metrics


def table(curves: pd.DataFrame) -> str:
    """For each variant the final metrics in percent: mean and range over the training seeds."""
    lines = [
        "| variant | training seeds | success | collection ratio | product | lowest, highest |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for variant in [name for name in VARIANTS if name in set(curves["variant"])]:
        last = curves[curves["variant"] == variant].groupby("seed").last()
        means = [100 * last[f"final_{name}"].mean() for name in METRICS]
        products = 100 * last[f"final_{PRODUCT}"]
        cells = " | ".join(f"{mean:.1f} %" for mean in means)
        ends = f"{products.min():.1f}, {products.max():.1f}" if len(last) > 1 else ""
        lines.append(f"| {variant} | {len(last)} | {cells} | {ends} |")
    return "\n".join(lines)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="folder of the curves")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--variants", nargs="+", default=list(VARIANTS), choices=VARIANTS)
    parser.add_argument(
        "--missions", type=int, default=1000, help="missions of the final evaluation"
    )
    parser.add_argument("--gather", type=Path, help="only gather all curves into this file")
    parser.add_argument("--table", type=Path, help="only print what the curves of a file say")
    arguments = parser.parse_args()
    if arguments.table:
        print(table(read_curves(arguments.table)))
        return
    if not arguments.out:
        parser.error("--out is needed")
    if arguments.gather:
        curves = [read_table(path) for path in paths_in(arguments.out, "*.parquet")]
        write_table(arguments.gather, pa.concat_tables(curves, promote_options="permissive"))
        return
    for seed in arguments.seeds:
        for variant in arguments.variants:
            path = arguments.out / f"{variant.replace(',', '').replace(' ', '-')}-{seed}.parquet"
            if path.exists():
                continue
            config = load_config("quick", seed=seed, **VARIANTS[variant])
            curve, final = run(config, arguments.missions)
            curve.insert(0, "variant", variant)
            curve.insert(1, "seed", seed)
            curve = curve.assign(**final)
            write_table(path, pa.Table.from_pandas(curve, preserve_index=False))
            print(variant, seed, final, f"{curve['seconds'].iloc[-1]:.0f} s", flush=True)


if __name__ == "__main__":
    main()
