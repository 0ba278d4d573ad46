"""Render the templates of this package, with the style rules that a picture on its own has to hold."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from parenting.drawing.symbols import SYMBOLS, TEMPLATES, TURNS, symbols_of

STYLE = Path(__file__).parent / "style"

RULE = re.compile(r"^((?:\.|symbol)[^{}@]*?) *\{([^{}]*)\}$", re.MULTILINE)
VARIABLE = re.compile(r"--([\w-]+): ([^;]+);")
CLASS = re.compile(r"\.([\w-]+)")
USED = re.compile(r'href="#([\w-]+)"')


def environment(*folders: Path) -> Environment:
    """Return a Jinja environment over folders and this package. Text is escaped everywhere."""
    made = Environment(
        loader=FileSystemLoader([*folders, TEMPLATES]),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    made.globals.update(symbol=SYMBOLS.__getitem__, symbols_of=symbols_of, turns=TURNS)
    return made


_environment = environment()


def render(template: str, **context: object) -> str:
    """Return the text of a template of this package."""
    return _environment.get_template(template).render(**context)


def standalone(template: str, **context: object) -> str:
    """Return a template's text with the symbols and the style, light and dark, that its drawing needs."""
    drawing = render(template, **context, symbols=[], style="")
    symbols = [name for name in SYMBOLS if name in USED.findall(drawing)]
    drawing = render(template, **context, symbols=symbols, style="")
    return render(template, **context, symbols=symbols, style=style(drawing))


def style(drawing: str) -> str:
    """Return the rules for a drawing's classes, and the colours of these rules, in light and in dark."""
    present = {name for names in re.findall(r'class="([^"]*)"', drawing) for name in names.split()}
    rules = RULE.findall(_sheet("colours.css") + _sheet("board.css") + _sheet("picture.css"))
    chosen = [(names, body) for names, body in rules if _applies(names, present)]
    needed = {name for _, body in chosen for name in re.findall(r"var\(--([\w-]+)\)", body)}
    light, _, dark = _sheet("colours.css").partition("@media")
    at_night = f"@media (prefers-color-scheme: dark) {{ {_colours(dark, needed)} }}"
    return "\n".join([_colours(light, needed), at_night, *(f"{names} {{{body}}}" for names, body in chosen)])


@cache
def _sheet(name: str) -> str:
    return (STYLE / name).read_text(encoding="utf-8")


def _applies(names: str, present: set[str]) -> bool:
    """Return True if one of a rule's selectors, between commas, names only classes that are present."""
    return any(set(CLASS.findall(one)) <= present for one in names.split(","))


def _colours(sheet: str, needed: set[str]) -> str:
    found = [f"--{name}: {value};" for name, value in VARIABLE.findall(sheet) if name in needed]
    return f":root {{ {' '.join(found)} }}"
