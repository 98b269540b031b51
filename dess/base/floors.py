"""The packages above ``dess``, which are installed with it and imported by their names alone."""

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from dess.base.errors import InputError

FLOORS = ("policies", "analysis", "reports")  # in the repository, folders beside ``dess``


def check_floors() -> None:
    """Refuse a copy of the folder ``dess`` alone.

    Raises:
        InputError: If one of ``FLOORS`` is not there.
    """
    if missing := [name for name in FLOORS if find_spec(f"dess.{name}") is None]:
        raise InputError(
            "",
            f"{Path(__file__).parents[1]} is a part of the package, without "
            f"{' and '.join(missing)}",
            "an installation with pip, or the whole repository",
        )


def import_floor(name: str) -> Any:
    """Import one of ``FLOORS``.

    Raises:
        InputError: If it is not there.
    """
    check_floors()
    return import_module(f"dess.{name}")
