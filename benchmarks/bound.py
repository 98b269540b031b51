"""What the relaxations of the upper bound cost, one changed at a time (analysis/bound/proof.md).

    python benchmarks/bound.py --missions 20 --seed 777001

Missions of a lone UAV in the paper's scenario. Prints the mean bound and the CPU time per mission
of each variant.
"""

import argparse
import time

import numpy as np

from dess import load_scenario
from dess.analysis.bound.prices import ITERATIONS, Detail, improve_prices, known_of

FINE = tuple(np.linspace(0, 1, 15))
VARIANTS = {
    "as it is": Detail(),
    "no memory of the block before": Detail(levels=(0,)),
    "the block before at one local price": Detail(levels=(0, 7)),
    "no allowance: prices alone": Detail(local=(0.0,), levels=(0,)),
    "four local prices": Detail(local=(0.0, 0.33, 0.66, 1.0), levels=(0, 2, 3)),
    "fifteen local prices": Detail(local=FINE, levels=(0, 7, 14)),
    "eleven local prices": Detail(local=tuple(np.linspace(0, 1, 11)), levels=(0, 5, 10)),
    "fifteen local prices, four for the block before": Detail(local=FINE, levels=(0, 5, 10, 14)),
    "no cut before the end": Detail(cuts=()),
    "three cuts before the end": Detail(cuts=(0.25, 0.5, 0.75)),
}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--missions", type=int, default=20)
    parser.add_argument("--seed", type=int, default=777001)
    parser.add_argument("--iterations", type=int, default=ITERATIONS)
    given = parser.parse_args()
    space = load_scenario("paper", uavs=1)
    known = [known_of(space, given.seed, number) for number in range(given.missions)]
    improve_prices(known[0], 1, Detail())  # compiles
    print("| variant | mean bound [%] | difference | CPU [s] |\n| --- | --- | --- | --- |")
    first = None
    for name, detail in VARIANTS.items():
        start = time.process_time()
        ratios = [improve_prices(mission, given.iterations, detail).ratio for mission in known]
        seconds = (time.process_time() - start) / len(known)
        mean = 100 * float(np.mean(ratios))
        first = mean if first is None else first
        print(f"| {name} | {mean:.1f} | {mean - first:+.1f} | {seconds:.1f} |", flush=True)


if __name__ == "__main__":
    main()
