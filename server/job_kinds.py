"""The kinds of jobs, and what may be asked with each. Free of torch: the web process checks what is asked.

A kind is added here with its payload and in `server.work.doers` with what a worker does; a test holds both
lists equal. Payloads are small by their types: no text of any length, no lists.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from parenting.server.whole import WHOLE


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


KINDS: dict[str, type[Payload]] = {"walk": WalkPayload, "policy": PolicyPayload, "episode": EpisodePayload}
"""The payload of each kind of job."""
