"""Tries cases for some minutes and prints what breaks the contract: ``python -m tests.fuzz``."""

import argparse
import os
import random
import resource
import shlex
import shutil
import sys
import time
from collections import Counter
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

from tests.fuzz import drawing, ready
from tests.fuzz.case import Case
from tests.fuzz.forks import Forks, Outcome
from tests.fuzz.judge import CODES, findings

FOLDER = Path("build/fuzz")
LEAST = 20  # cases that are tried however long they take
MEMORY = 6 * 2**30  # bytes that the session itself may take; cases have a limit of their own


def main() -> int:
    """Try cases until the time is over; the exit code is 1 if one breaks the contract."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--minutes", type=float, default=10, help="how long (default: 10)")
    parser.add_argument("--seed", type=int, help="seed of the cases (default: a random number)")
    parser.add_argument("--case", type=int, help="try only the case of this number")
    asked = parser.parse_args()
    seed = random.SystemRandom().randrange(10**6) if asked.seed is None else asked.seed
    hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, hard))
    os.environ["OMP_NUM_THREADS"] = "1"  # threads of a case would be in the way of the other
    print(f"seed {seed}: cases for {asked.minutes:g} minutes", flush=True)
    forks = Forks(FOLDER.absolute())
    for folder in (forks.cases, forks.ready) if asked.case is not None else (FOLDER,):
        shutil.rmtree(folder, ignore_errors=True)
    ready.make(forks)
    drawn = drawing.cases(seed, asked.case or 0)
    if asked.case is not None:
        drawn = islice(drawn, 1)
    return Session(seed, asked.minutes * 60).run(forks, drawn)


class Session:
    """A session: its seed, what was tried, and what was found."""

    def __init__(self, seed: int, seconds: float) -> None:
        self.seed, self.seconds = seed, seconds
        self.kinds, self.codes = Counter[str](), Counter[str]()
        self.found = 0

    def run(self, forks: Forks, cases: Iterator[tuple[int, Case]]) -> int:
        """Try cases, print the findings and the counts, and return the exit code."""
        began = time.monotonic()
        end = began + self.seconds
        for number, outcome in forks.outcomes(_until(end, cases)):
            self.kinds[outcome.case.kind] += 1
            self.codes[f"{outcome.code} ({CODES.get(outcome.code, 'killed')})"] += 1
            if broken := findings(outcome):
                self.found += 1
                self._report(number, outcome, broken)
            else:
                shutil.rmtree(outcome.box)
        minutes = (time.monotonic() - began) / 60
        total = self.kinds.total()
        print(f"seed {self.seed}: {total:,} cases in {minutes:.1f} minutes ", end="")
        print(f"({total / minutes:,.0f} a minute), {self.found} findings")
        print("kinds:", ", ".join(f"{kind} {n:,}" for kind, n in self.kinds.most_common()))
        print("exit codes:", ", ".join(f"{code} {n:,}" for code, n in self.codes.most_common()))
        return 1 if self.found else 0

    def _report(self, number: int, outcome: Outcome, broken: list[str]) -> None:
        """Print a finding, and keep its files."""
        kept = FOLDER / str(number)
        shutil.rmtree(kept, ignore_errors=True)
        outcome.box.rename(kept)
        again = f"python -m tests.fuzz --seed {self.seed} --case {number}"
        command = shlex.join(["dess", *outcome.case.arguments])
        lines = [
            f"case {number} ({outcome.case.kind}, exit code {outcome.code}): {again}",
            f"  {_short(command)}",
            *(f"  {_short(repr(step))}" for step in outcome.case.steps[-2:]),
            *(f"  - {_short(line)}" for line in broken),
        ]
        (kept / "case.txt").write_bytes(
            "\n".join([*lines, command, *map(repr, outcome.case.steps)]).encode("utf-8", "replace")
        )
        print("\n".join(lines), flush=True)


def _until(end: float, cases: Iterator[tuple[int, Case]]) -> Iterator[tuple[int, Case]]:
    for tried, case in enumerate(cases):
        if tried >= LEAST and time.monotonic() > end:
            return
        yield case


def _short(text: str) -> str:
    printable = text if text.isprintable() else ascii(text)[1:-1]
    return printable if len(printable) <= 300 else f"{printable[:200]} ... {printable[-90:]}"


if __name__ == "__main__":
    sys.exit(main())
