"""The check of a panel: it is made again, and its missions are compared with those of Python."""

import gzip
import re
import zlib
from base64 import b64decode
from hashlib import sha256

from dess.analysis.wasm.module import read_module
from dess.reports.pages.panel import Panel

_HASH = r'"([0-9a-f]{64})"'
_PACKED = re.compile('(?<=type="text/plain">)([A-Za-z0-9+/=]+)(?=</script>)')
_ENCODED = re.compile("[A-Za-z0-9+/=]*")


def check_panel(panel: Panel, page: str) -> list[str]:
    """What is wrong with the panel of a page, a line for each; nothing of what it has shown counts.

    The panel is made again, with its module, its arrays and the hashes of its missions, and must
    have the same bytes. A panel of another version of the module has only its missions checked.

    Args:
        panel: What the page says that its panel is made of.
        page: The text of the page.
    """
    if is_of_another_version(panel):
        hashes = re.findall(_HASH, panel.render())
        return [
            f"mission {number} of its baseline differs"
            for number, digest in enumerate(hashes)
            if digest not in page
        ]
    if _is_in(panel.render(), page):
        return []
    return ["differs from the panel that the same settings give: its module, arrays or missions"]


def _is_in(rendered: str, page: str) -> bool:
    """Whether a page has a panel; what is packed may have been compressed in another way."""
    *parts, end = _PACKED.split(rendered)
    place = page.find(parts[0])
    if place < 0:
        return False
    for text, packed in zip(parts[::2], parts[1::2], strict=True):
        if not page.startswith(text, place):
            return False
        place += len(text)
        theirs = _ENCODED.match(page, place)
        if theirs is None or not _is_packed_as(theirs.group(), packed):
            return False
        place = theirs.end()
    return page.startswith(end, place)


def _is_packed_as(theirs: str, packed: str) -> bool:
    """Whether a packed text has the content of another; no more of it is unpacked than this has."""
    content = gzip.decompress(b64decode(packed))
    unpack = zlib.decompressobj(wbits=31)
    try:
        return unpack.decompress(b64decode(theirs), len(content) + 1) == content
    except (ValueError, zlib.error):
        return False


def is_of_another_version(panel: Panel) -> bool:
    """Whether a panel has another module than the one that is installed."""
    return panel.module != sha256(read_module()).hexdigest()
