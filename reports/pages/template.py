"""Fill the templates of pages, and seal the pages: a page contains a checksum of its own text."""

from collections.abc import Callable
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, Template, select_autoescape
from markupsafe import Markup
from pygments.formatters import HtmlFormatter

import dess
from reports.pages.html import Marked, text
from reports.pages.verify import sealed


def template(name: str, **filters: Callable[..., str]) -> Template:
    """Load a template, which escapes values and raises an error if one is undefined.

    Args:
        name: File name in ``reports/templates``.
        **filters: Filters in addition to those of Jinja.
    """
    environment = Environment(
        loader=PackageLoader("reports", "templates"),
        autoescape=select_autoescape(),
        undefined=StrictUndefined,
        trim_blocks=True,
        finalize=_in_markdown if name.endswith(".md") else None,
    )
    environment.filters |= filters
    return environment.get_template(name)


def _in_markdown(value: object) -> object:
    return value if isinstance(value, int | float | Marked) else text(value)


def fill(name: str, scripts: bool = False, **values: Any) -> str:
    """Fill a template with values, and seal the page.

    A browser makes no request for the page, and runs a script only if ``scripts`` is set.
    """
    style = Markup(HtmlFormatter().get_style_defs(".highlight"))
    return sealed(
        template(name).render(scripts=scripts, code_style=style, version=dess.__version__, **values)
    )
