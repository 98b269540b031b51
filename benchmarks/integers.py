"""Compare ``generalist`` in integers with its float network, on missions that neither has seen.

python benchmarks/integers.py test-seas --missions 3
python benchmarks/integers.py jade-bight new-jersey paper --missions 300
python benchmarks/integers.py drawn-sheets fresh-seas-0 fresh-seas-1

Both fly the same missions. A line has the mean difference of the product (integers minus float) in
points with its 95 % interval, and the UAVs lost by each. A sea counts once.
"""

import argparse
from collections.abc import Callable, Iterable, Iterator
from functools import partial

import numpy as np
from scipy import stats

from dess.model.batch import simulate_batch
from dess.policies.learner.calibration import drawn_sheet
from dess.policies.learner.trained import load_policy, load_teacher
from dess.policies.registry import TRAINED
from dess.scenario.families import SET_FAMILIES, seas_of
from dess.scenario.scenario import ScenarioSpace, load_scenario

SEED = 20_261_201  # of the missions: those of no calibration
DRAWS = 5  # of the sets of seas that are drawn anew
DRAWN = 60  # seas or sheets of a draw
PRODUCT = "collection_ratio_and_communication"
FLEETS = (1, 2, 3)  # of shipped sheets


def fresh_seas(draw: int) -> Iterator[ScenarioSpace]:
    """Seas of all families that no training has."""
    for n in range(DRAWN):
        yield load_scenario(f"{SET_FAMILIES[n % len(SET_FAMILIES)]}:{710_000 + DRAWN * draw + n}")


SETS: dict[str, Callable[[], Iterable[ScenarioSpace]]] = {
    "test-seas": lambda: map(load_scenario, seas_of("test")),
    "drawn-sheets": lambda: (drawn_sheet(810_000 + n) for n in range(DRAWN)),
    **{f"fresh-seas-{draw}": partial(fresh_seas, draw) for draw in range(DRAWS)},
}


def main() -> None:
    """Print a line for each set of missions."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("sets", nargs="+", help=f"{', '.join(SETS)}, or a scenario")
    parser.add_argument("--missions", type=int, default=3, help="of each sea and fleet")
    arguments = parser.parse_args()
    for name in arguments.sets:
        if name in SETS:
            differences, lost = [], np.zeros(2, int)
            for space in SETS[name]():
                of_sea, lost_here = compare(space, arguments.missions)
                differences.append(of_sea.mean())
                lost += lost_here
            show(name, np.array(differences), lost)
        else:
            for label, space in fleets_of(name):
                show(label, *compare(space, arguments.missions))


def fleets_of(name: str) -> Iterator[tuple[str, ScenarioSpace]]:
    """A scenario; one with a data sheet with several fleets, each with its name."""
    if not load_scenario(name).data_sheet.is_on:
        yield name, load_scenario(name)
        return
    for uavs in FLEETS:
        yield f"{name}, {uavs} UAVs", load_scenario(name, uavs=uavs).without_weather()


def compare(space: ScenarioSpace, missions: int) -> tuple[np.ndarray, np.ndarray]:
    """The differences of the product [points], and the UAVs lost by the float network and by it."""
    acting = load_teacher(TRAINED / "generalist")[0], load_policy(TRAINED / "generalist")
    floats, integers = (simulate_batch(space, policy, SEED, missions) for policy in acting)
    lost = np.array([records.uavs["down"].sum() for records in (floats, integers)])
    return 100 * (integers.missions[PRODUCT] - floats.missions[PRODUCT]), lost


def show(label: str, differences: np.ndarray, lost: np.ndarray) -> None:
    """Print the mean difference with its interval."""
    count = len(differences)
    half = stats.t.ppf(0.975, count - 1) * differences.std(ddof=1) / np.sqrt(count)
    mean = differences.mean()
    interval = f"{mean:+.3f} [{mean - half:+.3f}, {mean + half:+.3f}]"
    print(f"{label}: {interval}, {count} compared, lost {lost[0]} and {lost[1]}", flush=True)


if __name__ == "__main__":
    main()
