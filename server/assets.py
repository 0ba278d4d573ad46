"""One style sheet and one script a page, put together from their sources when they are first asked for.

A script is its page's ES module and all that it imports (`server.scripts`); what it loads later, by
`import("./later.js")`, has scripts of its own. Addresses hold a hash of the content, so a browser keeps a
copy for good; an upgrade, which restarts the server, changes the addresses. The sources stay addressable one
by one.
"""

from __future__ import annotations

import gzip
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from hashlib import sha256
from pathlib import Path

import brotli
import rcssmin
import rjsmin

from parenting.drawing.render import STYLE
from parenting.server.scripts import scripts

STATIC = Path(__file__).parents[1] / "web" / "static"
EVERY_PAGE = ("colours.css", "site.css")
SHEETS = {
    "page.css": EVERY_PAGE,
    "parent.css": (*EVERY_PAGE, "board.css", "parent.css"),
    "history.css": (*EVERY_PAGE, "board.css", "parent.css", "forms.css", "history.css"),
    "dashboard.css": (*EVERY_PAGE, "board.css", "forms.css", "dashboard.css", "seen.css"),
    "comparison.css": (*EVERY_PAGE, "forms.css", "dashboard.css", "comparison.css"),
    "why.css": (*EVERY_PAGE, "board.css", "parent.css", "forms.css", "history.css", "why.css"),
    "start.css": (*EVERY_PAGE, "forms.css", "start.css"),
    "settings.css": (*EVERY_PAGE, "forms.css", "settings.css"),
    "levels.css": (*EVERY_PAGE, "board.css", "forms.css", "levels.css"),
    "end.css": (
        *EVERY_PAGE,
        "forms.css",
    ),
    "error.css": (
        *EVERY_PAGE,
        "parent.css",
    ),
    "audit.css": (*EVERY_PAGE, "forms.css", "audit.css"),
    "access.css": (*EVERY_PAGE, "forms.css", "audit.css", "access.css"),
    "docs.css": ("docs.css",),
    "walk.css": ("walk.css", "growth.css"),
}
"""The sheets of each page. That of the API's description stands alone, after one of another package."""
SCRIPTS = (
    "parent.js",
    "practice.js",
    "history.js",
    "dashboard.js",
    "comparison.js",
    "list.js",
    "start.js",
    "docs.js",
    "levels.js",
    "pretraining.js",
    "open.js",
    "access.js",
)
PICTURES = ("icon.svg", "query.svg", "question.svg")
MEDIA = {".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
SMALLER: dict[str, Callable[[str], str]] = {"css": rcssmin.cssmin, "js": rjsmin.jsmin}
"""Remove comments and white space that say nothing to a browser; names stay as they are written."""


@dataclass(frozen=True)
class Asset:
    """A file as it is served: its address' last part, its type, its bytes, plain and compressed."""

    name: str
    media: str
    content: bytes

    @cached_property
    def gzipped(self) -> bytes:
        """The content for a client that takes gzip."""
        return gzip.compress(self.content, 9, mtime=0)

    @cached_property
    def brotlied(self) -> bytes:
        """The content for a client that takes brotli: an eighth smaller, in some milliseconds once."""
        packed: bytes = brotli.compress(self.content, quality=11)
        return packed

    def encoded(self, accepted: str) -> tuple[bytes, dict[str, str]]:
        """Return the content and its header for a client that takes these encodings (`Accept-Encoding`)."""
        parts = (one.strip().replace(" ", "").partition(";q=") for one in accepted.split(","))
        taken = {name for name, _, quality in parts if quality.strip("0.") or not quality}
        if "br" in taken:
            return self.brotlied, {"Content-Encoding": "br"}
        return (self.gzipped, {"Content-Encoding": "gzip"}) if "gzip" in taken else (self.content, {})


def asset(name: str) -> str:
    """Return the address of a page's style sheet, script or picture, for templates."""
    return f"/static/{assets()[name].name}"


def hashed(name: str) -> Asset | None:
    """Return the asset whose hashed name this is."""
    stem, _, ending = name.rpartition(".")
    found = assets().get(f"{stem.rpartition('.')[0]}.{ending}")
    return found if found is not None and found.name == name else None


@cache
def assets() -> dict[str, Asset]:
    """Return all assets by their names without hashes."""
    texts = {name: sheet(parts) for name, parts in SHEETS.items()}
    texts |= {name: (STATIC / name).read_text("utf-8") for name in PICTURES}
    found = {name: _asset(name, text) for name, text in texts.items()}
    for name in SCRIPTS:
        found |= page_scripts(name)
    return found


def sheet(parts: tuple[str, ...]) -> str:
    """Return these sheets as one, in this order."""
    folders = {"colours.css": STYLE, "board.css": STYLE}
    return "\n".join((folders.get(one, STATIC) / one).read_text("utf-8") for one in parts)


def page_scripts(name: str, folder: Path = STATIC) -> dict[str, Asset]:
    """Return a page's script and those that it loads later, by their names.

    Raises:
        AssetError: the sources cannot be put together (`server.scripts`).
    """
    made = scripts(name, folder)
    stem = name.removesuffix(".js")
    parts = {part: _asset(f"{stem}-{part}", text) for part, text in made.parts.items()}
    text = made.page({part: f"/static/{one.name}" for part, one in parts.items()})
    return {name: _asset(name, text), **{f"{stem}-{part}": one for part, one in parts.items()}}


def _asset(name: str, text: str) -> Asset:
    stem, _, ending = name.rpartition(".")
    content = SMALLER.get(ending, str)(text).encode()
    digest = sha256(content).hexdigest()[:12]
    return Asset(f"{stem}.{digest}.{ending}", f"{MEDIA['.' + ending]}; charset=utf-8", content)
