import subprocess
import sys

import pytest

from dess import InputError
from dess.base.files import memory


def test_what_needs_more_than_is_available_is_refused(monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: 2 * memory.GIB)
    memory.check_memory("a table", 2.0 * memory.GIB, "less")
    with pytest.raises(InputError, match=r"a table: about 3,000.0 GiB .*, of which 2.0 are .*less"):
        memory.check_memory("a table", 3_000.0 * memory.GIB, "less")


@pytest.mark.parametrize("version", [1, 2])
def test_the_limit_of_a_container_counts(version, tmp_path, monkeypatch):
    names, prefix = memory._LIMITS[2 - version], "total_" if version == 1 else ""
    monkeypatch.setattr(memory, "GROUPS", tmp_path)
    free = memory.available_memory()
    parts = f"anon 5\n{prefix}inactive_file {2**20}\n"
    for name, text in zip(names, (f"{2**22}\n", f"{2**21}\n", parts), strict=True):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    assert memory.available_memory() == 2**22 - 2**21 + 2**20 < free
    (tmp_path / names[0]).write_text("max\n")
    assert memory.available_memory() > 2**22


@pytest.mark.skipif(sys.platform != "linux", reason="has no limit of the memory of a process")
def test_a_limit_of_the_process_counts():
    code = (
        "import resource; from dess.base.files import memory; "
        "resource.setrlimit(resource.RLIMIT_DATA, (2**30, 2**30)); "
        "assert 0 < memory.available_memory() < 2**30"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
