"""Policies of another package that get into trouble at replication 5, as an installed plug-in."""

import sys
from pathlib import Path

import pytest

CODE = """
import os
import signal

import numpy as np

HERE = os.path.dirname(__file__)


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
"""

ENTRY_POINTS = """[dess.policies]
hover = troublesome_plugin:Hover
raising = troublesome_plugin:Raising
killed-once = troublesome_plugin:KilledOnce
killed-always = troublesome_plugin:KilledAlways
"""


def install(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Put the plug-in on the path of this process and of the workers that it starts from now on."""
    from joblib.externals.loky import get_reusable_executor

    info = folder / "troublesome-1.0.dist-info"
    info.mkdir(parents=True)
    (folder / "troublesome_plugin.py").write_text(CODE)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: troublesome\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(ENTRY_POINTS)
    monkeypatch.syspath_prepend(folder)
    monkeypatch.delitem(sys.modules, "troublesome_plugin", raising=False)  # of an earlier test
    get_reusable_executor().shutdown(wait=True)
