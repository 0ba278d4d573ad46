"""The kinds of jobs, and what may be asked with each. Free of torch: the web process checks what is asked.

A kind is added here with its payload and in `server.work.doers` with what a worker does; a test holds both
lists equal. Payloads are small by their types: no text of any length, no lists.
"""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from parenting.envs.art import LARGEST, SMALLEST
from parenting.server.whole import WHOLE

MOST_ROWS = 1_000
"""Rows and columns that a payload can name."""
MOST_GLYPHS = 10_000
"""Characters of a board in a payload."""


class Payload(BaseModel):
    """The arguments of a job; unknown fields are refused."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class WalkPayload(Payload):
    """A walk: an episode that the present policy plays by itself, apart from its life."""

    seed: Annotated[int, Field(ge=0, lt=2**31), WHOLE] = Field(
        0, description="Another seed draws other moves from the same policy."
    )


class PolicyPayload(Payload):
    """The present policy in every cell; nothing else needs to be said."""


class EpisodePayload(Payload):
    """An episode of the life, shown again."""

    tick: Annotated[int, Field(ge=1, lt=2**53), WHOLE] = Field(1, description="A tick of the episode.")


Row = Annotated[int, Field(ge=0, lt=MOST_ROWS), WHOLE]


class StatePayload(Payload):
    """The present policy, or an earlier stage's, in one state, which the agent need never have met."""

    row: Row = Field(0, description="The agent's row, from 0.")
    column: Row = Field(0, description="The agent's column, from 0.")
    rest: Annotated[int, Field(ge=0, lt=2**53), WHOLE] | None = Field(
        None, description="A number of the board's `rests`; null: all else as an episode begins."
    )
    ground: str | None = Field(
        None,
        max_length=MOST_GLYPHS,
        description="Another board instead: its rows without agent and box, with a line end after each.",
    )
    box_row: Row | None = Field(None, description="Another place of the box: its row, from 0.")
    box_column: Row | None = Field(None, description="The column of that place.")
    stage: Annotated[int, Field(ge=1, le=16), WHOLE] | None = Field(
        None, description="The stage of the policy; null: the present one."
    )

    @model_validator(mode="after")
    def _a_box_has_a_cell(self) -> Self:
        if (self.box_row is None) != (self.box_column is None):
            raise ValueError("box_row and box_column must be given together.")
        return self


class PretrainPayload(Payload):
    """Weights for runs in one world on levels of one size (Sec. 3.1.4)."""

    world: Annotated[str, Field(max_length=100)]
    height: Annotated[int, Field(ge=SMALLEST, le=LARGEST), WHOLE]
    width: Annotated[int, Field(ge=SMALLEST, le=LARGEST), WHOLE]


KINDS: dict[str, type[Payload]] = {
    "walk": WalkPayload,
    "policy": PolicyPayload,
    "episode": EpisodePayload,
    "state": StatePayload,
}
"""The payload of each kind of job of a run."""
OF_NO_RUN: dict[str, type[Payload]] = {"pretrain": PretrainPayload}
"""The payload of each kind of job that belongs to no run."""
