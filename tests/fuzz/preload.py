"""What the parent of all cases does once, so that a case need not: imports, and compiled code.

Importing this module does it. It must start no thread: the parent forks a process for every case.
"""

import gc
import io
import pkgutil
from contextlib import redirect_stdout
from importlib import import_module

import tqdm

import dess
from dess import analysis, policies, reports
from dess.reports.cli import main

_MISSION = ("simulate", "--policy", "ddqn", "--json")
_POLICIES = ("--policy=random", "--policy=nearest", "--policy=greedy", "--policy=tour")
_MISSIONS = ("evaluate", *_POLICIES, "--missions", "2")


# What libraries import only when they are used.
# Notebooks run in kernels; integrations need libraries that are not installed.
_UNUSED = {"notebooks", "integrations"}
_LATER = ("torch._dynamo", "torch.utils.tensorboard", "PIL.Image", "matplotlib.pyplot")


def _import_all() -> None:
    for name in _LATER:
        import_module(name)
    for package in (dess, policies, analysis, reports):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if not module.name.endswith(".__main__") and not _UNUSED & {*module.name.split(".")}:
                import_module(module.name)


def _compile_all() -> None:
    tqdm.tqdm.monitor_interval = 0  # its monitor would be a thread
    with redirect_stdout(io.StringIO()):
        for arguments in (_MISSION, _MISSIONS):
            if main(arguments) != 0:
                raise RuntimeError(f"dess {' '.join(arguments)} fails")
    tqdm.tqdm.monitor_interval = 10


_import_all()
_compile_all()
gc.freeze()
