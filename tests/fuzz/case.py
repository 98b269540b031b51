"""A case: a command, the files that it meets, and what happens while it runs."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

# Folders of a case. Commands run in CWD, so that ``../in`` is where their inputs are.
IN, OUT, CWD, HOME, TEMPORARY, LOG = "in", "out", "cwd", "home", "tmp", "log"
FOLDERS = (IN, OUT, CWD, HOME, TEMPORARY, LOG)
# The folder of the ready inputs, seen from that of a case; it is only read.
READY = "../../ready"
# A file of the user that no command line names, and what is in it: no command may print it.
SECRET_FILE, SECRET = f"{HOME}/secret.csv", "Kq7wXz"


class Step(Protocol):
    """Something that is done to the files of a case before its command runs."""

    def do(self, box: Path) -> None:
        """Do it in the folder of the case."""


@dataclass(frozen=True)
class Case:
    """What is tried.

    Attributes:
        kind: The kind of case, for the counts.
        arguments: The arguments of ``dess``; paths are relative to the folder ``cwd``.
        steps: What is done to the files before.
        seconds: The time in which the command has to end.
        lasting: After how many seconds a command that may last for long is interrupted by SIGTERM;
            0 for all others, which have to end by themselves.
        signals: Signals that are sent to the command, each after a number of seconds.
        again: Whether the same command has to complete the work afterwards.
        file_size: The largest size of a file that can be written, as on a full disk, in bytes.
        code: The exit code that the command must have; 0, 1, 2 or 130 if it is not known.
        kernels: Whether notebooks run in kernels, and not in the process of the case.
        stdout: What standard output is: a file, a full device, or a pipe that nobody reads.
    """

    kind: str
    arguments: tuple[str, ...]
    steps: tuple[Step, ...] = ()
    seconds: float = 60
    lasting: float = 0
    signals: tuple[tuple[float, int], ...] = ()
    again: bool = False
    file_size: int | None = None
    code: int | None = None
    kernels: bool = False
    stdout: Literal["file", "full", "closed"] = "file"

    @property
    def allowed(self) -> tuple[str, ...]:
        """The folders of the case in which the command may write."""
        words = [word for word in self.arguments if not word.startswith("-")]
        command = "study run" if words[:2] == ["study", "run"] else "".join(words[:1])
        is_named = any(word.startswith("--out") for word in self.arguments)
        allowed = [OUT]
        is_kept = command == "report" and not any(w.startswith("--results") for w in self.arguments)
        if command in ("sweep", "what-if") or is_kept or (command == "study run" and not is_named):
            allowed.append(f"{CWD}/results")
        if "--report" in self.arguments or (
            command in ("sweep", "what-if", "report") and not is_named
        ):
            allowed.append(f"{CWD}/build")
        return tuple(allowed)
