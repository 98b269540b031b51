import subprocess
import sys

import pytest

from dess import InputError
from dess.code import memory


def test_what_needs_more_than_is_available_is_refused(monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: 2 * memory.GIB)
    memory.check_memory("a table", 2.0 * memory.GIB, "less")
    with pytest.raises(InputError, match=r"a table: about 3,000.0 GiB .*, of which 2.0 are .*less"):
        memory.check_memory("a table", 3_000.0 * memory.GIB, "less")


@pytest.mark.skipif(sys.platform != "linux", reason="has no limit of the memory of a process")
def test_a_limit_of_the_process_counts():
    code = (
        "import resource; from dess.code import memory; "
        "resource.setrlimit(resource.RLIMIT_DATA, (2**30, 2**30)); "
        "assert 0 < memory.available_memory() < 2**30"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
