"""What requests may say: ids, client ids, ticks, choices, and the bodies of the verbs."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import Path, Query
from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from parenting.server import schemas
from parenting.server.new_run import LARGEST_INT, Goal, Pace
from parenting.server.schemas import By

RunId = Annotated[int, Path(ge=1, le=LARGEST_INT, description="The run's id.", examples=[1])]
QueryId = Annotated[int, Path(ge=1, le=LARGEST_INT, description="The question's id.", examples=[7])]
After = Annotated[
    int | None,
    Query(ge=-1, le=LARGEST_INT, description="Tell metrics too: those of the ticks after this one."),
]
ClientId = Annotated[str, StringConstraints(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9._:-]+$")]
Choice = schemas.Choice


class Strict(BaseModel):
    """A body that takes its own fields and no others; nothing is taken for a number that is none."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


class LeaseBody(Strict):
    """Who asks for a question, or lets go of it."""

    client_id: ClientId = Field(description="Any name of one's own: a browser's, the same in all its tabs.")


class AnswerBody(Strict):
    """What the parent said, and who."""

    choice: Choice = Field(description="left and right are the clips; neither: both are unacceptable.")
    client_id: ClientId = Field(description="The name under which the question was leased.")
    parent: By = Field("human", description="Who decided: a person or a script; kept beside the answer.")


class ChangeBody(Strict):
    """A changed probability of Sec. 2."""

    name: Literal["p_guid", "p_rec", "p_pref", "p_train"]
    value: float = Field(ge=0, le=1)


class GoalBody(Strict):
    """When the run rests."""

    goal: Goal | None = Field(description="Answers after which no tick passes; null: never.")


class PaceBody(Strict):
    """How fast the agent lives."""

    pace: Pace | None = Field(description="Ticks a second at most; null: as fast as it can.")
