"""Policies that get into trouble at replication 5; tests copy this file, as one of a user."""

import os
import shutil
import signal
from pathlib import Path

import numpy as np

HERE = os.path.dirname(__file__)


def copied(folder: Path) -> Path:
    """A copy of this file, whose name no other test has: a process keeps what it has imported."""
    return shutil.copy(__file__, folder / f"{folder.name}.py")


class Hover:
    name = "hover"

    def act(self, view):
        if (view.constants["replication"] == 5).any():
            self.trouble()
        return np.full(len(view), 4)

    def trouble(self):
        pass


class Raising(Hover):
    name = "raising"

    def trouble(self):
        raise ZeroDivisionError("nothing to divide by")


class KilledOnce(Hover):
    name = "killed-once"

    def trouble(self):
        try:
            os.close(os.open(os.path.join(HERE, "killed"), os.O_CREAT | os.O_EXCL))
        except FileExistsError:
            return
        os.kill(os.getpid(), signal.SIGKILL)


class KilledAlways(Hover):
    name = "killed-always"

    def trouble(self):
        os.kill(os.getpid(), signal.SIGKILL)
