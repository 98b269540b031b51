"""Pages that a stranger sends, with other evidence and a checksum that fits."""

from hypothesis import strategies as st

from tests.fuzz import ready
from tests.fuzz.case import Case, Step
from tests.fuzz.steps import Bytes, Copy, Node, Page
from tests.fuzz.strategies.folders import NODES
from tests.fuzz.strategies.values import byte_edits, json_edits, positions

_PATH = f"in/{ready.PAGE}"


_path = st.just(_PATH)
_evidence = st.builds(Page, _path, positions, json_edits(), st.booleans())
_changes = st.one_of(
    *(_evidence, _evidence, _evidence),
    st.builds(Bytes, _path, byte_edits()),
    st.builds(Node, _path, st.sampled_from(NODES)),
)
_VERIFY = ("verify", f"../{_PATH}", "--missions", "2", "--seed", "1")
_EXPORT = ("study", "export", f"../in/{ready.RESULTS}", "--crate", "../out/a.zip")
_COMMANDS = (_VERIFY, _VERIFY, _VERIFY, (*_EXPORT, "--page", f"../{_PATH}"))


def _case(line: tuple[str, ...], change: Step) -> Case:
    inputs = (Copy(ready.PAGE, _PATH), Copy(ready.RESULTS, f"in/{ready.RESULTS}"))
    return Case("page", line, (*inputs, change))


# A changed page under ``verify``, or as the page of an export.
pages = st.builds(_case, st.sampled_from(_COMMANDS), _changes)
