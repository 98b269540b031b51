"""The WebAssembly module is the one that is described, and is built of the code that is there."""

from hashlib import sha256
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from dess.analysis.wasm.module import ABOUT, About, read_module

TOOLS = Path(__file__).parents[3] / "tools" / "wasm"


def test_the_module_was_built_of_the_compiled_functions_that_are_there(monkeypatch):
    """If it was not: nox -s wasm."""
    monkeypatch.syspath_prepend(str(TOOLS))
    import build_module

    about = About.load(ABOUT)
    assert build_module.hash_code() == about.code
    assert sha256(read_module()).hexdigest() == about.module


PLAIN = """
NUMBER = 3

def function(x):
    return x + NUMBER
"""


def test_descriptions_do_not_count_and_code_and_constants_do(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(TOOLS))
    from fingerprint import hash_functions

    documented = PLAIN.replace("(x):\n", '(x):\n    """What it does."""  # and why\n')
    hashes = []
    for number, text in enumerate(
        (PLAIN, documented, PLAIN.replace("+", "-"), PLAIN.replace("3", "4"))
    ):
        path = tmp_path / f"{number}.py"
        path.write_text(text, "utf-8")
        spec = spec_from_file_location("of_the_test", path)
        assert spec and spec.loader
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
        hashes.append(hash_functions({"function": (module.function, ())}))
    plain, with_docstring, of_other_code, with_other_constant = hashes
    assert plain == with_docstring
    assert len({plain, of_other_code, with_other_constant}) == 3
