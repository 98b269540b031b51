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

# The scripts that simulate: a panel, another mission, the example of the index.
PANEL_SCRIPT, SINGLE_SCRIPT, EXAMPLE_SCRIPT = "panel", "another", "try"
_COMMON = ("engine", "panel_numbers", "panel_controls", "panel_view")
# The scripts of pages, each with the templates that it is made of.
_SCRIPTS = {
    PANEL_SCRIPT: (
        *("player", *_COMMON, "panel_commands", "panel_series", "panel_pool"),
        *("sha256", "replay", "panel_runs", "panel_grid", "panel"),
    ),
    SINGLE_SCRIPT: (*_COMMON, "panel_commands", "sha256", "replay", "another"),
    EXAMPLE_SCRIPT: (*_COMMON, "panel_series", "panel_pool", "try"),
    "worker": ("engine", "panel_worker"),
}
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
    environment.globals |= {"panel_hash": panel_hash, "page_script": page_script}
    environment.globals["rules"] = rules_for_scripts
    environment.filters |= {"indexed": set_indices, "explained": Markup.escape, **filters}
    return environment.get_template(name)


def rules_for_scripts() -> dict[str, Any]:
    """What scripts of pages have from Python: the digits of numbers, and the judge's rule."""
    from dess.analysis.numbers import DIGITS  # an index is made without them
    from dess.analysis.stats.verdict import rule_for_pages

    return {"digits": dict(DIGITS), "verdicts": rule_for_pages()}


@cache
def page_script(name: str) -> str:
    """A script of pages, from its templates."""
    colours = {}
    if "player" in _SCRIPTS[name]:
        from dess.analysis.figures import style  # for the pages that have one

        colours["style"] = style
    return "\n".join(load_template(f"{part}.js").render(colours) for part in _SCRIPTS[name])


def panel_hash(name: str) -> str:
    """The hash by which a page lets a browser run the script of a panel, and no other."""
    return b64encode(sha256(page_script(name).encode()).digest()).decode()


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
    *another mission* needs both.
    """
    permitted = {"scripts": scripts, "simulates": simulates, "script": script}
    page = load_template(name).render(version=dess.__version__, **permitted, **values)
    return Page(page).sealed.text


def _escape_unless_marked(value: object) -> object:
    return value if isinstance(value, int | float | Marked) else escape_text(value)
