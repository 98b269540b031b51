"""Train MAPPO or another algorithm of BenchMARL; results are written to a folder.

python examples/benchmarl_mappo.py --algorithm iql --slots 100000 --out results/benchmarl
"""

import argparse
from pathlib import Path

from benchmarl.algorithms import algorithm_config_registry
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models.mlp import MlpConfig

import dess
from dess.envs.integrations.benchmarl import FleetMeans, HarvestTask


def experiment(scenario, algorithm, slots, out, per_batch=2000, seed=0):
    """An experiment with this number of mission slots; its method ``run`` trains."""
    config = ExperimentConfig.get_from_yaml()
    config.max_n_frames, config.evaluation_interval = slots, 10 * per_batch
    config.evaluation_episodes, config.lr = 4, 3e-4
    for policy in ("on_policy", "off_policy"):
        setattr(config, f"{policy}_collected_frames_per_batch", per_batch)
        setattr(config, f"{policy}_n_envs_per_worker", 4)
    config.on_policy_n_minibatch_iters, config.off_policy_n_optimizer_steps = 4, 50
    config.loggers, config.render, config.save_folder = ["csv"], False, str(out)
    Path(out).mkdir(parents=True, exist_ok=True)
    return Experiment(
        task=HarvestTask("paper", {"scenario": scenario}),
        algorithm_config=algorithm_config_registry[algorithm].get_from_yaml(),
        model_config=MlpConfig.get_from_yaml(),
        critic_model_config=MlpConfig.get_from_yaml(),
        seed=seed,
        config=config,
        callbacks=[FleetMeans()],
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--algorithm", choices=algorithm_config_registry, default="mappo")
    parser.add_argument("--slots", type=int, default=100_000)
    parser.add_argument("--out", default="results/benchmarl")
    given = parser.parse_args()
    experiment(dess.load_scenario("paper"), given.algorithm, given.slots, given.out).run()
