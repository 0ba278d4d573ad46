"""One style sheet and one script a page, put together from their sources when they are first asked for.

A script is its page's ES module and all that it imports, in the order in which a browser would run them. Each
module becomes a block with its own names. Addresses hold a hash of the content, so a browser keeps a copy for
good; an upgrade, which restarts the server, changes the addresses. The sources stay addressable one by one.
"""

from __future__ import annotations

import gzip
import re
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path

from parenting.drawing.render import STYLE

STATIC = Path(__file__).parents[1] / "web" / "static"
EVERY_PAGE = ("colours.css", "site.css")
SHEETS = {
    "page.css": EVERY_PAGE,
    "parent.css": (*EVERY_PAGE, "board.css", "parent.css"),
    "history.css": (*EVERY_PAGE, "board.css", "parent.css", "forms.css", "history.css"),
    "dashboard.css": (*EVERY_PAGE, "forms.css", "dashboard.css"),
    "start.css": (*EVERY_PAGE, "forms.css", "start.css"),
    "end.css": (
        *EVERY_PAGE,
        "forms.css",
    ),
    "error.css": (
        *EVERY_PAGE,
        "parent.css",
    ),
    "docs.css": ("docs.css",),
}
"""The sheets of each page. That of the API's description stands alone, after one of another package."""
SCRIPTS = ("parent.js", "history.js", "dashboard.js", "start.js", "docs.js")
PICTURES = ("icon.svg", "query.svg", "question.svg")
MEDIA = {".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}

IMPORT = re.compile(r'^import (?:\{ ([\w$, ]+) \} from )?"\./([\w-]+\.js)";\n', re.MULTILINE)
EXPORT = re.compile(r"^export (?=(?:async function|function|const|class) )", re.MULTILINE)
OTHER = re.compile(r"^(?:import\b.*|export\b.*)|\bimport\(.*", re.MULTILINE)
REMARK = re.compile(r"^ *//.*\n", re.MULTILINE)


class AssetError(Exception):
    """A source uses a form of import or export that cannot be put into one script."""


@dataclass(frozen=True, slots=True)
class Asset:
    """A file as it is served: its address' last part, its type, its bytes, plain and compressed."""

    name: str
    media: str
    content: bytes
    compressed: bytes


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
    texts |= {name: script(name) for name in SCRIPTS}
    texts |= {name: (STATIC / name).read_text("utf-8") for name in PICTURES}
    return {name: _asset(name, text.encode()) for name, text in texts.items()}


def sheet(parts: tuple[str, ...]) -> str:
    """Return these sheets as one, in this order."""
    folders = {"colours.css": STYLE, "board.css": STYLE}
    return "\n".join((folders.get(one, STATIC) / one).read_text("utf-8") for one in parts)


def script(name: str, folder: Path = STATIC) -> str:
    """Return one module made of a module and all that it imports.

    Raises:
        AssetError: a source has another form of import or export than `import { a, b } from "./c.js"`,
            `import "./c.js"`, `export function` and `export const`, or a cycle imports something other
            than a function.
    """
    sources: dict[str, str] = {}
    _collect(name, folder, sources, set())
    wanted: dict[str, set[str]] = {one: set() for one in sources}
    for text in sources.values():
        for names, origin in IMPORT.findall(text):
            wanted[origin] |= set(_names(names))
    heads = "".join(f"const {_scope(one)} = {{}};\n" for one in sources)
    done: dict[str, str] = {}
    for one in sources:
        done[one] = _block(one, sources, done, wanted[one])
    return heads + "".join(done.values())


def _collect(name: str, folder: Path, sources: dict[str, str], begun: set[str]) -> None:
    """Add a module's source after those that it imports."""
    begun.add(name)
    text = (folder / name).read_text("utf-8")
    for _, origin in IMPORT.findall(text):
        if origin not in begun:
            _collect(origin, folder, sources, begun)
    sources[name] = text


def _block(name: str, sources: dict[str, str], done: dict[str, str], wanted: set[str]) -> str:
    """Return a module as a block: what it gives and takes at its beginning, its text, its constants."""
    text = sources[name]
    lines = []
    for names, origin in IMPORT.findall(text):
        if origin in done:
            lines += [f"const {{ {names} }} = {_scope(origin)};\n"] if names else []
            continue
        for one in _names(
            names
        ):  # a cycle: the other module has not run yet, so its functions are looked up late
            if not _is_function(one, sources[origin]):
                raise AssetError(
                    f"{name} imports {one} of {origin}, which imports {name}: only functions can be."
                )
            lines.append(f"const {one} = (...given) => {_scope(origin)}.{one}(...given);\n")
    body = REMARK.sub("", EXPORT.sub("", IMPORT.sub("", text)))
    if (other := OTHER.search(body)) is not None:
        raise AssetError(f"{name} cannot be put into one script: {other[0]}")
    functions = sorted(one for one in wanted if _is_function(one, text))
    constants = sorted(wanted - set(functions))
    first, last = _give(name, functions), _give(name, constants)
    return f"{{ // {name}\n{first}{''.join(lines)}{body}{last}}}\n"


def _give(name: str, names: list[str]) -> str:
    return f"Object.assign({_scope(name)}, {{ {', '.join(names)} }});\n" if names else ""


def _is_function(name: str, text: str) -> bool:
    return re.search(rf"^export (?:async )?function {re.escape(name)}\(", text, re.MULTILINE) is not None


def _names(names: str) -> list[str]:
    return names.split(", ") if names else []


def _scope(name: str) -> str:
    return "of_" + name.removesuffix(".js").replace("-", "_")


def _asset(name: str, content: bytes) -> Asset:
    stem, _, ending = name.rpartition(".")
    digest = sha256(content).hexdigest()[:12]
    media = f"{MEDIA['.' + ending]}; charset=utf-8"
    return Asset(f"{stem}.{digest}.{ending}", media, content, gzip.compress(content, 9, mtime=0))
