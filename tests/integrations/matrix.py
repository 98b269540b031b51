"""The matrix of ``docs/environments.md``: what was checked in which library, from pytest's reports.

    python -m tests.integrations.matrix build/integrations

The folder has the JUnit report of every test file of a library, ``NAME.xml`` of ``test_NAME.py``.
The command ends with 1 if a check failed or is missing.
"""

import sys
from pathlib import Path
from xml.etree import ElementTree

CHECK = "test_contract"  # in every library
PAGE = Path("docs/environments.md")
BEGIN, END = "<!-- matrix: begin -->", "<!-- matrix: end -->"
YES, FAILED, MISSING = "yes", "**failed**", "**missing**"
UNWANTED = ("errors", "failures", "skipped")
NO_ENVIRONMENT = {"rliable"}  # it reads results


def row(suite: ElementTree.Element, name: str) -> list[str]:
    """The cells of a library: its name, its version, and the outcome of the check."""
    distribution, version = _library(suite) or (name, MISSING)
    same = distribution == name.replace("_", "-")
    title = f"`{distribution}`" if same else f"`{name}` (`{distribution}`)"
    return [title, version, _outcome(suite)]


def _library(suite: ElementTree.Element) -> list[str] | None:
    """The distribution and its version; None if the library was not found."""
    library = suite.find("properties/property[@name='library']")
    return None if library is None else library.attrib["value"].split()


def _outcome(suite: ElementTree.Element) -> str:
    """The outcome of the check, of all cases of it together."""
    cases = [case for case in suite.iter("testcase") if case.attrib["name"].split("[")[0] == CHECK]
    if any(case.find(kind) is not None for case in cases for kind in ("failure", "error")):
        return FAILED
    ran = cases and not any(case.find("skipped") is not None for case in cases)
    return YES if ran else MISSING


def table(rows: list[list[str]]) -> str:
    """The matrix as a table of Markdown."""
    head = [["library", "version", "contract"], ["---"] * 3]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in head + rows)


def main(folder: Path) -> int:
    """Write the matrix into the page; 1 if a test failed or a check is missing."""
    suites = {path.stem: _suite(path) for path in sorted(folder.glob("*.xml"))}
    failed = any(int(suite.attrib[kind]) for suite in suites.values() for kind in UNWANTED)
    rows = [row(suite, name) for name, suite in suites.items() if name not in NO_ENVIRONMENT]
    before, rest = PAGE.read_text("utf-8").split(BEGIN)
    _, after = rest.split(END)
    PAGE.write_text(f"{before}{BEGIN}\n\n{table(rows)}\n\n{END}{after}", "utf-8")
    return int(failed or any(MISSING in cells for cells in rows))


def _suite(report: Path) -> ElementTree.Element:
    """The only suite of a report."""
    [suite] = ElementTree.parse(report).getroot()
    return suite


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
