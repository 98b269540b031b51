"""The reports of other packages: notebooks that they register as entry points.

    [project.entry-points."dess.pages"]
    two-missions = "my_pages.two_missions"

The name of an entry point is that of the report, and its value is the module that is the notebook.
The module is read and never imported. Its metadata name the group of the index in which it stands:

    # jupyter:
    #   dess:
    #     studies: [fig4]
    #     group: The policies
"""

import logging
import re
from collections.abc import Container
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path

from dess.base.errors import InputError, shown
from dess.reports.pages import INDEX, PREFIX

log = logging.getLogger(__name__)

GROUP = "dess.pages"
_NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")  # it is the name of the page, too


def find_outside_notebooks(taken: Container[str]) -> dict[str, Path]:
    """The files of the notebooks of other packages, by the names of their reports.

    Those that cannot be read are left out, with a warning.

    Args:
        taken: Names that they cannot have, as reports of dess have them.
    """
    files = {}
    for point in sorted(entry_points(group=GROUP)):
        try:
            files[_check_name(point, taken)] = _file_of(point)
        except InputError as error:
            log.warning("note: a page is left out: %s", error)
    return files


def _check_name(point: EntryPoint, taken: Container[str]) -> str:
    """The name of a report.

    Raises:
        InputError: If its page would have no name of a file, or that of another page.
    """
    name = point.name
    is_other = name in taken or f"{name}.html" == INDEX or f"{name}-".startswith(PREFIX)
    if is_other or not _NAME.fullmatch(name):
        raise InputError(
            f"{GROUP} {shown(name)}",
            "is no name of a further page",
            f"small letters, digits and hyphens, and not the name of a page of dess or {PREFIX}...",
        )
    return name


def _file_of(point: EntryPoint) -> Path:
    """The file of a module.

    Raises:
        InputError: If there is none.
    """
    where = f"{GROUP} {point.name}"
    allowed = "a module that is a notebook"
    try:
        spec = find_spec(point.value)
    except Exception as error:  # the package around the module may raise anything; name it
        problem = f"{point.value} cannot be found: {type(error).__name__}: {error}"
        raise InputError(where, problem, allowed) from error
    if spec is None or not spec.has_location or spec.origin is None:
        raise InputError(where, f"there is no module {point.value}", allowed)
    return Path(spec.origin)
