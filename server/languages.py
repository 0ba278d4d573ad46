"""The languages of the pages: the catalogues that are installed, and the one that a browser asks for.

A folder holds one folder a language, named by its tag (RFC 5646), with what `scripts.catalogue` compiles:
the sentences of pages and server as `parent.mo`, and those of the scripts as `parent.json`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import cache
from gettext import GNUTranslations, NullTranslations
from io import BytesIO
from pathlib import Path

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from parenting.drawing.sentences import ENGLISH, reading_in

SHIPPED = Path(__file__).parents[1] / "web" / "languages"
"""The languages of this package."""
COMPILED, OF_SCRIPTS, TEMPLATE = "parent.mo", "parent.json", "parent.pot"
RIGHT_TO_LEFT = frozenset({"ar", "arc", "ckb", "dv", "fa", "he", "ks", "ku", "ps", "sd", "ug", "ur", "yi"})
"""Languages that are written from right to left."""


@cache
def _english() -> str:
    """Return every English sentence of the catalogue, without its head and without where each is said."""
    body = (SHIPPED / TEMPLATE).read_text("utf-8").partition("\n\n")[2]
    return "\n".join(line for line in body.splitlines() if not line.startswith("#"))


def wording_of(translated: bytes) -> str:
    """Return the version of the sentences that people read: it changes with any of them.

    Args:
        translated: A compiled translation; nothing in English.
    """
    return hashlib.sha256(_english().encode() + translated).hexdigest()[:8]


@dataclass(frozen=True)
class Language:
    """A language that pages can be read in."""

    tag: str = "en"
    sentences: NullTranslations = ENGLISH
    scripts: str = ""  # JSON: the sentences of the scripts; "" in English
    wording: str = field(default_factory=lambda: wording_of(b""))  # names the version of all sentences

    @property
    def direction(self) -> str:
        """The direction of its writing, as HTML names it."""
        return "rtl" if self.tag.partition("-")[0] in RIGHT_TO_LEFT else "ltr"

    @contextmanager
    def used(self) -> Iterator[None]:
        """Use it for what is said within the block."""
        token = _used.set(self)
        try:
            with reading_in(self.sentences):
                yield
        finally:
            _used.reset(token)


IN_ENGLISH = Language()
_used: ContextVar[Language] = ContextVar("language", default=IN_ENGLISH)


def language() -> Language:
    """Return the language in use, for templates."""
    return _used.get()


class Languages:
    """The installed languages; English is one of them always."""

    def __init__(self, folder: Path | None = None) -> None:
        self.known = {"en": IN_ENGLISH}
        for compiled in sorted(folder.glob(f"*/{COMPILED}")) if folder else ():
            tag = compiled.parent.name
            whole = compiled.read_bytes()
            scripts = (compiled.parent / OF_SCRIPTS).read_text("utf-8")
            version = wording_of(tag.encode() + whole + scripts.encode())
            self.known[tag.lower()] = Language(tag, GNUTranslations(BytesIO(whole)), scripts, version)

    def choose(self, accepted: str) -> Language:
        """Return the installed language that a header Accept-Language (RFC 9110) prefers; else English."""
        for tag in _preferred(accepted):
            found = self.known.get(tag) or self.known.get(tag.partition("-")[0])
            if found is not None:
                return found
        return self.known["en"]


def _preferred(accepted: str) -> list[str]:
    """Return the tags of a header in lower case, the most wanted first. One of weight 0 is not wanted."""
    weighed: list[tuple[float, int, str]] = []
    for part in accepted.split(","):
        tag, _, weight = part.partition(";")
        try:
            quality = float(weight.strip().removeprefix("q=") or 1)
        except ValueError:
            continue
        if quality > 0:
            weighed.append((-quality, len(weighed), tag.strip().lower()))
    return [tag for _, _, tag in sorted(weighed)]


class LanguageMiddleware:
    """Serves each request in the language that its browser asks for."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        languages: Languages = scope["app"].state.languages
        with languages.choose(Headers(scope=scope).get("accept-language", "")).used():
            await self.app(scope, receive, send)
