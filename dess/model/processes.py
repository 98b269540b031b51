"""Processes of a user by the names of their functions in Python files.

    moor_boat = load_process(TypedProcess("examples/processes.py:moor_boat")).run

A process is a function of the mission that yields SimPy events; ``docs/concepts/processes.md``
shows two.
"""

from collections.abc import Iterable
from importlib import import_module
from inspect import isgeneratorfunction
from typing import NamedTuple

from dess.base.errors import InputError, shown, unknown_name
from dess.base.python_file import PythonName
from dess.model.mission import Process

FORM = "FILE.py:FUNCTION"


class TypedProcess(str):
    """The name of a process as a user has typed it.

    Only such a name runs a file; a name that was read from data, such as results, is plain text.
    """


class LoadedProcess(NamedTuple):
    """A process of a Python file, and the module that the file is imported as."""

    run: Process
    module: str


def load_process(name: str) -> LoadedProcess:
    """Load a process from its file.

    Args:
        name: ``FILE.py:FUNCTION``, a ``TypedProcess``. The folder of the file is added to
            ``sys.path``.

    Raises:
        InputError: If there is no such function, it yields nothing, or its file cannot be run; if
            the name is plain text.
    """
    file = PythonName.parse(name)
    if not file:
        raise InputError("process", f"{shown(name)} has another form", FORM)
    file.check("process", FORM, run_files=isinstance(name, TypedProcess))
    module = file.find_module("process")
    try:
        names = vars(import_module(module))
    except InputError:
        raise
    except Exception as error:  # code of others may raise anything; name it
        problem = f"cannot be loaded: {type(error).__name__}: {error}"
        raise InputError(f"process: {file.path}", problem, FORM) from error
    functions = [function for function, value in names.items() if isgeneratorfunction(value)]
    if file.name not in functions:
        problem = f"{shown(file.name)} is no function of it that yields events"
        raise unknown_name(f"process: {file.path}", problem, file.name, functions)
    return LoadedProcess(names[file.name], module)


def load_processes(names: Iterable[str]) -> list[Process]:
    """Load several processes, as ``load_process`` does."""
    return [load_process(name).run for name in names]
