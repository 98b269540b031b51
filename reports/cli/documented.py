"""Commands whose options are described where those of functions are: in the docstring."""

import re
from collections.abc import Callable
from inspect import getdoc
from typing import Annotated, get_type_hints

import typer


def command(app: typer.Typer, name: str | None = None) -> Callable[[Callable], Callable]:
    """Make a command of a function; the part ``Args`` of its docstring describes the options."""

    def register(function: Callable) -> Callable:
        summary, _, described = (getdoc(function) or "").partition("\n\nArgs:\n")
        hints = get_type_hints(function, include_extras=True)
        for parameter, text in re.findall(r"^    (\w+): (.*(?:\n {8}.*)*)", described, re.M):
            if not hasattr(hints[parameter], "__metadata__"):
                hints[parameter] = Annotated[hints[parameter], typer.Option()]
            hints[parameter].__metadata__[0].help = re.sub(r"\n {8}", " ", text)
        function.__annotations__ = hints
        return app.command(name, help=summary)(function)

    return register
