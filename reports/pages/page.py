"""A finished page as a value: its text, its checksum, and the data that are hidden in it."""

import re
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

from dess import InputError
from dess.analysis.results.evidence import Evidence
from dess.base.files.documents import Document
from dess.base.files.reading import read_text

if TYPE_CHECKING:
    from markupsafe import Markup

# What is hidden in a page.
STUDY, FILES, CARD, PANEL = "dess-study", "dess-files", "dess-card", "dess-panel"
LARGEST = 512 * 2**20  # bytes of a page that is shown in an index
LIMIT = 64 * 2**20  # bytes of a page that is verified
PAGE_FORM = "a page of dess report"
# The place in a page that contains the checksum of the rest of the page.
_SEAL = re.compile(r'(<meta name="dess-checksum" content=")([0-9a-f]*)(">)')
_BAR, _END = "<!--bar-->", "<!--/bar-->"  # stand around the links to the other pages


class Picture(Document):
    """A drawing as a page contains it: its alternative text, and its address for two widths."""

    alt: str
    source: str
    narrow: str


class Learned(Document):
    """The files of learned policies, with their hashes."""

    files: dict[str, str]

    @property
    def hidden(self) -> "Markup":
        """What a page contains of them, and does not show."""
        return hidden_element(FILES, self.model_dump_json())


class Card(Document):
    """What a page tells others: its question and, in one sentence, what it found.

    Attributes:
        title: The question.
        finding: The sentence.
        number: The number of the answer, which the index shows large; may be empty.
        picture: The figure that shows the answer, if the index shows it too.
        key: What the page depends on; empty if it has other parameters than by default.
    """

    title: str
    finding: str
    number: str = ""
    picture: Picture | None = None
    key: str = ""

    @property
    def hidden(self) -> "Markup":
        """What a page contains of the card, and does not show."""
        return hidden_element(CARD, self.model_dump_json())


def hidden_element(kind: str, text: str) -> "Markup":
    """An element with a JSON text that a page contains and does not show."""
    inert = text.replace("<", "\\u003c")  # so that the text cannot end the element
    from markupsafe import Markup  # missions are checked without the libraries that render pages

    return Markup(f'<script class="{kind}" type="application/json">{inert}</script>')


@dataclass(frozen=True)
class Page:
    """A page, or the index of pages.

    Attributes:
        text: Its HTML.
        where: Its place, for messages.
        allowed: What messages say is allowed in its place.
    """

    text: str
    where: str = "page"
    allowed: str = PAGE_FORM

    @classmethod
    def read(cls, path: Path, limit: int = LARGEST, allowed: str = PAGE_FORM) -> "Page":
        """Read a page of at most so many bytes from a file."""
        return cls(read_text(path, limit, allowed=allowed), str(path), allowed)

    @property
    def has_seal(self) -> bool:
        """Whether it has a checksum."""
        return _SEAL.search(self.text) is not None

    @property
    def is_sealed(self) -> bool:
        """Whether the checksum is that of the text."""
        return self.has_seal and self.sealed.text == self.text

    @property
    def sealed(self) -> "Page":
        """The page with its checksum filled in."""
        checksum = sha256(_SEAL.sub(r"\g<1>\g<3>", self.text, count=1).encode()).hexdigest()
        return Page(_SEAL.sub(rf"\g<1>{checksum}\g<3>", self.text, count=1))

    @property
    def card(self) -> Card:
        """Its card, or an ``InputError`` if it has none."""
        return Card.parse("".join(self.find_hidden(CARD)[:1]), self.where, self.allowed)

    @property
    def evidence(self) -> list[Evidence]:
        """The evidence of its studies, or an ``InputError`` if it is not valid."""
        return [Evidence.parse(text, self.where, self.allowed) for text in self.find_hidden(STUDY)]

    @property
    def learned(self) -> list[Learned]:
        """Its lists of files of learned policies, or an ``InputError`` if one is not valid."""
        return [Learned.parse(text, self.where, self.allowed) for text in self.find_hidden(FILES)]

    def find_hidden(self, kind: str) -> list[str]:
        """The distinct JSON texts of a kind, such as ``STUDY``, that are hidden in the page."""
        texts = re.findall(f'<script class="{kind}" [^>]*>(.*?)</script>', self.text, re.S)
        return list(dict.fromkeys(texts))

    def replace_bar(self, bar: str) -> "Page":
        """The page with links to all pages of its folder, sealed again."""
        before, begin, rest = self.text.partition(_BAR)
        return Page(f"{before}{begin}{bar}{_END}{rest.partition(_END)[2]}").sealed


def has_key(path: Path, key: str) -> bool:
    """Whether a file is a page with this key that has not been altered."""
    try:
        page = Page.read(path)
        return bool(key) and page.card.key == key and page.is_sealed
    except (OSError, InputError):
        return False
