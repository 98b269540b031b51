"""Draws the cases of a seed by hypothesis, in rounds; the number of a case is its place."""

import random
from collections.abc import Iterator
from itertools import count, islice

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis.strategies import SearchStrategy

from dess.reports.pages.notebook import NAMES
from tests.fuzz.case import Case
from tests.fuzz.strategies.changes import evil, odd
from tests.fuzz.strategies.command_lines import command_lines
from tests.fuzz.strategies.commands import COMMANDS, READING
from tests.fuzz.strategies.dear import dear, signals
from tests.fuzz.strategies.forged import forged
from tests.fuzz.strategies.outputs import outputs
from tests.fuzz.strategies.own_seas import own_seas
from tests.fuzz.strategies.reports import reports
from tests.fuzz.strategies.settings import duplicates, odd_fields, unfit
from tests.fuzz.strategies.sizes import sizes, work

# How many cases of each kind a round has. Those that start further processes are dear, so few.
# Every command, every parameter that reads something, and every report has its own.
ROUND: tuple[tuple[SearchStrategy[Case], int], ...] = (
    *((command_lines(words, parameters), 12) for words, parameters in COMMANDS),
    *((forged(words, parameter), 12) for words, parameter in READING),
    *((reports(name), 2) for name in NAMES),
    *((forged(*one, how), 1) for one in READING for how in (odd, odd, evil)),
    *((reports(name, how), 1) for name in NAMES for how in (odd, odd, evil)),
    (odd_fields(), 60),
    (duplicates(), 8),
    (unfit(), 30),
    (own_seas(), 30),
    (outputs(), 50),
    (signals(), 20),
    (sizes(), 20),
    (work(), 30),
    (dear(), 8),
)
LENGTH = sum(number for _, number in ROUND)


def cases(start: int, first: int = 0) -> Iterator[tuple[int, Case]]:
    """The numbered cases of a seed, without an end, from a number on."""
    for number in count(first // LENGTH):
        seeds = random.Random(start + number).sample(range(2**32), len(ROUND))
        drawn = [
            case
            for seed_of, (kind, most) in zip(seeds, ROUND, strict=True)
            for case in draw(kind, seed_of, most)
        ]
        random.Random(start + number).shuffle(drawn)
        skipped = max(first - number * LENGTH, 0)
        yield from islice(enumerate(drawn, number * LENGTH), skipped, None)


def draw(kind: SearchStrategy[Case], start: int, most: int) -> list[Case]:
    """At most so many different cases of a kind; always the same for a seed.

    The first example is always the simplest one, so it counts only if there is no other.
    """
    drawn: list[Case] = []

    @seed(start)
    @settings(
        database=None,
        deadline=None,
        derandomize=False,
        max_examples=most + 1,
        phases=[Phase.generate],
        suppress_health_check=[*HealthCheck],
    )
    @given(kind)
    def collect(case: Case) -> None:
        drawn.append(case)

    collect()
    return drawn[-most:]
