"""The page of the audit log: who did what, and what was refused, the newest first."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import Query, Response

from parenting.server.admission import admitted_router
from parenting.server.audit.entries import entries, told
from parenting.server.audit.table import Kind
from parenting.server.deps import Db
from parenting.server.new_run import LARGEST_INT
from parenting.server.pages.render import page

router = admitted_router(include_in_schema=False)

ROWS = 50
KINDS = {
    Kind.LOGIN: "Entered",
    Kind.LOGOUT: "Left",
    Kind.REFUSAL: "Refused",
    Kind.TOKEN: "Link or token made",
    Kind.REVOCATION: "Link or token revoked",
    Kind.EXPORT: "Exported",
    Kind.DELETION: "Deleted",
    Kind.OPERATOR: "Operated a run",
}
REFUSALS = {
    "unknown_host": "under a name that is not this server's",
    "plain_http": "over plain http",
    "forwarded": "the proxy did not say for whom",
    "cross_site": "from a page of another site",
    "unauthenticated": "without a valid link, cookie or token",
    "not_allowed": "something that this person may not do",
    "guessing": "after too many wrong tokens",
    "used_up": "by a link that is not valid any more",
}


@dataclass(frozen=True)
class AuditPage:
    """The content of web/templates/audit.html."""

    entries: list[dict[str, Any]]
    kind: Kind | None
    older: int | None
    newest: bool
    kinds: dict[Kind, str]
    refusals: dict[str, str]


@router.get("/audit")
def audit(
    db: Db,
    kind: Annotated[str, Query(max_length=20)] = "",
    before: Annotated[int | None, Query(ge=1, le=LARGEST_INT)] = None,
) -> Response:
    """Show a page of the log. A kind that is not known counts as all of them."""
    wanted = Kind(kind) if kind in list(Kind) else None
    found = entries(db, before, ROWS, wanted)
    rows = [told(row) for row in found.rows]
    return page("audit.html", **vars(AuditPage(rows, wanted, found.next, before is None, KINDS, REFUSALS)))
