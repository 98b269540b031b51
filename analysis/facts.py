"""An answer as facts: one list that terminal, page and JSON share, below a headline.

facts = [Fact("collection ratio", "81.5 % [80.1, 82.5]", required="at least 80 %")]
"""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Fact:
    """One line of an answer.

    Attributes:
        label: What it is about, as ``collection ratio``.
        found: What was measured, or follows from it, as ``81.5 % [80.1, 82.5]``.
        required: What was asked of it, as ``at least 80 %``; empty if nothing was.
        guaranteed: What a search guarantees of it, as ``at least 79.5 %``.
    """

    label: str
    found: str
    required: str = ""
    guaranteed: str = ""

    @property
    def line(self) -> str:
        """The fact as a line of text."""
        parts = [f"{self.label}: {self.found}"]
        if self.required:
            parts.append(f"required {self.required}")
        if self.guaranteed:
            parts.append(f"guaranteed {self.guaranteed}")
        return "; ".join(parts)


def known_facts(facts: Iterable[Fact]) -> list[Fact]:
    """The facts of which something was found."""
    return [fact for fact in facts if fact.found]
