"""Fills the templates of pages, and seals them: a page holds the checksum of its own text."""

from collections.abc import Callable
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, Template, select_autoescape
from markupsafe import Markup
from pygments.formatters import HtmlFormatter

import dess
from reports.pages.verify import sealed


def template(name: str, **filters: Callable[..., str]) -> Template:
    """A template; it escapes values if it is HTML, and refuses undefined ones.

    Args:
        name: File name in ``reports/templates``.
        **filters: Its filters beside those of Jinja.
    """
    environment = Environment(
        loader=PackageLoader("reports", "templates"),
        autoescape=select_autoescape(),
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    environment.filters |= filters
    return environment.get_template(name)


def fill(name: str, **values: Any) -> str:
    """A sealed page: a template with its values."""
    style = Markup(HtmlFormatter().get_style_defs(".highlight"))
    return sealed(template(name).render(code_style=style, version=dess.__version__, **values))
