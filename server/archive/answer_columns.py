"""The columns of `answers`: a row for each answer and each skip."""

from __future__ import annotations

from parenting.server.archive.columns import BROKEN, DAMAGED, NOT_KEPT, RUN, Column, of_moves, row_model
from parenting.server.archive.measured_columns import MEASURED

NO_TARGET = "neither and skip, which train nothing"
ABOUT_THE_RUN = (
    Column("world", str, "the world's name", DAMAGED),
    Column("level", str, "the level's name", DAMAGED),
    Column("preset", str, "the preset of the run's config", DAMAGED),
    Column("seed", int, "the run's seed", DAMAGED),
    Column("parent", str, "human or scripted: who answers", DAMAGED),
    Column("script", str, "the errors of a scripted parent; `scripted`: none", "people answer"),
    Column("guidance_layout", str, "boards of guidance: `one` with both moves, or `two`", DAMAGED),
    Column("practice", str, "`required`: people practised first; else `offered`", DAMAGED),
    Column("words", str, "`guide`: questions in words told lengths of safe ways; else `plain`", DAMAGED),
    Column("remarks", bool, "true: the page told of hasty and contradictory answers", DAMAGED),
)
ABOUT_THE_QUESTION = (
    Column("kind", str, "guidance or preference", DAMAGED),
    Column("maturity", int, "stage T of the clips; 1 for guidance", DAMAGED, "stage"),
    Column("votes", int, "answers heard before on this pair of moves; above 0, it was asked again", DAMAGED),
    Column("tick", int, "the tick at which the agent asked", DAMAGED, "tick"),
    Column("asked", str, "when the question was stored", DAMAGED, "UTC"),
    Column("leased", str, "when it was first given to a client", f"never, or {NOT_KEPT}", "UTC"),
    Column("policy_stage", int, "stage of the policy that asked", NOT_KEPT, "stage"),
    Column("policy_gradient_steps", int, "its gradient steps within that stage", NOT_KEPT, "step"),
)
LATER = "not lived yet, a skip, or not kept"
EFFECTS = {
    "before": of_moves("before", "before the agent heard the answer", LATER),
    "after_1": of_moves("after_1", "after the tick that heard it", LATER),
    "after_10": of_moves("after_10", "after 10 ticks, that tick included", LATER),
    "after_100": of_moves("after_100", "after 100 ticks, that tick included", LATER),
}
"""The policy in the asked state, by the names of `reads.why`."""
ANSWERS = (
    RUN,
    Column("number", int, "its number within the run, from 1 without gaps", DAMAGED),
    Column("question", str, "the question's public id, as in `questions`", DAMAGED),
    Column("pseudonym", str, "who answered: a random name, kept apart from names", "a script, or erased"),
    *ABOUT_THE_RUN,
    *ABOUT_THE_QUESTION,
    Column("by", str, "human or scripted: who gave this answer", DAMAGED),
    Column("choice", str, "left, right, either, neither; skip: they could not tell", "erased, or damaged"),
    Column("mu_left", float, "mu of Eq. (1) for left", NO_TARGET),
    Column("mu_right", float, "mu of Eq. (1) for right", NO_TARGET),
    Column("received", str, "when it was stored, by the server's clock", DAMAGED, "UTC"),
    Column("standing", bool, "false: it was corrected or taken back", DAMAGED),
    Column("supersedes", int, "number of the answer to this question before it", "it is the first"),
    Column("superseded_by", int, "number of the answer in its place", "none is"),
    Column("applied_tick", int, "the tick at which the agent heard it", "it has not", "tick"),
    Column("in_x", bool, "true: an entry of X when the export was written"),
    Column("erased", bool, "true: its person's data were erased"),
    Column("replays", int, "how often its parent had the clips played again", "not told"),
    *MEASURED,
    *(column for columns in EFFECTS.values() for column in columns),
    Column("chained", str, "`answer`: hashed as it was stored; `migration`: later", DAMAGED),
    Column("digest", str, "SHA-256 of its salted content, in the database of its origin", DAMAGED),
    Column("link", str, "SHA-256 of the link before it, a line feed and `digest`", DAMAGED),
    BROKEN,
)
AnswerRow = row_model("AnswerRow", "An answer or a skip; what was corrected keeps its row.", ANSWERS)
