"""One page with every experiment: the paper's numbers, ours, difference, interval, command.

The page stands alone: styles and figures are in it, so that it can be sent around.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from experiments.catalogue import NAMES
from experiments.publish import RESULTS

WEB = Path(__file__).parents[1] / "web"
PAGE = "report.html"


class NoResults(ValueError):
    """No experiment has left results here; the sentence says how to make some."""


class Part(NamedTuple):
    """One experiment's part of the page."""

    results: dict[str, Any]
    figures: Sequence[Markup]


def report(out: Path) -> Path:
    """Write the page of all results below a folder, and return its path.

    Raises:
        NoResults: there are none.
        OSError: a file cannot be read or written.
    """
    parts = list(_parts(out))
    if not parts:
        raise NoResults(
            f"{out} holds no results. Make some: parenting experiment all --scale quick --out {out}"
        )
    templates = Environment(
        loader=FileSystemLoader(WEB / "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    path = out / PAGE
    path.write_text(templates.get_template(PAGE).render(parts=parts), encoding="utf-8")
    return path


def _parts(out: Path) -> Iterator[Part]:
    for name in NAMES:
        path = out / name / RESULTS
        if path.exists():
            figures = [_figure(drawn) for drawn in sorted(path.parent.glob("*.svg"))]
            yield Part(json.loads(path.read_text(encoding="utf-8")), figures)


def _figure(path: Path) -> Markup:
    """An SVG of ours without its XML header; ids begin with the file's name, since one page holds several."""
    text = path.read_text(encoding="utf-8")
    drawing = text[text.index("<svg") :]
    mark = f"{path.parent.name}-{path.stem}-"
    drawing = re.sub(r'\bid="', f'id="{mark}', drawing)
    drawing = re.sub(r'href="#', f'href="#{mark}', drawing)
    # Drawn by us from numbers: it holds no text of anybody else's.
    return Markup(re.sub(r"url\(#", f"url(#{mark}", drawing))
