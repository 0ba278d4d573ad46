"""ES modules of the pages: the imports and exports of a source, read so that several can become one script.

The sources are our own and formatted alike: statements of import and export begin a line and end in a
semicolon. What is written otherwise is refused at the start, with file and line.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

COMMENT = re.compile(r"^[ \t]*//.*$", re.MULTILINE)
IMPORT = re.compile(r'^import\s+(?:([^"\';]+?)\s+from\s+)?"\./([\w-]+\.js)";[ \t]*$', re.MULTILINE)
DYNAMIC = re.compile(r'\bimport\(\s*"\./([\w-]+\.js)"\s*\)')
DECLARATION = re.compile(r"^export (?=(?:async function|function|class)\b\*? *([\w$]+))", re.MULTILINE)
VARIABLES = re.compile(r"^export (?=(const|let) )", re.MULTILINE)
DEFAULT = re.compile(
    r"^export default (?:(?=(?:async function|function|class)\b\*? +([\w$]+))|)", re.MULTILINE
)
LIST = re.compile(r"^export \{([^}]*)\};[ \t]*$", re.MULTILINE)
REFUSED = re.compile(
    r"^(?:import|export|var)\b.*|\bimport(?:\(|\.meta\b).*|^(?:(?:const|let)\b[^;\n]*=\s*|for )?await\b.*",
    re.MULTILINE,
)
TOKEN = re.compile(
    r'"(?:\\.|[^"\\])*"'
    r"|'(?:\\.|[^'\\])*'"
    r"|`(?:\\.|[^`\\])*`"
    r"|//.*|(?<=[=(,:?&|!] )/(?:\\.|\[[^\]]*\]|[^/\\\n])+/"  # a regular expression, where a value is expected
    r"|[^\"'`]"
)
DEFAULT_NAME = "$default"


class AssetError(Exception):
    """A source uses a form of import or export that cannot be put into one script."""


@dataclass(frozen=True, slots=True)
class Import:
    """One statement: the names taken from another module, or the module as a whole."""

    origin: str
    line: int
    names: tuple[tuple[str, str], ...] = ()  # as exported there, and as known here
    whole: str | None = None


@dataclass(slots=True)
class Module:
    """A source without its imports and exports, and what these were."""

    name: str
    text: str
    imports: list[Import] = field(default_factory=list)
    exports: dict[str, str] = field(default_factory=dict)  # as known elsewhere: as known here
    functions: set[str] = field(default_factory=set)  # names here that hold before the module has run
    variables: set[str] = field(default_factory=set)  # names here that may change: `let`
    dynamic: list[str] = field(default_factory=list)  # the modules that it loads when it needs them

    @property
    def key(self) -> str:
        """Its name in a script."""
        return self.name.removesuffix(".js").replace("-", "_")

    def statics(self) -> Iterator[str]:
        """Yield the modules that run before it."""
        return (one.origin for one in self.imports)


def read_module(name: str, folder: Path) -> Module:
    """Read a module of a folder.

    Raises:
        AssetError: there is no such file, or it has a form of import or export that cannot be put together;
            the sentence names the line.
    """
    try:
        text = (folder / name).read_text("utf-8")
    except FileNotFoundError:
        raise AssetError(f"There is no script {name}.") from None
    module = Module(name, COMMENT.sub("", text))
    module.text = IMPORT.sub(lambda found: _take(module, found), module.text)
    module.dynamic = DYNAMIC.findall(module.text)
    _read_exports(module)
    if (other := REFUSED.search(DYNAMIC.sub("", module.text))) is not None:
        line = _line(DYNAMIC.sub("", module.text), other.start())
        raise AssetError(f"{name}:{line} cannot be put into one script: {other[0].strip()}")
    return module


def _take(module: Module, found: re.Match[str]) -> str:
    """Note an import, and leave its lines empty so that those below keep their numbers."""
    line = _line(module.text, found.start())
    clause, origin = found[1] or "", found[2]
    names: list[tuple[str, str]] = []
    if (braces := re.search(r"\{([^}]*)\}", clause)) is not None:
        names += _renamed(braces[1])
        clause = clause.replace(braces[0], "")
    whole = re.search(r"\*\s+as\s+([\w$]+)", clause)
    if whole is not None:
        clause = clause.replace(whole[0], "")
    if (own := clause.strip(" ,\n\t")) and re.fullmatch(r"[\w$]+", own):
        names.append(("default", own))
    elif own:
        raise AssetError(f"{module.name}:{line} cannot be put into one script: {found[0].splitlines()[0]}")
    module.imports.append(Import(origin, line, tuple(names), whole[1] if whole else None))
    return "\n" * found[0].count("\n")


def _read_exports(module: Module) -> None:
    """Note what a module exports, and leave the plain declarations."""
    functions = re.findall(r"^(?:export (?:default )?)?(?:async )?function\b\*? *([\w$]+)", module.text, re.M)
    module.functions = set(functions)
    for found in re.finditer(r"^(?:export )?let ", module.text, re.MULTILINE):
        module.variables |= set(declared(module.text[found.end() :]))
    for found in DECLARATION.finditer(module.text):
        module.exports[found[1]] = found[1]
    for found in VARIABLES.finditer(module.text):
        names = declared(module.text[found.end() + len(found[1]) :])
        module.exports |= {name: name for name in names}
    for found in LIST.finditer(module.text):
        module.exports |= {there: here for here, there in _renamed(found[1])}
    for found in DEFAULT.finditer(module.text):
        module.exports["default"] = found[1] or DEFAULT_NAME
    text = LIST.sub(lambda found: "\n" * found[0].count("\n"), module.text)
    text = DEFAULT.sub(lambda found: "" if found[1] else f"const {DEFAULT_NAME} = ", text)
    module.text = VARIABLES.sub("", DECLARATION.sub("", text))


def declared(text: str) -> list[str]:
    """Return the names that a declaration declares, given the text after its keyword."""
    names: list[str] = []
    depth, pattern = 0, ""
    reading = True  # of what stands left of an equals sign
    for found in TOKEN.finditer(text):
        token = found[0]
        depth += (token in "([{") - (token in ")]}")
        if depth == 0 and token in ",;=":
            names += _bound(pattern) if reading else []
            pattern, reading = "", token == ","
            if token == ";":
                break
        elif reading:
            pattern += token
    return names


def _bound(pattern: str) -> list[str]:
    """Return the names that one pattern binds: a name, or those in braces or brackets."""
    parts = re.split(",", pattern.strip().strip("{}[]"))
    found = (re.match(r"(?:[\w$]+\s*:\s*|\.\.\.)?([\w$]+)", part.strip()) for part in parts)
    return [one[1] for one in found if one is not None]


def _renamed(names: str) -> list[tuple[str, str]]:
    """Return the pairs of a list such as `a, b as c`."""
    parts = (part.split() for part in names.split(",") if part.strip())
    return [(part[0], part[-1]) for part in parts]


def _line(text: str, at: int) -> int:
    return text.count("\n", 0, at) + 1
