"""Sentences, names and blocks of code in Markdown, in which every value is escaped.

>>> fill_markdown("{n:,} missions of {policy}.", n=3000, policy="*mine*")
'3,000 missions of &#42;mine&#42;.'
"""

import re
from collections.abc import Iterable
from numbers import Number
from string import Formatter
from typing import Any

from IPython.display import Markdown

from dess.base.errors import printable

# What may harm in Markdown (HTML, links, formulas), and all that Markdown may take as markup,
# partly at the beginning of a line only.
_HARMFUL = re.compile(r"[<>\[\]$]|:(?=//)|(?<=www)\.")
_MARKUP = re.compile(
    rf"{_HARMFUL.pattern}|[&\\`*|~]|(?<![^\W_])_|_(?![^\W_])|^[-+=#](?!\d)|^\d+(?=[.)](\s|$))"
)


class Marked(str):
    """Markdown in which every name is escaped."""


class _Escaping(Formatter):
    """Fills a text in Markdown with values, and escapes all that are neither numbers nor marked."""

    def format_field(self, value: Any, form: str) -> str:
        shown = super().format_field(value, form)
        return shown if isinstance(value, Marked | Number) else escape_text(shown)


def write_markdown(template: str, **values: object) -> Markdown:
    """Markdown with values in it.

    ``write_markdown("{n:,} missions of {policy}", n=300, policy=name)`` is a sentence.
    """
    shown = fill_markdown(template, **values)
    return Markdown(f"\n{shown}" if shown.startswith("http") else shown)  # it would be requested


def fill_markdown(template: str, **values: object) -> Marked:
    """The text of ``write_markdown``, which is a value for another ``write_markdown``."""
    return Marked(_Escaping().vformat(template, (), values))


def escape_text(name: object) -> Marked:
    """Any text, such as a name, in Markdown: on the page it is the same text, and nothing else."""
    line = printable(re.sub(r"\s+", " ", str(name)))
    return Marked(_MARKUP.sub(_escape_character, line))


def format_code(name: object) -> Marked:
    """Any text in Markdown, set as code."""
    return Marked(f"<code>{escape_text(name)}</code>")


def escape_sentences(sentences: str) -> Marked:
    """Markdown that ``analysis`` made of its own words and of names.

    Emphasis, code and lists stay; HTML, links, images and formulas become plain text.
    """
    return Marked(_HARMFUL.sub(_escape_character, sentences))


def _escape_character(found: re.Match[str]) -> str:
    return f"&#{ord(found[0][0])};{found[0][1:]}"


def code_block(kind: str, content: str) -> Marked:
    """A block of code in Markdown; the content cannot end it."""
    fence = "`" * max(3, 1 + max(map(len, re.findall("`+", content)), default=0))
    return Marked(f"{fence}{kind}\n{content}\n{fence}")


def command_block(lines: Iterable[str]) -> Marked:
    """A block of shell commands in Markdown, to be copied at once."""
    return code_block("sh", "\n".join(lines))
