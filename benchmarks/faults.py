"""Faults planted by hand in compiled functions, and which oracles of the tests catch them.

Thirty are in the rules, the channel, charging, ages, energy and the guard; four in observations and
in the bound.

``python benchmarks/faults.py`` copies the tree, runs the tests of each oracle in the copy, which
must pass, and then plants one fault after the other; ``--fault NAME`` and ``--oracle NAME`` choose
some of them. ``benchmarks/faults.csv`` has what was found until now: the first test of each oracle
that failed, ``none``, or nothing where that oracle was not run; faults that it lacks were not
planted yet. A fault takes about a minute of one core for the first three oracles.
``benchmarks/mutants.py`` leaves compiled functions out.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import pandas as pd

ROOT = Path(__file__).parents[1]


class Fault(NamedTuple):
    """A fault: in a file, one text in place of another, which stands there once."""

    name: str
    file: str
    old: str
    new: str

    @contextmanager
    def planted(self, root: Path) -> Iterator[None]:
        """A copy of the tree has the fault meanwhile."""
        path = root / self.file
        source = path.read_text("utf-8")
        path.write_text(self.change(source), "utf-8")
        yield
        path.write_text(source, "utf-8")

    def change(self, source: str) -> str:
        """The source of the file with the fault.

        Raises:
            ValueError: If the source has not the old text once.
        """
        count = source.count(self.old)
        if count != 1:
            raise ValueError(f"{self.name}: {self.file} has its text {count} times")
        return source.replace(self.old, self.new)


RULES, CHANNEL = "dess/model/rules.py", "dess/model/channel.py"
LINK = "dess/model/link.py"
CHARGING, AGE, ENERGY = "dess/physics/charging.py", "dess/physics/age.py", "dess/physics/energy.py"
BATTERY, MOVES = "dess/model/guard/battery.py", "dess/model/guard/moves.py"
SETS, PATHS = "dess/envs/observations/sets.py", "analysis/bound/paths.py"
MATCHING = "dess/model/guard/matching.py"

FAULTS = (
    # Rules.
    Fault(
        "a swap counts as a collision where swaps are allowed",
        RULES,
        "        mission.forbid_swaps != 0\n        and other.executed",
        "        mission.forbid_swaps == 0\n        and other.executed",
    ),
    Fault(
        "a cancelled move does not cancel those that it blocks",
        RULES,
        "                _cancel(u)\n                changed = True",
        "                _cancel(u)\n                changed = False",
    ),
    Fault(
        "a move that was overruled starts charging",
        RULES,
        "return is_ready and u.action == HOVER and u.zone >= 0",
        "return is_ready and u.executed == HOVER and u.zone >= 0",
    ),
    Fault(
        "a UAV that leaves the queue keeps the slot of its request",
        RULES,
        "            elif not may_charge(mission, u):\n                u.pad_request = -1",
        "            elif not may_charge(mission, u):\n                u.pad_request += 0",
    ),
    Fault(
        "a charge adds to a battery beyond C_C",
        RULES,
        "added = min(added, charge_limit(mission, u) - u.battery)",
        "added = min(added, charge_limit(mission, u) + 1 - u.battery)",
    ),
    Fault(
        "a UAV takes more data than a node has",
        RULES,
        "amount = min(channel.rate(mission, snr) * u.rate, residual[node])",
        "amount = channel.rate(mission, snr) * u.rate",
    ),
    Fault(
        "the rate of a type of UAVs is left out",
        RULES,
        "channel.rate(mission, snr) * u.rate",
        "channel.rate(mission, snr)",
    ),
    Fault(
        "data arrive one node late",
        RULES,
        "word = batch.words[k % 4, block]",
        "word = batch.words[(k + 1) % 4, block]",
    ),
    Fault(
        "the arrivals of a slot are not in the total",
        RULES,
        "            mission.arrived += arrivals[k]\n",
        "            mission.arrived += 0.0\n",
    ),
    Fault(
        "initial data are drawn with a larger spread",
        RULES,
        "residual[k] = low + (high - low) * streams.uniform(words[k % 4])",
        "residual[k] = low + high * streams.uniform(words[k % 4])",
    ),
    # Channel.
    Fault(
        "the altitude is left out of the distance",
        LINK,
        "distance = hypot(horizontal, link.altitude)",
        "distance = hypot(horizontal, 0.0)",
    ),
    Fault(
        "a path loss that is a fifth too small",
        LINK,
        "loss = 10 * link.path_loss_exponent",
        "loss = 8 * link.path_loss_exponent",
    ),
    Fault(
        "on a tie the node with the highest index is served",
        CHANNEL,
        "if snr > best or (snr == best and k < node):",
        "if snr > best or (snr == best and k > node):",
    ),
    Fault(
        "the search ends before a node that may be better",
        CHANNEL,
        "if batch.rest + reach < best or",
        "if batch.rest < best or",
    ),
    Fault(
        "a UAV is a communication slot ahead on its way",
        CHANNEL,
        "ahead = (u.slots_left * m + m - 1 - n) * part",
        "ahead = (u.slots_left * m + m - 2 - n) * part",
    ),
    Fault(
        "the largest rate does not hold",
        CHANNEL,
        "return min(shannon, mission.max_rate)",
        "return shannon",
    ),
    # Charging.
    Fault(
        "the queue prefers the highest battery",
        CHARGING,
        "return u.battery < other.battery",
        "return u.battery > other.battery",
    ),
    Fault(
        "what a fractional rate adds is rounded up",
        CHARGING,
        "return k * mission.charge_rate // mission.charge_slots",
        "return -(-k * mission.charge_rate // mission.charge_slots)",
    ),
    Fault(
        "a UAV on a pad takes power that is not left",
        CHARGING,
        "added = min(gain(mission, u, u.charge_slots + 1), lacking, left)",
        "added = min(gain(mission, u, u.charge_slots + 1), lacking)",
    ),
    # Age.
    Fault(
        "the age falls to that of the slot before",
        AGE,
        "    mission.newest += now - sensor.newest\n    sensor.newest = now",
        "    mission.newest += now - sensor.newest\n    sensor.newest = now - 1.0",
    ),
    Fault(
        "the mean age leaves the last part out",
        AGE,
        "return (sensor.age_area + at_end * at_end / 2.0)",
        "return (sensor.age_area + at_end / 2.0)",
    ),
    # Energy.
    Fault(
        "what is left of a percent is lost",
        ENERGY,
        "    u.remainder = spent % PERCENT",
        "    u.remainder = 0",
    ),
    Fault(
        "a move costs what hovering does",
        ENERGY,
        "cost = slot_cost_at(mission, u.slots_per_cell, u.executed, u.x, u.y)",
        "cost = slot_cost_at(mission, u.slots_per_cell, HOVERING, u.x, u.y)",
    ),
    Fault(
        "gusts blow from the other side",
        ENERGY,
        "        return mean + gusts * streams.normal(words[1])",
        "        return mean - gusts * streams.normal(words[1])",
    ),
    # Guard.
    Fault(
        "the guard keeps no margin for teammates",
        BATTERY,
        "return _slot_of_detour(mission, u) * margin_slots(mission, u)",
        "return 0 * _slot_of_detour(mission, u) * margin_slots(mission, u)",
    ),
    Fault(
        "the guard forgets the slot of the charge",
        MOVES,
        "late = max(needed + waiting_slot(mission) + kept - usable_battery(mission, u), 0)",
        "late = max(needed - 2 * waiting_slot(mission) + kept - usable_battery(mission, u), 0)",
    ),
    Fault(
        "the guard does not wait for a pad",
        MOVES,
        "reserve = margin(mission, u) + waiting_slot(mission) * home.wait if charge else 0",
        "reserve = margin(mission, u) if charge else 0",
    ),
    Fault(
        "the guard matches the cells by the plain ways",
        MATCHING,
        "prices[j, place] = bounded * bounded",
        "prices[j, place] = bounded",
    ),
    Fault(
        "a UAV in a queue may leave it",
        MOVES,
        "return u.pad_request >= 0 or (lands(mission) and parked)",
        "return lands(mission) and parked",
    ),
    Fault(
        "nobody stays in a zone shortly before the end",
        BATTERY,
        "mission.max_slots - mission.slot <= LAST_SLOTS",
        "mission.max_slots - mission.slot <= 0 * LAST_SLOTS",
    ),
    # Observations, and the bound of what a mission can collect.
    Fault(
        "teammates that charge are near nodes, too",
        SETS,
        "if j != i and team[j, column.ACTIVE] and not team[j, column.CHARGING]:",
        "if j != i and team[j, column.ACTIVE]:",
    ),
    Fault(
        "a zone that is nearer counts as farther",
        SETS,
        "line[23] = _share(home - own_home, 20)",
        "line[23] = _share(own_home - home, 20)",
    ),
    Fault(
        "the bound reaches a cell a slot too late",
        PATHS,
        "to_zone[x, y] <= radius",
        "to_zone[x, y] < radius",
    ),
    Fault(
        "the bound forgets what arrives at the node that is left",
        PATHS,
        "    least += left * (then_had[home] - had[home])\n",
        "",
    ),
)
# The tests of each oracle. ``tests/verification/stress_des.py`` is none: it describes the model in
# the form of a checklist, and runs no mission. No fault of a rule is caught by ``plain_sets`` or
# ``tiny_sea`` alone: they stay for observations as sets and for the bound, where nothing else says
# what is right.
ORACLES = {
    "auditor": ("tests/dess/model/test_auditor.py",),
    "by hand": ("tests/dess/model/test_missions.py",),
    "closed forms": ("tests/verification/test_theory.py",),
    "plain_sets": ("tests/dess/envs/observations/test_sets.py",),
    "tiny_sea": ("tests/analysis/bound/test_optimum.py", "tests/analysis/bound/test_prices.py"),
    "guard": (
        "tests/dess/model/guard/test_guard.py",
        "tests/dess/model/guard/test_queues.py",
        "tests/dess/model/guard/test_matching.py",
    ),
    # No oracle, but tests of one rule each, which catch what the auditor cannot see.
    "single rules": (
        "tests/dess/model/test_engines.py",
        "tests/dess/model/test_randomness.py",
        "tests/dess/model/test_ties.py",
        "tests/dess/physics/test_energy.py",
        "tests/dess/physics/test_fleet.py",
        "tests/analysis/results/test_event_log.py",
    ),
}


def copy_tree(folder: Path) -> Path:
    """Copy what git knows of the tree, its links as links."""
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    for name in listed.stdout.split("\0")[:-1]:
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, target, follow_symlinks=False)
    return folder


def failed_tests(oracles: Sequence[str], root: Path) -> dict[str, str]:
    """For each oracle its first test that fails in a copy of the tree; empty if none does.

    What a fault does not touch is compiled once for all faults, as they share one copy.

    Raises:
        RuntimeError: If the tests could not be run.
    """
    environment = os.environ | {
        "PYTHONPATH": str(root),
        "NUMBA_CACHE_DIR": str(root / "build" / "numba"),
        "NUMBA_OPT": "1",
    }
    command = [sys.executable, "-m", "pytest", "-q", "-n0", "-p", "no:cacheprovider", "--tb=no"]
    command += ["--hypothesis-profile=planted", *(file for o in oracles for file in ORACLES[o])]
    tests = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True)
    if tests.returncode not in (0, 1):
        raise RuntimeError(f"pytest ended with exit code {tests.returncode}: {tests.stdout[-500:]}")
    failed = re.findall(r"^(?:FAILED|ERROR) (.+?)::(.+?)(?: - .*)?$", tests.stdout, re.MULTILINE)
    return {
        oracle: next((test for file, test in failed if file in ORACLES[oracle]), "")
        for oracle in oracles
    }


def main() -> None:
    """Plant the faults, and print which oracle catches which."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fault", action="append", help="a part of its name; repeatable")
    parser.add_argument("--oracle", action="append", choices=ORACLES)
    parser.add_argument("--out", type=Path, default=Path("faults.csv"))
    options = parser.parse_args()
    chosen, oracles = options.fault or [""], options.oracle or [*ORACLES]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        root = copy_tree(Path(folder))
        if any((failed := failed_tests(oracles, root)).values()):
            raise RuntimeError(f"tests fail without a fault: {failed}")
        for fault in (f for f in FAULTS if any(part in f.name for part in chosen)):
            with fault.planted(root):
                failed = failed_tests(oracles, root)
            found = {oracle: test or "none" for oracle, test in failed.items()}
            rows.append({"fault": fault.name, "file": fault.file} | found)
            pd.DataFrame(rows).to_csv(options.out, index=False)
            caught = [oracle for oracle, test in failed.items() if test]
            print(fault.name, ", ".join(caught) or "no oracle", sep=": ", flush=True)


if __name__ == "__main__":
    main()
