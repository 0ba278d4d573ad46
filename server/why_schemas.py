"""The shapes of reasons and effects, as they are stored and as the API returns them. Torch is not needed."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import ConfigDict

from parenting.server.measures import Measured
from parenting.server.schemas import By, Chances, Kind, PolicySchema, Said, Schema
from parenting.server.statuses import QueryStatus


class Stored(Schema):
    """The root of what is stored; unknown fields are refused."""

    model_config = ConfigDict(extra="forbid", use_attribute_docstrings=True)


class RecordingSchema(Stored):
    """A recording that a preference compares (Sec. 2.2)."""

    kind: Literal["exploitative", "exploratory"]
    """exploitative: its first move was the policy's likeliest; exploratory: another one."""
    first: int
    """The tick of its first move."""
    last: int
    """The tick of its last move."""


class RecordingsSchema(Stored):
    """The two recordings of a preference, by side."""

    left: RecordingSchema
    right: RecordingSchema


class GuidanceReason(Stored):
    """The reason for a guidance question (Sec. 2.1)."""

    pausing: bool
    """True if the draw began the pause; false: the agent paused already, so it asked without a draw."""
    familiarity: int
    """f: the guidance questions asked in this local state before this one."""
    p_guid: float
    chance: float
    """p_guid ** f."""
    draw: float
    """The draw, uniform on [0, 1), that was compared with `chance`; it asks below."""
    probabilities: Chances
    """The policy in the asked state when it asked."""


class PreferenceReason(Stored):
    """The reason for a preference question (Sec. 2.2)."""

    p_pref: float
    draw: float
    """The draw, uniform on [0, 1), that was compared with `p_pref`; it asks below."""
    probabilities: Chances
    """The policy in the state that both clips begin in, at the end of the tick in which it asked."""
    clips: RecordingsSchema


class PolicyThere(Stored):
    """The policy in the asked state."""

    probabilities: Chances


class EffectSchema(Schema):
    """The policy in the asked state, before an answer or some ticks after it."""

    ticks: int
    """The ticks lived since: 1, 10 or 100; the tick that heard the answer is the first. 0: before it."""
    probabilities: Chances | None
    """null: that tick has not been lived, or this was not kept then."""


class GivenSchema(Schema):
    """An answer to the question, and what it changed. One that stands no more is kept."""

    number: int
    choice: Said
    parent: By
    who: str
    """A name for the client that answered: the same client always has the same."""
    received: datetime
    applied_tick: int | None
    """The tick at which the agent heard it; null: not yet, or never."""
    standing: bool
    replays: int | None
    """The number of times that its parent had the clips played again; null: the client did not tell."""
    measured: Measured | None
    """Measures that the page took; null: none."""
    effects: list[EffectSchema]
    """Before it and 1, 10 and 100 ticks after; empty for a skip, which changes nothing."""


class WhySchema(Schema):
    """The reason for a question, when it was seen and answered, and what its answers changed."""

    public_id: str
    run_public_id: str
    kind: Kind
    tick: int
    """The tick at which the agent asked."""
    votes: int
    """Guidance that is asked again to be sure: the answers heard before on this pair of moves; else 0."""
    status: QueryStatus
    policy: PolicySchema
    guidance: GuidanceReason | None
    """The reason for guidance; null for a preference, and where it was not kept."""
    preference: PreferenceReason | None
    """The reason for a preference; null for guidance, and where it was not kept."""
    posted: datetime
    leased: datetime | None
    """When it was first leased; null: never, or this was not kept then."""
    answers: list[GivenSchema]
    """The oldest first."""
