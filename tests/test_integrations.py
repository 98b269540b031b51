"""The matrix of libraries: the page has the current one."""

import re

from packaging.utils import canonicalize_name

from tests.distributions import ROOT
from tests.integrations.matrix import BEGIN, END, NO_ENVIRONMENT, PAGE, YES
from tests.test_packaging import pins

OWN_PINS = sorted((ROOT / "examples" / "requirements").glob("*.txt"))
TESTED = {path.stem.removeprefix("test_") for path in (ROOT / "tests/integrations").glob("test_*")}


def test_own_pins_are_exact_and_those_of_a_library_with_tests():
    for path in OWN_PINS:
        assert pins(path)
        assert path.stem in TESTED


def test_the_page_has_a_green_row_for_every_library_in_its_pinned_version():
    text = (ROOT / PAGE).read_text("utf-8").split(BEGIN)[1].split(END)[0]
    rows = [line.strip("| ").split(" | ") for line in text.strip().splitlines()[2:]]
    names = {re.findall(r"`(.+?)`", first)[0].replace("-", "_") for first, *_ in rows}
    assert names == TESTED - NO_ENVIRONMENT
    of_all = pins(ROOT / "constraints.txt")
    for first, version, *cells in rows:
        name, *distribution = re.findall(r"`(.+?)`", first)
        own = ROOT / "examples" / "requirements" / f"{name}.txt"
        pinned = of_all | (pins(own) if own.exists() else {})
        assert version.split("+")[0] == pinned[canonicalize_name([name, *distribution][-1])]
        assert cells == [YES], name
