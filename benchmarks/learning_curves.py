"""Ablation of the learner's settings: trainings that differ in one setting.

The tool trains every variant in ``VARIANTS``, a change of the shipped config ``quick``, with
several training seeds, and writes the learning curves. A training whose curve exists is not run
again. Gathering adds the trainings of the shipped policy ``SHIPPED``. The final metrics are those
of the selected weights, on missions that were used neither for training nor for selecting weights.

    export OMP_NUM_THREADS=1
    python -m benchmarks.learning_curves --out runs/learning --seeds 1 2 3
    python -m benchmarks.learning_curves --out runs/learning \\
        --gather policies/trained/curves.parquet
    python -m benchmarks.learning_curves --table policies/trained/curves.parquet
"""

import argparse
from itertools import product
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa

from dess import simulate_batch
from dess.analysis.answers.training.curves import SHIPPED, read_curves
from dess.analysis.answers.training.trained import trained_policies
from dess.analysis.metrics import METRICS, PRODUCT
from dess.base.files.reading import paths_in
from dess.base.files.tables import read_table, write_table
from dess.policies.learner.config import TrainingConfig, load_config
from dess.policies.learner.dqn import DQNTraining
from dess.policies.learner.session import choose_device
from dess.policies.registry import TRAINED, Policy, load

EVALUATION_SEED, MISSIONS = 900_000_001, 1000  # of the final evaluation


_QUICK = load_config("quick")
_ALONE: dict[str, Any] = {"phases": [_QUICK.phases[-1].model_dump() | {"ticks": _QUICK.ticks}]}
_NO_GUARD: dict[str, Any] = {"guard": False}
_NO_STARTS, _NO_RETURNS = {"low_battery_starts": 0.0}, {"early_returns": 0.0}
_NONE = _NO_GUARD | _NO_STARTS | _NO_RETURNS
_TIMES = 8  # the length of the long trainings, as a multiple of ``quick``


def _long(phases: list[dict[str, Any]]) -> dict[str, Any]:
    """Phases that are longer, evaluated less often."""
    longer = [phase | {"ticks": _TIMES * phase["ticks"]} for phase in phases]
    return {"phases": longer, "evaluate_every": 4 * _QUICK.evaluate_every}


# The settings that differ from ``quick``, by the name of the variant.
VARIANTS: dict[str, dict[str, Any]] = {
    "quick": {},
    "no transfer": _ALONE,
    "no guard": _NO_GUARD,
    "no guard, no transfer": _NO_GUARD | _ALONE,
    "no low-battery starts": _NO_STARTS,
    "no early returns": _NO_RETURNS,
    "no low-battery starts, no early returns": _NO_STARTS | _NO_RETURNS,
    "none of the three": _NONE,
    "none of the three, no transfer": _NONE | _ALONE,
    "none of the three, long": _NONE | _long([phase.model_dump() for phase in _QUICK.phases]),
    "none of the three, no transfer, long": _NONE | _long(_ALONE["phases"]),
    "1-step returns": {"n_step": 1},
    "discount 0.99": {"discount": 0.99},
    "64 environments": {"num_envs": 64, "replay": 8000},
    "maps": {"observation": "maps"},
}


def run(config: TrainingConfig) -> pd.DataFrame:
    """Train once; the curve, with the metrics of the selected weights on new missions."""
    training = DQNTraining(config, choose_device("cpu"))
    training.run_ticks(config.ticks)
    return _evaluated(pd.DataFrame(training.curve), training.make_policy(training.best), config)


def shipped() -> pd.DataFrame:
    """The curves of the trainings of the shipped policy, with its metrics on new missions."""
    curves = []
    for trained in trained_policies(TRAINED):
        if trained.config.name == SHIPPED:
            curve = trained.curve.assign(variant=SHIPPED, seed=trained.config.seed)
            curves.append(_evaluated(curve, load(trained.name), trained.config))
    return pd.concat(curves)


def _evaluated(curve: pd.DataFrame, policy: Policy, config: TrainingConfig) -> pd.DataFrame:
    missions = simulate_batch(config.space, policy, EVALUATION_SEED, MISSIONS).missions
    return curve.assign(**{f"final_{name}": float(missions[name].mean()) for name in METRICS})


def _place(curve: pa.Table) -> int:
    """The place of a curve's variant among all."""
    return [*VARIANTS].index(curve["variant"][0].as_py())


def table(curves: pd.DataFrame) -> str:
    """For each variant the final metrics in percent: mean and range over the training seeds."""
    lines = [
        "| variant | training seeds | success | collection ratio | product | lowest, highest |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for variant in curves["variant"].unique():
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
    parser.add_argument("--gather", type=Path, help="only gather all curves into this file")
    parser.add_argument("--table", type=Path, help="only print what the curves of a file say")
    arguments = parser.parse_args()
    if arguments.table:
        print(table(read_curves(arguments.table)))
        return
    if not arguments.out:
        parser.error("--out is needed")
    if arguments.gather:
        files = paths_in(arguments.out, "*.parquet")
        curves = sorted((read_table(path) for path in files), key=_place)
        curves.append(pa.Table.from_pandas(shipped(), preserve_index=False))
        write_table(arguments.gather, pa.concat_tables(curves, promote_options="permissive"))
        return
    for seed, variant in product(arguments.seeds, VARIANTS):
        path = arguments.out / f"{variant.replace(',', '').replace(' ', '-')}-{seed}.parquet"
        if not path.exists():
            curve = run(load_config("quick", seed=seed, **VARIANTS[variant]))
            curve.insert(0, "variant", variant)
            curve.insert(1, "seed", seed)
            write_table(path, pa.Table.from_pandas(curve, preserve_index=False))
            print(variant, seed, f"{curve['seconds'].iloc[-1]:.0f} s", flush=True)


if __name__ == "__main__":
    main()
