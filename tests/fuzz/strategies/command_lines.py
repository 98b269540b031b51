"""Command lines: every command and option that there is, with plain and with odd values."""

from functools import cache
from typing import Any

from hypothesis import strategies as st

from tests.fuzz import ready
from tests.fuzz.case import Case
from tests.fuzz.strategies import commands
from tests.fuzz.strategies.sections import FIELDS, odd_settings
from tests.fuzz.strategies.values import long_texts, numbers, texts, toml_values


@st.composite
def command_lines(draw: st.DrawFn, words: commands.Words, parameters: list[Any]) -> Case:
    """A command with some of its options, at most two of them odd."""
    chosen = draw(st.lists(st.sampled_from(parameters), max_size=5)) if parameters else []
    odd = draw(st.integers(0, 2))
    drawn = [_value(draw, words, p, n < odd) for n, p in enumerate(chosen)]
    arguments = [*commands.line(words, *drawn)]
    if draw(st.integers(0, 9)) == 0:
        arguments.insert(draw(st.integers(0, len(arguments))), draw(texts | long_texts))
    return Case("command line", tuple(arguments), ready.INPUTS, lasting=2)


def _value(
    draw: st.DrawFn, words: commands.Words, parameter: Any, is_odd: bool
) -> dict[str, str | None]:
    """A parameter with a value."""
    name = commands.name_of(words, parameter)
    if commands.is_flag(parameter):
        return {name: None}
    plain = st.sampled_from(commands.plain(words, parameter))
    value = draw(_odd(name) if is_odd and name != "--results" else plain)
    if name in commands.OUTPUTS and is_odd:  # nothing is written elsewhere
        ending = commands.ENDINGS.get(name, ("",))[0]
        value = f"../out/{value.replace('/', '').replace('..', '')}{ending}"
    return {name: value}


@cache
def _odd(name: str) -> st.SearchStrategy[str]:
    odd = st.one_of(texts, numbers, long_texts)
    if name in ("--set", "--parameter", "--price", "--target", "--require"):
        odd |= st.tuples(st.sampled_from(FIELDS) | texts, toml_values).map("=".join)
        odd |= odd_settings
    return odd
