"""The columns of `questions`: a row for each question, answered or not, with its two clips."""

from __future__ import annotations

from parenting.server.archive.columns import BROKEN, DAMAGED, NOT_KEPT, RUN, Column, of_moves, row_model
from parenting.server.schemas import ClipSchema

GUIDANCE, PREFERENCE = "a preference, or not kept", "guidance, or not kept"


def _recording(side: str) -> list[Column]:
    return [
        Column(f"why_{side}_kind", str, f"exploitative or exploratory: the recording {side}", PREFERENCE),
        Column(f"why_{side}_first", int, f"the tick of the first move {side}", PREFERENCE, "tick"),
        Column(f"why_{side}_last", int, f"the tick of the last move {side}", PREFERENCE, "tick"),
    ]


WHY = (
    Column("why_pausing", bool, "guidance: true if the draw began the pause", GUIDANCE),
    Column("why_familiarity", int, "guidance: f of the local state before it", GUIDANCE, "question"),
    Column("why_p_guid", float, "guidance: p_guid", GUIDANCE),
    Column("why_chance", float, "guidance: p_guid ** f", GUIDANCE),
    Column("why_p_pref", float, "preference: p_pref", PREFERENCE),
    Column("why_draw", float, "the draw, uniform on [0, 1), that was below the chance or p_pref", "not kept"),
    *_recording("left"),
    *_recording("right"),
)
"""Why it was asked (`server.why`); `why_draw` is missing where this was not kept."""
QUESTIONS = (
    RUN,
    Column("question", str, "its public id", DAMAGED),
    Column("world", str, "the world's name", DAMAGED),
    Column("level", str, "the level's name", DAMAGED),
    Column("tick", int, "the tick at which the agent asked", DAMAGED, "tick"),
    Column("kind", str, "guidance or preference", DAMAGED),
    Column("maturity", int, "stage T of the clips; 1 for guidance", DAMAGED, "stage"),
    Column("votes", int, "answers heard before on this pair of moves", DAMAGED),
    Column("status", str, "open, answered (not heard yet), applied or withdrawn", DAMAGED),
    Column("put_back", bool, "true: it was skipped once, and asked again", DAMAGED),
    Column("withdrawn_tick", int, "before it the agent stopped waiting", "it did not", "tick"),
    Column("asked", str, "when it was stored", DAMAGED, "UTC"),
    Column("leased", str, "when it was first given to a client", f"never, or {NOT_KEPT}", "UTC"),
    Column("policy_stage", int, "stage of the policy that asked", NOT_KEPT, "stage"),
    Column("policy_gradient_steps", int, "its gradient steps within that stage", NOT_KEPT, "step"),
    *of_moves("policy", "as the agent asked", NOT_KEPT),
    *WHY,
    Column("left", ClipSchema, "the clip on the left: see *Clips*", DAMAGED),
    Column("right", ClipSchema, "the clip on the right", DAMAGED),
    BROKEN,
)
QuestionRow = row_model("QuestionRow", "A question, answered or not, with its two clips.", QUESTIONS)
