"""Let Optuna search fleet designs; one that loses on the same replications is given up early."""

import warnings

import optuna

import dess
from dess import policies

warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)  # of the pruner

BLOCKS, BLOCK = 12, 15  # of replications, the same for every design (common random numbers)
PRICES = {"uavs": 0.08, "pads": 0.02}  # in units of the product


def search(trials: int, seed: int = 0) -> optuna.Study:
    """Ask for a design, tell what it is worth: product minus price."""
    pruner = optuna.pruners.WilcoxonPruner(p_threshold=0.05)  # paired with the best design so far
    sampler = optuna.samplers.TPESampler(seed=seed)
    study = optuna.create_study(direction="maximize", sampler=sampler, pruner=pruner)
    for trial in (study.ask() for _ in range(trials)):
        design = {"uavs": trial.suggest_int("uavs", 1, 6), "pads": trial.suggest_int("pads", 1, 4)}
        design["charge_start"] = trial.suggest_int("charge_start", 10, 50)
        design["charge_complete"] = trial.suggest_int("charge_complete", 60, 100)
        scenario, values = dess.load_scenario("paper", **design), []
        price = sum(PRICES[part] * design[part] for part in PRICES)
        while len(values) < BLOCKS and not trial.should_prune():
            replications = range(len(values) * BLOCK, (len(values) + 1) * BLOCK)
            records = dess.simulate_batch(scenario, policies.load("greedy"), seed, replications)
            values.append(records.missions["collection_ratio_and_communication"].mean() - price)
            trial.report(values[-1], step=len(values))
        pruned = optuna.trial.TrialState.PRUNED if len(values) < BLOCKS else None
        study.tell(trial, None if pruned else sum(values) / BLOCKS, state=pruned)
    return study


if __name__ == "__main__":
    best = search(trials=40).best_trial
    print(f"{best.params}: {best.value:.3f} after {best.number + 1} designs")
