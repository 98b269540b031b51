"""What a user names in a Python file of his own, ``FILE.py:NAME``: a policy or a process."""

import os
import re
import sys
from importlib import invalidate_caches
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple, Self

from dess.base.errors import InputError, shown
from dess.base.sources import path_of

_FORM = re.compile(r"(?P<path>.+\.py):(?P<name>\w+)")


class PythonName(NamedTuple):
    """A name in a Python file."""

    path: Path
    name: str

    @classmethod
    def parse(cls, text: str) -> Self | None:
        """The name and its file, if a text has both."""
        if parts := _FORM.fullmatch(text):
            return cls(Path(parts["path"]), parts["name"])
        return None

    def check(self, what: str, form: str, *, run_files: bool) -> None:
        """Refuse a file that may not be run, or does not exist.

        Args:
            what: What the name stands for, which is also the option that takes it.
            form: What the option takes, for messages.
            run_files: Whether the file may be run, since a user has typed its name.

        Raises:
            InputError: If it must not be run.
        """
        if not run_files:
            text = f"{self.path}:{self.name}"
            problem = f"{shown(text)} is a Python file, which is run only if you name it"
            raise InputError(what, problem, f"--{what} {form}, if you trust the file")
        if not os.path.isfile(self.path):  # False for a name that no file can have
            raise InputError(f"{what}: {self.path}", "no such file", form)

    def find_module(self, what: str) -> str:
        """The name under which the file is imported, once its folder is on ``sys.path``.

        Args:
            what: What the name stands for, for messages.

        Raises:
            InputError: If another module has this name.
        """
        if (folder := str(self.path.resolve().parent)) not in sys.path:
            sys.path.append(folder)
        invalidate_caches()
        path_of.cache_clear()
        spec = find_spec(self.path.stem)
        if not spec or not spec.origin or Path(spec.origin).resolve() != self.path.resolve():
            problem = "another module has its name"
            raise InputError(f"{what}: {self.path}", problem, "another file name")
        return self.path.stem
