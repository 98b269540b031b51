"""Templates of pages, with the scripts that a page may run.

Results may come from anybody, so no name in them is ever markup: templates escape all values.
"""

import gzip
import re
from base64 import b64encode
from collections.abc import Callable
from functools import cache
from hashlib import sha256
from typing import Any

from IPython.display import HTML
from jinja2 import Environment, PackageLoader, StrictUndefined, Template, select_autoescape
from markupsafe import Markup

import dess
from dess.reports.pages.markdown import Marked, escape_text
from dess.reports.pages.page import Page

# The templates of the scripts that simulate: a panel, another mission, the example of the index.
PANEL_SCRIPT, SINGLE_SCRIPT = "panel_script.js", "another_script.js"
EXAMPLE_SCRIPT = "try_script.js"
_INDEX = re.compile(r"\bC_([SC])\b")  # as in C_S, a threshold of charging
# What all templates have in common: they escape values, and one that is undefined is an error.
JINJA: dict[str, Any] = {"autoescape": select_autoescape(), "undefined": StrictUndefined}


def set_indices(text: object) -> Markup:
    """Text, or HTML without such a name in an attribute, in which the S of ``C_S`` is an index."""
    return Markup(_INDEX.sub(r"C<sub>\1</sub>", str(Markup.escape(text))))


@cache
def load_template(name: str, **filters: Callable[..., str]) -> Template:
    """Load a template.

    Args:
        name: File name in ``reports/templates``.
        **filters: Filters in addition to ``indexed`` and those of Jinja. Only a page explains
            terms; elsewhere ``explained`` text is the same text.
    """
    finalize = None
    if name.endswith(".md"):
        finalize = _escape_unless_marked
    loader = PackageLoader("dess.reports", "templates")
    environment = Environment(loader=loader, finalize=finalize, trim_blocks=True, **JINJA)
    environment.globals["panel_hash"] = panel_hash
    environment.filters |= {"indexed": set_indices, "explained": Markup.escape, **filters}
    return environment.get_template(name)


@cache
def panel_script(name: str) -> str:
    """The script of a panel, from its template."""
    template = load_template(name)
    if name == EXAMPLE_SCRIPT:  # which draws nothing
        return template.render()
    from dess.analysis.figures import style  # for the pages that have one

    return template.render(style=style)


def panel_hash(name: str) -> str:
    """The hash by which a page lets a browser run the script of a panel, and no other."""
    return b64encode(sha256(panel_script(name).encode()).digest()).decode()


def pack(content: bytes) -> str:
    """Compressed bytes as text; equal bytes give equal text."""
    return b64encode(gzip.compress(content, 9, mtime=0)).decode()


def render_part(name: str, **values: Any) -> HTML:
    """A part of a page that a template makes of values, which it escapes."""
    return HTML(load_template(name).render(**values))


def fill_page(
    name: str,
    scripts: bool = False,
    simulates: bool = False,
    script: str = PANEL_SCRIPT,
    **values: Any,
) -> str:
    """Fill a template with values, and seal the page.

    A browser makes no request for the page, and runs scripts only if ``scripts`` is set. If
    ``simulates`` is set, it runs the script of a panel, and its WebAssembly module; the script of
    *another mission* needs both. The templates of these scripts have the names ``..._script.js``.
    """
    permitted = {"scripts": scripts, "simulates": simulates, "script": script}
    page = load_template(name).render(version=dess.__version__, **permitted, **values)
    return Page(page).sealed.text


def _escape_unless_marked(value: object) -> object:
    return value if isinstance(value, int | float | Marked) else escape_text(value)
