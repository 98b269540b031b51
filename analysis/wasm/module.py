"""The WebAssembly module that is part of the package, and what is known of it."""

from pathlib import Path

from dess.base.files.documents import Document
from dess.base.files.reading import read_bytes

FOLDER = Path(__file__).parent
MODULE = FOLDER / "engine.wasm"
ABOUT = FOLDER / "engine.json"
MOST_BYTES = 2**22


class About(Document):
    """What is known of the module, beside it.

    Attributes:
        module: The SHA-256 hash of its bytes.
        code: A hash of the compiled functions and the types that it was built of.
        built_with: The versions of Python and of the libraries that built it, and the system.
    """

    module: str
    code: str
    built_with: dict[str, str]


def read_module() -> bytes:
    """The bytes of the module."""
    return read_bytes(MODULE, MOST_BYTES, "the module, as it was installed")
