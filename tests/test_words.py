"""Docstrings, comments, messages, pages and docs use the field's terms, and no private words."""

import io
import re
import tokenize
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FLOORS = ("dess", "policies", "analysis", "reports")
# What readers stumbled over, as a pattern, and what is written instead.
PRIVATE = {
    r"flown": "simulated",
    r"dearer": "more expensive",
    r"(un)?lucky?": "by chance",
    r"(?<!shipping[ -])lanes?": "panel",
    r"nobody": "no UAV, no reader",
    r"anew": "again",
    r"reckons? with": "takes into account",
    r"as of ``": "as for, the result of",
    r"alike": "equal, the same",
}
PATTERNS = {re.compile(rf"\b{word}(\b|(?<=`))", re.I): term for word, term in PRIVATE.items()}
# From Python 3.12 on, the text of an f-string is a token of its own.
TEXT = (tokenize.COMMENT, tokenize.STRING, getattr(tokenize, "FSTRING_MIDDLE", -1))


@cache
def words_in(path: Path) -> str:
    """The text of a file that people read: of Python, only strings and comments."""
    source = path.read_text("utf-8")
    if path.suffix != ".py":
        return source
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    return "\n".join(token.string for token in tokens if token.type in TEXT)


FILES = [
    *(ROOT / "docs").rglob("*.md"),
    ROOT / "README.md",
    *(path for floor in FLOORS for path in (ROOT / floor).rglob("*.py")),
    *(ROOT / "reports" / "templates").glob("*.*"),
]


@pytest.mark.parametrize("floor", ["docs", "README.md", *FLOORS])
def test_no_private_word_is_used(floor):
    found = [
        f"{path.relative_to(ROOT)}: {match.group()!r} (write: {term})"
        for path in FILES
        if path.relative_to(ROOT).parts[0] == floor
        for pattern, term in PATTERNS.items()
        for match in pattern.finditer(words_in(path))
    ]
    assert found == []
