"""`parenting worlds`: the worlds and their levels, with the art; random levels; pictures of both."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from parenting._plural import counted
from parenting.agent.config import v1_names
from parenting.commands.errors import reason
from parenting.commands.options import folder
from parenting.commands.printing import say
from parenting.envs import registry
from parenting.envs.levels.spec import Level, WorldSpec

if TYPE_CHECKING:
    from parenting.envs.random_boxes import Survey

BOXES, ISLANDS = "side-effects", "unsafe-exploration"
RANDOM = f"{BOXES} or {ISLANDS}"
"""The worlds that have random levels: boxes for Sec. 3.4, islands to choose settings on."""
SIZES = {BOXES: "6x6", ISLANDS: "6x8"}
"""Rows and columns of random levels."""


def worlds(
    random: Annotated[
        str | None,
        typer.Option(metavar="WORLD", help=f"Print random levels of {RANDOM}."),
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(
            metavar="HxW",
            help="Rows and columns of the random levels.",
            show_default=f"{SIZES[BOXES]}, islands {SIZES[ISLANDS]}",
        ),
    ] = None,
    count: Annotated[
        int | None,
        typer.Option(min=1, help="Number of random levels; all of them differ.", show_default="1"),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=2**53 - 1,
            help="Seed; a smaller count gives the first levels of a larger one.",
            show_default="0",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER", parser=folder, help="Write each random level to a file in this folder."
        ),
    ] = None,
    draw: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER", parser=folder, help="Draw each level as an SVG picture in this folder."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")] = False,
) -> None:
    """List the worlds and their levels, with the art.

    With --random: levels that only moving the box solves, or islands with water in reach, as texts that
    `parenting run --level` takes. `parenting worlds import --help`: levels from other collections.

    Example: parenting worlds --random side-effects --size 6x6 --seed 3 > level.txt
    """
    try:
        if random is None:
            _only_with_random({"--size": size, "--count": count, "--seed": seed, "--out": out})
            _listed(draw, as_json)
        else:
            _random(random, size, count or 1, seed or 0, out, draw, as_json)
    except ValueError as error:
        say(str(error), err=True)
        raise typer.Exit(2) from None


def _only_with_random(options: Mapping[str, object]) -> None:
    """Refuse the options of random levels where none are asked for.

    Raises:
        ValueError: one of them is given.
    """
    for option, value in options.items():
        if value is not None:
            raise ValueError(
                f"{option}: {value} is for random levels. Add --random {RANDOM}, or leave {option} out."
            )


def _listed(draw: Path | None, as_json: bool) -> None:
    specs = list(registry.WORLDS.values())
    if draw:
        _draw(draw, [registry.level(spec.name, name) for spec in specs for name in spec.levels])
    found = [describe(spec) for spec in specs]
    say(json.dumps({"worlds": found}, indent=2) if as_json else "\n".join(map(_page, found)))
    for sentence in registry.INSTALLED.broken().values():
        say(sentence, err=True)


def describe(world: WorldSpec) -> dict[str, Any]:
    """A world as plain data: name, title, brief, legend, defaults, and its levels as rows and as text."""
    levels = [registry.level(world.name, name) for name in world.levels]
    return {
        "name": world.name,
        "title": world.title,
        "goal": world.brief.goal,
        "danger": world.brief.danger,
        "legend": dict(world.legend),
        "defaults": v1_names(registry.defaults(world.name)),
        "levels": [_plain(level) for level in levels],
    }


def _plain(level: Level) -> dict[str, Any]:
    return {"name": level.name, "rows": list(level.rows), "text": level.text}


def _random(
    world: str, size: str | None, count: int, seed: int, out: Path | None, draw: Path | None, as_json: bool
) -> None:
    """Print random levels of a world, and keep them as files and pictures.

    Raises:
        ValueError: a world that has none, a wrong size, or as `envs.random_boxes.survey`.
    """
    if registry.spec(world).name not in SIZES:
        raise ValueError(f"--random: {world} has no random levels; {RANDOM} has.")
    wanted = (count, *_size(SIZES[world] if size is None else size), seed)
    if world == ISLANDS:
        from parenting.envs.random_islands import island_levels

        islands = island_levels(*wanted)
        _keep(islands, out, draw)
        _islands_shown(islands, as_json)
        return
    from parenting.envs.random_boxes import survey

    found = survey(*wanted)
    _keep(found.levels, out, draw)
    _boxes_shown(found, as_json)


def _keep(levels: Iterable[Level], out: Path | None, draw: Path | None) -> None:
    if out:
        _write(out, ((f"{level.name}.txt", level.text) for level in levels))
    if draw:
        _draw(draw, levels)


def _islands_shown(levels: Sequence[Level], as_json: bool) -> None:
    """Islands, each with the moves of its shortest way where a program reads."""
    from parenting.envs.random_islands import way

    if as_json:
        said = [{**_plain(level), "moves": way(level)} for level in levels]
        say(json.dumps({"levels": said}, indent=2))
        return
    say("\n".join(level.text for level in levels), nl=False)


def _boxes_shown(found: Survey, as_json: bool) -> None:
    """Levels with a box; for a reader, what it took to find them is said on standard error."""
    from parenting.envs.random_boxes import tempts

    if as_json:
        levels = [{**_plain(level), "tempts": tempts(level)} for level in found.levels]
        say(json.dumps({"levels": levels, "solvable": found.solvable}, indent=2))
        return
    say("\n".join(level.text for level in found.levels), nl=False)
    solvable = counted(found.solvable, "level")
    said = f"{solvable} that only moving the box solves: {len(found.levels)} with a safe way, "
    say(f"{said}{found.tempting} of them tempt (the shortest way is unsafe).", err=True)


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,3})x(\d{1,3})", text, re.ASCII)
    if not found:
        raise ValueError(f"--size: '{text}' is not HxW. Write rows and columns as --size 6x8.")
    return int(found[1]), int(found[2])


def _draw(folder: Path, levels: Iterable[Level]) -> None:
    from parenting.drawing.level import draw_level

    pictures = ((f"world-{level.world}-{level.name}.svg", level) for level in levels)
    _write(folder, ((name, draw_level(level, registry.spec(level.world))) for name, level in pictures))


def _write(folder: Path, texts: Iterable[tuple[str, str]]) -> None:
    """Files into a folder, which is made if it is not there.

    Raises:
        ValueError: a file cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in texts:
            (folder / name).write_text(text, encoding="utf-8")
    except OSError as error:
        raise ValueError(f"{folder} cannot be written to: {reason(error)}.") from None


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
