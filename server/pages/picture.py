"""A level as a picture of its own (SVG), in the tiles of the parent's page: for the docs, light and dark.

The style is read from the page's own style sheets, so that a picture looks as the page does.
"""

from __future__ import annotations

import re

from parenting.drawing.board import Board, build_board
from parenting.drawing.clip import Clip, Frame
from parenting.envs.levels.spec import AGENT, BOX, LAND, PIECES, Level, WorldSpec
from parenting.server.pages.render import WEB, render

RULE = re.compile(r"^(\.[^{}@]+?) *\{([^{}]*)\}$", re.MULTILINE)
VARIABLE = re.compile(r"--([\w-]+): ([^;]+);")
CLASS = re.compile(r"\.([\w-]+)")


def picture(level: Level, spec: WorldSpec) -> str:
    """One level as the text of an SVG file. The same level gives the same text."""
    context = {"board": _board(level), "legend": spec.legend, "title": f"{spec.title}: {level.name}"}
    return render("level.svg", **context, style=style(render("level.svg", **context, style="")))


def style(drawing: str) -> str:
    """The rules that a drawing's classes need, and the colours that these need, in light and in dark."""
    present = {name for names in re.findall(r'class="([^"]*)"', drawing) for name in names.split()}
    sheet = (WEB / "static/parent.css").read_text(encoding="utf-8").partition("/* The board */")[2]
    chosen = [(names, body) for names, body in RULE.findall(sheet) if _applies(names, present)]
    needed = {name for _, body in chosen for name in re.findall(r"var\(--([\w-]+)\)", body)}
    light, _, dark = (WEB / "static/site.css").read_text(encoding="utf-8").partition("@media")
    rules = [f"{names} {{{body}}}" for names, body in chosen]
    at_night = f"@media (prefers-color-scheme: dark) {{ {_colours(dark, needed)} }}"
    return "\n".join([_colours(light, needed), at_night, *rules])


def _applies(names: str, present: set[str]) -> bool:
    """Whether one of a rule's selectors, between commas, speaks of classes that are all there."""
    return any(set(CLASS.findall(one)) <= present for one in names.split(","))


def _colours(sheet: str, needed: set[str]) -> str:
    found = [f"--{name}: {value};" for name, value in VARIABLE.findall(sheet) if name in needed]
    return f":root {{ {' '.join(found)} }}"


def _board(level: Level) -> Board:
    """The level as a clip of one frame, in which nothing has happened yet."""
    ground = [re.sub(f"[{PIECES}]", LAND, row) for row in level.rows]
    box = [list(cell) for cell in level.find(BOX)]
    (agent,) = level.find(AGENT)
    frame = Frame(ground=ground, observed=ground, agent=list(agent), box=box[0] if box else None)
    return build_board(Clip(actions=[], length=0, frames=[frame]))
