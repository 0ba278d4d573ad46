"""The prose of results pages: Markdown written by hand, in which numbers are filled in."""

from __future__ import annotations

import re
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

TEMPLATES = Path(__file__).parents[1]
"""Where they stand: each beside the module of its page."""


def paragraphs(template: str, **values: object) -> list[str]:
    """Fill in a page's prose.

    Args:
        template: The Markdown file, relative to `experiments/`. A blank line ends a paragraph.
        values: The values of its placeholders; a placeholder without a value is an error.

    Returns:
        The paragraphs, each on one line.
    """
    templates = Environment(
        loader=FileSystemLoader(TEMPLATES),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # Markdown; reporting/html.py escapes what it shows
    )
    text = templates.get_template(template).render(**values)
    return [" ".join(words.split()) for words in re.split(r"\n\s*\n", text.strip())]
