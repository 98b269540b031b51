"""Compile numba functions ahead of time to one WebAssembly module.

Numba's own code generator does it, with another target machine (``target_wasm``): every function is
optimized for wasm32, with its data layout and its registers, and is never loaded here. (What was
optimized for this computer cannot be used: it has the byte offsets of 64-bit pointers.) So nothing
that is compiled can run in a process that does this: it must load no scenario. Integers have 64
bits as here, pointers 32.

The parts of numba that this relies on are not public, so ``nox -s wasm`` pins its version.
"""

import re
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from itertools import count
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
from numba.core import codegen
from numba.core.bytecode import FunctionIdentity
from numba.core.compiler_lock import global_compiler_lock

TRIPLE = "wasm32-unknown-unknown"
# Without relaxed SIMD, which may fuse a multiplication with an addition.
FEATURES = "+simd128,+bulk-memory,+bulk-memory-opt,+nontrapping-fptoint,+sign-ext,+mutable-globals"
# What runtime.c has in place of numba.
RUNTIME = ("NRT_incref", "NRT_decref")


def target_wasm() -> llvm.TargetMachine:
    """Let numba compile for WebAssembly from now on; before anything of dess is compiled."""
    from dess.base import kernels

    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = llvm.Target.from_triple(TRIPLE)
    machine = target.create_target_machine(opt=3, features=FEATURES)
    init_for_host = codegen.CPUCodegen._init
    create_empty_module = codegen.CPUCodegen._create_empty_module

    def init(self: Any, module: Any) -> None:
        init_for_host(self, module)
        self._tm = machine
        self._target_data = machine.target_data
        self._data_layout = str(machine.target_data)

    def create_module(self: Any, name: str) -> Any:
        module = create_empty_module(self, name)
        module.triple = TRIPLE
        return module

    def finalize(self: Any) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    codegen.CPUCodegen._init = init
    codegen.CPUCodegen._create_empty_module = create_module
    codegen.CPUCodeLibrary._finalize_final_module = finalize
    codegen.JITCodeLibrary.get_pointer_to_function = lambda self, name: 0
    codegen.JITCPUCodegen.set_env = lambda self, name, env: None
    kernels._code_behind = lambda *_: ""  # no cache
    FunctionIdentity._unique_ids = count(1)  # names, and so the order of functions, are the same
    return machine


def compile_object(machine: llvm.TargetMachine, entries: Mapping[str, Any]) -> bytes:
    """The object file of compiled functions, and of all that they call.

    Args:
        machine: What ``target_wasm`` returned.
        entries: By the names that they get, the functions and the types of their arguments.
    """
    names = {}
    parts = []
    for name, (function, types) in entries.items():
        function.compile(types)
        overload = function.overloads[types]
        with global_compiler_lock:
            part = overload.library._get_module_for_linking().clone()
        mangled = overload.fndesc.llvm_func_name
        part.get_function(mangled).linkage = "external"  # nothing of numba calls it
        names[mangled] = name
        parts.append(part)
    together, *others = parts
    for part in others:
        together.link_in(part)
    text = str(together)
    for mangled, name in names.items():
        text = text.replace(mangled, name)
    module = llvm.parse_assembly(_without_host(text))
    module.verify()
    for value in (*module.functions, *module.global_variables):
        if value.is_declaration:
            continue
        value.linkage = "external" if value.name in entries else "internal"
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    builder = llvm.create_pass_builder(machine, options)
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, builder)
    return machine.emit_object(module)


def _without_host(text: str) -> str:
    """The code without what numba says of this computer, and without what ``RUNTIME`` names."""
    text = re.sub(r'"(target-cpu|target-features|probe-stack)"="[^"]*"', "", text)
    text = text.replace(" = common ", " = ")
    # What exceptions say has paths of this computer, and no caller of the module can read it.
    said = re.compile(r"^(@\.const\.picklebuf\.\S+ = .*?constant \{[^}]*\} )\{.*$", re.M)
    text = said.sub(r"\1zeroinitializer", text)
    lines = []
    is_left_out = False
    for line in text.splitlines():
        defined = re.match(r'define .*@"?([\w.]+)"?\(', line)
        if defined and defined[1] in RUNTIME:
            is_left_out = True
            lines.append(f"declare void @{defined[1]}(ptr)")
        if not is_left_out:
            lines.append(line)
        if line.startswith("}"):
            is_left_out = False
    return "\n".join(lines)


def link_module(compiled: bytes, runtime: Path, exports: Sequence[str]) -> bytes:
    """Link an object file with the C runtime to a module that imports nothing."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "compiled.o").write_bytes(compiled)
        (Path(folder) / "runtime.c").write_bytes(runtime.read_bytes())
        _run_zig(
            folder,
            *("cc", "-target", "wasm32-freestanding", "-O2", "-ffp-contract=off"),
            *("-mbulk-memory", "-c", "runtime.c", "-o", "runtime.o"),
        )
        _run_zig(
            folder,
            *("wasm-ld", "--no-entry", "--gc-sections", "--strip-all", "--export-memory"),
            *(f"--export={name}" for name in exports),
            *("-z", "stack-size=131072", "-o", "module.wasm", "compiled.o", "runtime.o"),
        )
        return (Path(folder) / "module.wasm").read_bytes()


def _run_zig(folder: str, *arguments: str) -> None:
    subprocess.run([sys.executable, "-m", "ziglang", *arguments], cwd=folder, check=True)
