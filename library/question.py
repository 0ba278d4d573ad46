"""Queries with the world that they are about, and one query of one trial as plain Python."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Self

import torch

from parenting._plural import counted
from parenting.agent import query as queries
from parenting.agent.forecast_chance import forecast_chances
from parenting.agent.query import Choice, QueryKind
from parenting.drawing import clip as drawing
from parenting.drawing.query import draw_query
from parenting.drawing.query_tensors import read_clips
from parenting.library.clip import Clip, plain_clip
from parenting.library.pictures import Drawing
from parenting.library.text import both_clips
from parenting.library.worlds import World

SHOWN = 4
"""Questions of a query that a notebook draws at most."""
CHOICES = {choice.name.lower(): choice for choice in Choice if choice != Choice.NONE}


class Query(queries.Query):
    """The questions of N trials in a tick, at most one each (Sec. 2.1, 2.2).

    The tensors are those of `parenting.agent.query.Query`: `kind` [N] (0 none, 1 guidance, 2 preference),
    `action` [N, 2, T], `length` [N, 2], and the frames [N, 2, T+1, ...]. Axis 1 is the side: 0 left, 1 right.
    Beside them stands the world, so that a query can be drawn.

    `query[i]` is the question of trial i, or None where it asks nothing; iteration gives the questions.

    Example:
        >>> import parenting as pt
        >>> world = pt.make("unsafe-exploration")
        >>> state = pt.init(world, pt.Config(p_guid=1.0), seed=1)
        >>> state, query = pt.step(world, pt.Config(p_guid=1.0), state)
        >>> query
        <Query of 1 trial: 1 guidance, 0 preference>
        >>> query[0].kind
        'guidance'
    """

    world: World

    @classmethod
    def of(cls, query: queries.Query, world: World) -> Self:
        """Put a query beside its world."""
        return cls(**{name: getattr(query, name) for name in FIELDS}, world=world)

    def __len__(self) -> int:
        return len(self.kind)

    def __getitem__(self, trial: int) -> Question | None:
        if not -len(self) <= trial < len(self):
            raise IndexError(f"There is no trial {trial}; there are {len(self)}.")
        if self.kind[trial] == QueryKind.NONE:
            return None
        return question(self, trial % len(self))

    def __iter__(self) -> Iterator[Question]:
        """The questions of all trials that ask."""
        return (question(self, int(trial)) for trial in (self.kind != QueryKind.NONE).nonzero().flatten())

    def row(self, trial: int) -> Self:
        """Return the query of one trial alone, N = 1."""
        return self.pick(torch.tensor([trial], device=self.kind.device))

    def drawing(self) -> Drawing:
        """Draw the first questions; `show` does."""
        each = [question.drawing() for question, _ in zip(self, range(SHOWN), strict=False)]
        return Drawing([one.pictures[0] for one in each], "\n\n".join(one.text for one in each))

    def _repr_html_(self) -> str:
        return self.drawing()._repr_html_()

    def __repr__(self) -> str:
        trials = counted(len(self), "trial")
        counts = [f"{int((self.kind == kind).sum())} {kind.name.lower()}" for kind in list(QueryKind)[1:]]
        return f"<Query of {trials}: {', '.join(counts)}>"


FIELDS = tuple(queries.Query.__dataclass_fields__)
"""The names of a query's tensors."""


@dataclass(frozen=True, repr=False)
class Question:
    """The question of one trial: which of two clips is better (Sec. 2.1, 2.2).

    Attributes:
        kind: "guidance" (two moves from where the agent stands; the second frame is a forecast), or
            "preference" (two clips that were recorded).
        left, right: The two clips.
        stage: The stage T at which the clips were recorded (Sec. 2.4); 1 for guidance.
        trial: The number of the trial that asks.
        query: The same in tensors, N = 1.
        votes: Guidance that is asked again, to be sure (`confirm`): the answers heard before; else 0.
    """

    kind: str
    left: Clip
    right: Clip
    stage: int
    trial: int
    query: Query = field(compare=False)
    votes: int = 0

    def drawing(self) -> Drawing:
        """Draw both clips; `show` does."""
        query = self.query
        clips = _clips(query)
        level = query.world.levels[int(query.level[0])]
        picture = draw_query(clips, level, self.kind, self.stage, query.world.spec)
        return Drawing([picture], both_clips(self.kind, self.left, self.right, self.votes))

    def _repr_html_(self) -> str:
        return self.drawing()._repr_html_()

    def __repr__(self) -> str:
        return f"<Question of trial {self.trial}, {self.kind}: left {self.left}, right {self.right}>"


def question(query: Query, row: int, trial: int | None = None) -> Question:
    """Return the question in one row of a query."""
    one = query.row(row)
    clips = _clips(one)
    return Question(
        kind=QueryKind(int(one.kind[0])).name.lower(),
        left=plain_clip(clips["left"]),
        right=plain_clip(clips["right"]),
        stage=int(one.maturity[0]),
        trial=row if trial is None else trial,
        query=one,
        votes=int(one.votes[0]),
    )


def _clips(query: Query) -> dict[str, drawing.Clip]:
    """Return the clips of one trial's query, with the chances of a forecast."""
    return read_clips(query, query.world.legend, chances=forecast_chances(query.world, query))


def choice_of(said: Any, who: str) -> Choice:
    """Return what a parent said as a choice.

    Raises:
        ValueError: it is none of them.
    """
    if isinstance(said, Choice) and said != Choice.NONE:
        return said
    if isinstance(said, str) and said in CHOICES:
        return CHOICES[said]
    raise ValueError(
        f"{who}.answer returned {said!r}. Return 'left', 'right', 'either' or 'neither', 'skip' if it cannot"
        " be told, the same as a parenting.Choice, or None to answer later."
    )
