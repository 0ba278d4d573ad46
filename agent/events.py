"""The operator's events: what an operator may do to a running agent.

Each event applies before one tick, is recorded with that tick, and is repeated in a replay.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Probability = Annotated[float, Field(ge=0, le=1)]


class Mature(BaseModel):
    """End this stage now: pi_T is frozen and pi_{T+1} begins as its copy (Sec. 2.4)."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    kind: Literal["mature"] = "mature"


class EndEpisode(BaseModel):
    """End this episode now: the way out when no action is acceptable. The next tick starts a new one."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    kind: Literal["end_episode"] = "end_episode"


class Change(BaseModel):
    """Set one of the four probabilities of Sec. 2 from this tick on."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    kind: Literal["change"] = "change"
    name: Literal["p_guid", "p_rec", "p_pref", "p_train"]
    value: Probability


Event = Annotated[Mature | EndEpisode | Change, Field(discriminator="kind")]
"""One of the operator's events, as stored in the table `event` and taken by `agent.parenting.tick`."""
