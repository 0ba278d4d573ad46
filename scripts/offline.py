"""Fail if a built site loads anything from another host: `python scripts/offline.py build/docs`."""

from __future__ import annotations

import re
import sys
from html.parser import HTMLParser
from pathlib import Path

LOADING = {
    "script": "src",
    "img": "src",
    "iframe": "src",
    "source": "srcset",
    "object": "data",
    "use": "href",
    "image": "href",
}
"""Elements that load something when a page is shown, and the attribute that says from where."""
FOREIGN = re.compile(r"^\s*(https?:)?//")
CSS = re.compile(r"""(?:url\(|@import\s+)\s*["']?((?:https?:)?//[^"')\s;]+)""")


class Page(HTMLParser):
    """Collect the addresses on other hosts that a page loads from."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Look at one element; a plain link loads nothing until somebody follows it."""
        given = dict(attrs)
        loads = given.get("href") if tag == "link" and given.get("rel") != "canonical" else None
        address = loads or given.get(LOADING.get(tag, ""))
        if address and FOREIGN.match(address):
            self.found.append(address)
        self.found += CSS.findall(given.get("style") or "")


def foreign(folder: Path) -> list[str]:
    """List what the pages and style sheets of a folder load from other hosts, as "file: address"."""
    found = []
    for path in sorted(folder.rglob("*.html")):
        page = Page()
        page.feed(path.read_text(encoding="utf-8"))
        found += [f"{path.relative_to(folder)}: {address}" for address in page.found]
    for path in sorted(folder.rglob("*.css")):
        text = path.read_text(encoding="utf-8")
        found += [f"{path.relative_to(folder)}: {address}" for address in CSS.findall(text)]
    return found


def main(folder: str) -> int:
    """Print what is loaded from elsewhere; the exit code is 1 if there is any, or no page at all."""
    pages = list(Path(folder).rglob("*.html"))
    found = foreign(Path(folder))
    print(*found, f"{folder}: {len(pages)} pages, {len(found)} loads from other hosts", sep="\n")
    return int(bool(found) or not pages)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
