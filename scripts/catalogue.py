"""Collect the sentences of the parent's pages into web/languages/parent.pot, and compile translations.

`make catalogue` does both. A language is a folder web/languages/TAG with a file parent.po, made from the
template by `msginit` or an editor of translations.
"""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

from babel.messages.catalog import Catalog, Message
from babel.messages.extract import extract_from_dir
from babel.messages.mofile import write_mo
from babel.messages.pofile import read_po, write_po

from parenting.envs import registry
from parenting.server import errors
from parenting.server.languages import COMPILED, OF_SCRIPTS

ROOT = Path(__file__).parents[1]
LANGUAGES = ROOT / "web" / "languages"
TEMPLATE = LANGUAGES / "parent.pot"
METHODS = [
    ("drawing/*.py", "python"),
    ("server/**.py", "python"),
    ("web/templates/*.html", "jinja2"),
    ("web/static/*.js", "javascript"),
]
KEYWORDS = {
    "tr": None,
    "trn": (1, 2),
    "mark": None,
    "markn": (1, 2),
    "_": None,
    "_n": (1, 2),
    "_h": None,
    "t": None,
}
"""Functions whose first arguments are sentences: in Python, in templates, in scripts."""
CHANGED = datetime(2026, 11, 28, tzinfo=UTC)
"""The date in the template's header, always the same: only the sentences make a difference."""
VALUE = re.compile(r"(\{\w+\}|<[^>]*>|&\w+;)")
VOWELS = "aeiouAEIOU"
ACCENTS = str.maketrans(
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ",
    "åƀçðéƒĝĥîĵķļɱñöþǫŕšţûṽŵẋýžÅƁÇÐÉƑĜĤÎĴĶĻṀÑÖÞǪŔŠŢÛṼŴẊÝŽ",
)


@cache
def collect() -> Catalog:
    """Return the catalogue of all sentences, each with the files that say it."""
    found = Catalog(project="parenting", version="1", creation_date=CHANGED, charset="utf-8", fuzzy=False)
    for file, _, said, _, _ in sorted(
        extract_from_dir(ROOT, METHODS, keywords=KEYWORDS, directory_filter=_is_ours),
        key=lambda one: (one[0], one[1]),
    ):
        found.add(said, locations=[(file, 0)])
    for sentence in _of_errors():
        found.add(sentence, locations=[("server/errors.py", 0)])
    for name in _of_worlds():
        found.add(name, locations=[("envs/levels", 0)])
    return found


def template() -> bytes:
    """Return the text of the template."""
    return _written(
        lambda file: write_po(file, collect(), width=100, include_lineno=False, sort_by_file=True)
    )


def compile_language(catalogue: Catalog, folder: Path) -> None:
    """Write the two files that the server reads of a language into its folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / COMPILED).write_bytes(_written(lambda file: write_mo(file, catalogue)))
    of_scripts = {message.id for message in collect() if _is_of_scripts(message)}
    said = {
        str(message.id): str(message.string)
        for message in catalogue
        if message.id in of_scripts and message.string
    }
    (folder / OF_SCRIPTS).write_text(json.dumps(said, ensure_ascii=False), "utf-8")


def pseudo(tag: str) -> Catalog:
    """Return a language that shows what is not in the catalogue: accents on all letters, vowels twice.

    Its sentences are about 40 % longer than the English ones.
    """
    made = Catalog(locale=tag.partition("-")[0], fuzzy=False)
    for message in collect():
        if isinstance(message.id, tuple):
            forms = tuple(_disguised(message.id[min(number, 1)]) for number in range(made.num_plurals))
            made.add(message.id, forms)
        elif message.id:
            made.add(message.id, _disguised(str(message.id)))
    return made


def _disguised(sentence: str) -> str:
    return "".join(
        part if VALUE.fullmatch(part) else _long(part).translate(ACCENTS) for part in VALUE.split(sentence)
    )


def _long(text: str) -> str:
    return "".join(letter + letter.lower() if letter in VOWELS else letter for letter in text)


def _of_errors() -> Iterator[str]:
    """Yield the default sentences of errors: the docstrings of their classes."""
    for _, kind in inspect.getmembers(errors, inspect.isclass):
        if issubclass(kind, errors.ServerError):
            yield kind("").message


def _of_worlds() -> Iterator[str]:
    """Yield the names of tiles, and what is to be learnt; runs store them."""
    for spec in registry.BUILT_IN.values():
        yield from spec.legend.values()
        yield from (spec.brief.goal, spec.brief.danger)


def _is_of_scripts(message: Message) -> bool:
    return any(str(file).startswith("web/static/") for file, _ in message.locations)


def _is_ours(folder: str) -> bool:
    return not Path(folder).name.startswith((".", "_")) and Path(folder).name != "vendor"


def _written(write: Callable[..., None]) -> bytes:
    from io import BytesIO

    file = BytesIO()
    write(file)
    return file.getvalue()


def main() -> None:
    """Write the template, and compile the languages that are there."""
    LANGUAGES.mkdir(exist_ok=True)
    TEMPLATE.write_bytes(template())
    for translated in sorted(LANGUAGES.glob("*/parent.po")):
        with translated.open("rb") as file:
            compile_language(read_po(file), translated.parent)


if __name__ == "__main__":
    main()
