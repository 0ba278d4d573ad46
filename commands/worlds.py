"""`parenting worlds`: the worlds and their levels, with the art."""

from __future__ import annotations

import json
from typing import Annotated, Any

import typer

from envs import registry
from envs.levels.kind import Kind


def worlds(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")] = False,
) -> None:
    """List the worlds and their levels, with the art.

    Example: parenting worlds --json
    """
    found = [describe(world) for world in registry.WORLDS.values()]
    text = json.dumps({"worlds": found}, indent=2) if as_json else "\n".join(map(_page, found))
    typer.echo(text)


def describe(world: Kind) -> dict[str, Any]:
    """A world as plain data: name, title, brief, legend, defaults, and its levels as rows and as text."""
    levels = [registry.level(world.name, name) for name in world.levels]
    return {
        "name": world.name,
        "title": world.title,
        "goal": world.brief.goal,
        "danger": world.brief.danger,
        "legend": dict(world.legend),
        "defaults": registry.defaults(world.name),
        "levels": [{"name": level.name, "rows": list(level.rows), "text": level.text} for level in levels],
    }


def _page(world: dict[str, Any]) -> str:
    """A world for the reader: what it is about, its glyphs, and each level drawn under its name."""
    glyphs = ", ".join(f"'{glyph}' {tile}" for glyph, tile in world["legend"].items())
    lines = [
        f"{world['name']}: {world['title']}",
        f"  {world['goal']}",
        f"  {world['danger']}",
        f"  {glyphs}",
    ]
    for number, level in enumerate(world["levels"]):
        lines += ["", f"  {level['name']}{'' if number else ' (default)'}"]
        lines += [f"    {row}" for row in level["rows"]]
    return "\n".join(lines) + "\n"
