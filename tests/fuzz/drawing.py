"""Draws the cases of a seed by hypothesis, in rounds; the number of a case is its place."""

import random
from collections.abc import Iterator
from itertools import count, islice

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis.strategies import SearchStrategy

from tests.fuzz.case import Case
from tests.fuzz.strategies import folders
from tests.fuzz.strategies.command_lines import command_lines
from tests.fuzz.strategies.dear import dear
from tests.fuzz.strategies.documents import documents
from tests.fuzz.strategies.outputs import outputs
from tests.fuzz.strategies.pages import pages
from tests.fuzz.strategies.signals import signals
from tests.fuzz.strategies.sizes import sizes
from tests.fuzz.strategies.trainings import trainings

# How many cases of each kind a round has. Those that start further processes are dear, so few.
ROUND: tuple[tuple[SearchStrategy[Case], int], ...] = (
    (command_lines(), 304),
    (documents(), 230),
    (folders.readings, 180),
    (folders.writings, 60),
    (pages, 50),
    (trainings, 70),
    (outputs(), 60),
    (signals(), 20),
    (sizes(), 20),
    (dear(), 6),
)
LENGTH = sum(number for _, number in ROUND)


def cases(start: int, first: int = 0) -> Iterator[tuple[int, Case]]:
    """The numbered cases of a seed, without an end, from a number on."""
    for number in count(first // LENGTH):
        drawn = [case for kind, most in ROUND for case in draw(kind, start + number, most)]
        random.Random(start + number).shuffle(drawn)
        skipped = max(first - number * LENGTH, 0)
        yield from islice(enumerate(drawn, number * LENGTH), skipped, None)


def draw(kind: SearchStrategy[Case], start: int, most: int) -> list[Case]:
    """At most so many different cases of a kind; always the same for a seed."""
    drawn: list[Case] = []

    @seed(start)
    @settings(
        database=None,
        deadline=None,
        derandomize=False,
        max_examples=most,
        phases=[Phase.generate],
        suppress_health_check=[*HealthCheck],
    )
    @given(kind)
    def collect(case: Case) -> None:
        drawn.append(case)

    collect()
    return drawn
