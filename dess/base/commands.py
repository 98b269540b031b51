"""Commands of ``dess`` in words, quoted for a shell.

>>> command_line("sweep", set={"uavs": "1..3"}, policy=["greedy", "my policy"], yes=True)
"dess sweep --set uavs=1..3 --policy greedy --policy 'my policy' --yes"
"""

import shlex
from collections.abc import Iterator, Mapping
from typing import Any


def command_line(*words: object, **options: Any) -> str:
    """A command with its options, in their order.

    Args:
        *words: What stands behind ``dess``.
        **options: The value of each option, as in ``command_options``.
    """
    return f"{shlex.join(['dess', *map(str, words)])} {command_options(**options)}".rstrip()


def command_options(**options: Any) -> str:
    """Options of a command, in their order.

    Args:
        **options: The value of each option. One that is None is left out, one that is True has no
            value, one that is a list is repeated, and one that is a mapping is repeated with
            ``KEY=VALUE``.
    """
    words = [word for name, value in options.items() for word in _option(f"--{name}", value)]
    return shlex.join(words)


def _option(name: str, value: Any) -> Iterator[str]:
    if value is True:
        yield name
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            yield from (name, f"{key}={inner}")
    elif isinstance(value, list | tuple):
        for inner in value:
            yield from (name, str(inner))
    elif value is not None:
        yield from (name, str(value))
