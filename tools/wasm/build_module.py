"""Build the WebAssembly module and what the index simulates: build_module.py [--check].

With ``--check`` nothing is written: the module that is there has to have the bytes that are built,
on the system and with the Python that built it, and otherwise this ends with 1.
"""

import argparse
import os
import platform
import subprocess
import sys
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path

import fingerprint

ROOT = Path(__file__).parents[2]
RUNTIME = Path(__file__).parent / "runtime.c"
EXAMPLE = Path(__file__).parent / "make_example.py"
EXPORTS = ("reserve", "forget", "arrays", "prepare", "play", "launch", "advance", "measure")
EXPORTS += ("subtract", "begin", "add")
BUILDERS = ("numba", "llvmlite", "ziglang")
# Other versions of Python have other bytecode, which numba compiles in another order.
PYTHON = ".".join(platform.python_version_tuple()[:2])
SYSTEM = f"{platform.system()} {platform.machine()}"


def hash_code() -> str:
    """The hash of what the module is built of: compiled functions, record types, the C runtime."""
    from dess.analysis.wasm.entry import ENTRIES

    of_functions = fingerprint.hash_functions(ENTRIES)
    return sha256(of_functions.encode() + RUNTIME.read_bytes()).hexdigest()


def build() -> bytes:
    """The bytes of the module."""
    for name in [name for name in os.environ if name.startswith("NUMBA_")]:
        del os.environ[name]  # it is built with numba's own options, whatever those of a session
    import compiler

    machine = compiler.target_wasm()
    from dess.analysis.wasm.entry import ENTRIES

    entries = {f"dess_{name}": entry for name, entry in ENTRIES.items()}
    return compiler.link_module(compiler.compile_object(machine, entries), RUNTIME, EXPORTS)


def check_versions() -> None:
    """Refuse to build with other libraries than the pinned ones, which make other bytes."""
    lines = (ROOT / "constraints.txt").read_text("utf-8").splitlines()
    pins = dict(line.split("==") for line in lines if "==" in line)
    for name in BUILDERS:
        if version(name) != pins[name]:
            sys.exit(f"{name} is {version(name)}; the module is built with {pins[name]}")


def is_same_system() -> bool:
    """Whether the module that is there was built on such a system, with such a Python."""
    from dess.analysis.wasm.module import ABOUT, About

    built_with = About.load(ABOUT).built_with
    return built_with["Python"] == PYTHON and built_with["system"] == SYSTEM


def main() -> int:
    """Build, and write the module and the example of the index, or compare them."""
    parser = argparse.ArgumentParser(description="build the WebAssembly module")
    parser.add_argument("--check", action="store_true", help="compare it with the one there")
    if code := build_module(parser.parse_args().check):
        return code
    # Not in this process, whose compiler has another target.
    return subprocess.call([sys.executable, str(EXAMPLE), *sys.argv[1:]])


def build_module(is_check: bool) -> int:
    """Build, and write the module or compare it; 1 if it differs."""
    check_versions()
    if is_check and not is_same_system():
        print("Another Python or system may build other bytes, so they are not compared.")
        return 0
    module = build()
    from dess.analysis.wasm.module import ABOUT, MODULE, About

    if is_check and MODULE.read_bytes() != module:
        print("The module has other bytes than what is built: run nox -s wasm")
        return 1
    if is_check:
        print("The module has the bytes that are built.")
        return 0
    about = About(
        module=sha256(module).hexdigest(),
        code=hash_code(),
        built_with={"Python": PYTHON, "system": SYSTEM, **{n: version(n) for n in BUILDERS}},
    )
    MODULE.write_bytes(module)
    ABOUT.write_text(about.model_dump_json(indent=2) + "\n", "utf-8")
    print(f"{MODULE.relative_to(ROOT)}: {len(module)} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
