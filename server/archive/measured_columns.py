"""The columns of what the parent's page measured of an answer (`Answer.measured`), listed here alone."""

from __future__ import annotations

from typing import Any

from parenting.server.archive.columns import Column
from parenting.server.damage import sound
from parenting.server.tables import Answer

NOT_MEASURED = "not measured: by a script, a program or an older page"
MEASURED = (
    Column(
        "shown", int, "when the question was painted, by the browser's clock", NOT_MEASURED, "ms since 1970"
    ),
    Column("reacted", int, "first pointer move, press or key, after `shown`", NOT_MEASURED, "ms"),
    Column("answered", int, "the choice, after `shown`: reading and deciding", NOT_MEASURED, "ms"),
    Column("queued", int, "from the choice until it was sent", NOT_MEASURED, "ms"),
    Column("away", int, "how long the tab was hidden meanwhile; 0: never left", NOT_MEASURED, "ms"),
    Column("layout", str, "one (board), two (boards) or turns (two clips in turns)", NOT_MEASURED),
    Column("sides", str, "left-right or right-left: the order in which the candidates stood", NOT_MEASURED),
    Column("width", int, "width of the viewport", NOT_MEASURED, "CSS px"),
    Column("height", int, "height of the viewport", NOT_MEASURED, "CSS px"),
    Column("input", str, "key, click, touch, or form (sent without a script)", NOT_MEASURED),
    Column(
        "wording", str, "the version of the sentences that were shown: 8 hexadecimal digits", NOT_MEASURED
    ),
)


def measured(answer: Answer) -> dict[str, Any]:
    """Return what was measured of an answer, null where nothing was."""
    found = sound(answer, "measured") or {}
    return {column.name: found.get(column.name) for column in MEASURED}
