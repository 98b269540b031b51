"""What an environment may be made with: a keyword that it does not have is refused in a line."""

from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import ParamSpec

from dess.base.errors import check_known

_P = ParamSpec("_P")


def with_known_options(initialise: Callable[_P, None]) -> Callable[_P, None]:
    """The ``__init__`` of an environment, which names the keywords that there are.

    Args:
        initialise: The ``__init__``. Other keywords raise ``InputError``.
    """
    names = [*signature(initialise).parameters][1:]

    @wraps(initialise)
    def checked(*args: _P.args, **options: _P.kwargs) -> None:
        for name in options:
            check_known("options", name, names)
        initialise(*args, **options)

    return checked
