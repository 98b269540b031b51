"""Fills the templates of pages, and seals them: a page holds the checksum of its own text."""

from typing import Any

from jinja2 import Environment, PackageLoader
from markupsafe import Markup
from pygments.formatters import HtmlFormatter

import dess
from reports.pages.verify import sealed


def fill(template: str, **values: Any) -> str:
    """A sealed page.

    Args:
        template: File name in ``reports/templates``.
        **values: What the template shows.
    """
    environment = Environment(
        loader=PackageLoader("reports", "templates"), autoescape=True, trim_blocks=True
    )
    style = HtmlFormatter().get_style_defs(".highlight")
    page = environment.get_template(template).render(
        code_style=Markup(style), version=dess.__version__, **values
    )
    return sealed(page)
