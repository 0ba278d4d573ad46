"""Sphinx: the documentation as a site (`make docs`). Nothing in it is loaded from another host."""

from __future__ import annotations

import logging
import sys
import tomllib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from latex2mathml.converter import convert

if TYPE_CHECKING:
    from docutils.nodes import Element, math, math_block
    from sphinx.application import Sphinx
    from sphinx.writers.html5 import HTML5Translator

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
sys.path.insert(0, str(ROOT))
logging.getLogger("alembic").setLevel(logging.WARNING)  # the reference imports it, and it reports its plugins

project = "Parenting"
author = copyright = "The Parenting authors"
release = version = PROJECT["version"]

extensions = [
    "myst_parser",
    "sphinx.ext.apidoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
]
exclude_patterns = ["pictures"]
NO_LIBRARY = ("commands", "experiments", "migrations", "server", "web", "weights", "audit")
"""Folders without a page of reference.

docs/commands.md and docs/api.md describe the first and the fourth, docs/export.md the last.
"""
apidoc_modules = [
    {
        "path": "../parenting",
        "destination": "reference",
        "exclude_patterns": [
            f"../parenting/{name}"
            for name in ("commands", "experiments", "migrations", "server", "web", "weights", "audit")
        ],
        "follow_links": True,
        "separate_modules": False,
        "module_first": True,
        "max_depth": 1,
        "automodule_options": {"members"},
    }
]
suppress_warnings = ["ref.python"]  # two modules may use one name; the reader sees which is meant
default_role = "code"  # a name between single backticks in a docstring is code
nitpicky = False
html_theme = "furo"
html_title = "Parenting"
html_favicon = "../web/static/icon.svg"
html_static_path: list[str] = []
html_math_renderer = "mathml"

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_preserve_defaults = True
autodoc_use_type_comments = False  # there are none, and looking for them takes a tenth of the time
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True  # else an attribute of an Attributes section is described twice


def inline_mathml(page: HTML5Translator, node: math) -> None:
    """Write a formula inside a line as MathML, which every supported browser draws by itself."""
    _write(page, node, "inline")


def block_mathml(page: HTML5Translator, node: math_block) -> None:
    """Write a formula that stands on its own."""
    page.body.append('<div class="math">')
    _write(page, node, "block")
    page.body.append("</div>\n")


def _write(page: HTML5Translator, node: Element, display: str) -> None:
    from docutils.nodes import SkipNode

    page.body.append(convert(node.astext(), display=display))
    raise SkipNode


def skip_second(app: Sphinx, _what: str, name: str, *_rest: object) -> bool | None:
    """Leave out of the page of public names what the page of levels describes under the same name."""
    return True if app.env.docname == "reference/parenting" and name in ("Level", "LevelError") else None


def share_navigation(
    _app: Sphinx, name: str, _template: str, context: dict[str, Any], document: Element | None
) -> None:
    """Work out the navigation once for all pages of source of one depth: it takes most of a page's time."""
    whole = context.get("toctree")
    if document is None and whole is not None and name.startswith("_modules/"):
        context["toctree"] = partial(_navigation, name.count("/"), whole)


NAVIGATIONS: dict[tuple[object, ...], str] = {}


def _navigation(depth: int, whole: Callable[..., str], **options: object) -> str:
    """Return the navigation of a page that is not part of it; its links depend on the depth alone."""
    key = (depth, *sorted(options.items()))
    if key not in NAVIGATIONS:
        NAVIGATIONS[key] = whole(**options)
    return NAVIGATIONS[key]


def setup(app: Sphinx) -> None:
    """Register the renderer of formulas."""
    app.connect("html-page-context", share_navigation, priority=400)  # furo asks for the navigation at 500
    app.connect("autodoc-skip-member", skip_second)
    app.add_html_math_renderer("mathml", (inline_mathml, None), (block_mathml, None))
