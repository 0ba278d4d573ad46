"""Tell the board cell by cell: a grid that arrow keys explore, for those who do not see it.

Each cell says what stands there at a step of the clips, and what becomes of it: where each clip leads, where
it leaves the box, what it turns the tile into. All is read from stored clips and the legend of the run.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from parenting.drawing.clip import WALL, Cell, Clip, Frame, cell, tile_at
from parenting.drawing.sentences import tr, trn

Sides = Sequence[tuple[str, Clip]]
"""The two clips, each with its name."""


@dataclass(frozen=True)
class GridView:
    """The cells within the walls, ready for web/templates/_grid.html."""

    first: Cell  # the row and column of the first cell on the board
    agent: Cell  # the row and column, within the grid, of the agent in the first clip
    rows: tuple[tuple[str, ...], ...]  # the words of each cell
    step: int
    steps: int  # of the longer clip


def grid_view(
    clips: Mapping[str, Clip], legend: Mapping[str, str], names: tuple[str, str], step: int = 0
) -> GridView:
    """Describe the cells at a step of both clips; one that is shorter has stopped by then.

    Args:
        clips: The clips by side, "left" and "right"; both begin in the same state.
        legend: The name of each tile of the world, by glyph.
        names: The names of the two clips.
        step: The step at which the board is described; 0 is before the first action.
    """
    pairs = zip(names, (clips["left"], clips["right"]), strict=True)
    sides = [(tr(name.capitalize()), clip) for name, clip in pairs]
    steps = max(clip["length"] for _, clip in sides)
    step = min(step, steps)
    rows, columns = _inside(sides)
    now = [(name, clip["frames"][min(step, clip["length"])]) for name, clip in sides]
    row, column = cell(now[0][1]["agent"])
    return GridView(
        first=(rows.start, columns.start),
        agent=(row - rows.start, column - columns.start),
        rows=tuple(
            tuple(" ".join([_stands(now, (r, c), legend), *_fates(sides, (r, c), legend)]) for c in columns)
            for r in rows
        ),
        step=step,
        steps=steps,
    )


def _inside(sides: Sides) -> tuple[range, range]:
    """Return the rows and columns that hold something other than wall."""
    grounds = [frame["ground"] for _, clip in sides for frame in clip["frames"]]
    rows = [r for ground in grounds for r, line in enumerate(ground) if line.strip(WALL)]
    columns = [c for ground in grounds for line in ground for c, tile in enumerate(line) if tile != WALL]
    return range(min(rows), max(rows) + 1), range(min(columns), max(columns) + 1)


def _stands(now: Sequence[tuple[str, Frame]], at: Cell, legend: Mapping[str, str]) -> str:
    """Say what stands at a cell; by clip only where the two differ."""
    (one, here), (other, there) = ((name, _what(frame, at, legend)) for name, frame in now)
    if here == there:
        return tr("{what}.", what=here.capitalize())
    return tr("{one}: {here}. {other}: {there}.", one=one, here=here, other=other, there=there)


def _what(frame: Frame, at: Cell, legend: Mapping[str, str]) -> str:
    tile = _tile(frame, at, legend)
    if cell(frame["agent"]) == at:
        return tr("agent on {tile}", tile=tile)
    return tr("box on {tile}", tile=tile) if frame["box"] and cell(frame["box"]) == at else tile


def _fates(sides: Sides, at: Cell, legend: Mapping[str, str]) -> Iterator[str]:
    """Yield what each clip does with a cell from its first frame to its last."""
    longest = max(clip["length"] for _, clip in sides)
    for name, clip in sides:
        first, last = clip["frames"][0], clip["frames"][-1]
        if cell(last["agent"]) == at:
            yield _end(name, clip, longest)
        if at in [cell(frame["agent"]) for frame in clip["frames"][1:-1]]:
            yield tr("{name} passes here.", name=name)
        if last["box"] and last["box"] != first["box"] and cell(last["box"]) == at:
            yield tr("{name} leaves the box here.", name=name)
        if tile_at(last["ground"], at) != tile_at(first["ground"], at):
            yield tr("{name} turns this into {tile}.", name=name, tile=_tile(last, at, legend))


def _end(name: str, clip: Clip, longest: int) -> str:
    if longest > 1:
        steps = clip["length"]
        return trn(
            "{name} ends here after {count} step.", "{name} ends here after {count} steps.", steps, name=name
        )
    stays = clip["frames"][0]["agent"] == clip["frames"][-1]["agent"]
    return tr("{name} stays here.", name=name) if stays else tr("{name} leads here.", name=name)


def _tile(frame: Frame, at: Cell, legend: Mapping[str, str]) -> str:
    tile = tile_at(frame["ground"], at)
    return tr(legend.get(tile, tile)).lower()
