"""The access matrix: every route, page, stream and verb, and who may use it. What has no row is refused.

`where` says which part of the house a request reaches, for those who reach one run only, or their own
questions: `everything` is closed to them, `nothing` is open, and the others are compared with their run.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from parenting.server.access.current import current
from parenting.server.access.roles import Role

Where = Literal["everything", "nothing", "run", "question", "job", "body"]
"""run, question, job: named in the path; `body`: the route itself compares the runs that its body names."""
RESEARCHER, PARENT, VIEWER = Role.RESEARCHER, Role.PARENT, Role.VIEWER
OPERATE = frozenset({RESEARCHER})
WATCH = frozenset({RESEARCHER, VIEWER})
ANSWER = frozenset({RESEARCHER, PARENT})
KNOWN = frozenset(Role)


@dataclass(frozen=True)
class Rule:
    """The roles that may use a route, and which part of the house it reaches. `roles` None: anyone."""

    roles: frozenset[Role] | None
    where: Where


ANYONE = Rule(None, "nothing")


def _table(rule: Rule, rows: str) -> dict[tuple[str, str], Rule]:
    pairs = [(line.split()[0], line.split()[1]) for line in rows.strip().splitlines()]
    return dict.fromkeys(pairs, rule)


_PUBLIC = """
GET /healthz
GET /readyz
GET /api/v1/openapi.json
GET /static
GET /static/vendor
GET /open
POST /open
"""
_OPERATE_HOUSE = """
GET /docs
POST /api/v1/runs
POST /runs
POST /api/v1/policies
POST /policies
GET /api/v1/tombstones
GET /api/v1/audit
GET /api/v1/audit/export
GET /audit
GET /access
POST /access/create
POST /access/{access_id}/revoke
POST /api/v1/jobs
POST /pretraining
POST /api/v1/levels/check
POST /api/v1/levels/import
GET /levels
POST /levels
POST /levels/start
GET /persons
GET /persons/{pseudonym}/delete
POST /persons/{pseudonym}/delete
"""
_OPERATE_RUN = """
POST /api/v1/runs/{run_id}/describe
POST /api/v1/runs/{run_id}/archive
GET /api/v1/runs/{run_id}/holds
POST /api/v1/runs/{run_id}/delete
POST /api/v1/runs/{run_id}/pause
POST /api/v1/runs/{run_id}/resume
POST /api/v1/runs/{run_id}/stop
POST /api/v1/runs/{run_id}/goal
POST /api/v1/runs/{run_id}/pace
POST /api/v1/runs/{run_id}/mature
POST /api/v1/runs/{run_id}/end-episode
POST /api/v1/runs/{run_id}/change
POST /api/v1/runs/{run_id}/roll-back
GET /api/v1/runs/{run_id}/queries
GET /api/v1/runs/{run_id}/export
GET /api/v1/runs/{run_id}/policy
POST /runs/{run_id}/status
GET /runs/{run_id}/end
POST /runs/{run_id}/event
POST /runs/{run_id}/probabilities
POST /runs/{run_id}/goal
POST /runs/{run_id}/pace
POST /runs/{run_id}/roll-back
GET /runs/{run_id}/settings
POST /runs/{run_id}/settings
POST /runs/{run_id}/archive
GET /runs/{run_id}/delete
POST /runs/{run_id}/delete
"""
_WATCH_HOUSE = """
GET /
GET /metrics
GET /api/v1/runs
GET /compare
GET /compare/data
"""
_WATCH_RUN = """
GET /api/v1/runs/{run_id}/metrics
GET /api/v1/runs/{run_id}/curves
GET /api/v1/runs/{run_id}/operator-events
GET /api/v1/runs/{run_id}/episodes
GET /api/v1/runs/{run_id}/board
GET /api/v1/runs/{run_id}/board/{tick}
GET /api/v1/runs/{run_id}/events
GET /runs/{run_id}
GET /runs/{run_id}/stages
GET /runs/{run_id}/episodes/{job_id}/board
GET /runs/{run_id}/board/{rest}
GET /runs/{run_id}/why
"""
_ANSWER_RUN = """
POST /api/v1/runs/{run_id}/queries/lease
POST /api/v1/runs/{run_id}/queries/renew
POST /api/v1/runs/{run_id}/queries/leave
POST /api/v1/runs/{run_id}/jobs
GET /runs/{run_id}/parent
POST /runs/{run_id}/parent/question
POST /runs/{run_id}/parent/next
POST /runs/{run_id}/parent/take
POST /runs/{run_id}/parent/answer
POST /runs/{run_id}/parent/withdraw
POST /runs/{run_id}/parent/change
POST /runs/{run_id}/parent/skip
GET /runs/{run_id}/parent/again
POST /runs/{run_id}/parent/either
POST /runs/{run_id}/parent/end-episode
GET /runs/{run_id}/parent/grid
GET /runs/{run_id}/history
POST /runs/{run_id}/walk
"""
_KNOWN_RUN = """
GET /api/v1/runs/{run_id}
GET /runs/{run_id}/walk/{job_id}
GET /runs/{run_id}/walk/{job_id}/board
GET /runs/{run_id}/growth
"""
_ANSWER_QUESTION = """
GET /api/v1/queries/{query_id}
POST /api/v1/queries/{query_id}/answer
POST /api/v1/queries/{query_id}/release
POST /api/v1/queries/{query_id}/withdraw
POST /api/v1/queries/{query_id}/change
POST /api/v1/queries/{query_id}/skip
"""
_KNOWN_NOTHING = """
POST /api/v1/page-errors
GET /help
GET /practice
POST /practice
POST /practice/undo
POST /practice/done
GET /practice/grid
POST /leave
"""

ROWS: dict[tuple[str, str], Rule] = {
    **_table(ANYONE, _PUBLIC),
    **_table(Rule(OPERATE, "everything"), _OPERATE_HOUSE),
    **_table(Rule(OPERATE, "run"), _OPERATE_RUN),
    **_table(Rule(WATCH, "everything"), _WATCH_HOUSE),
    **_table(Rule(WATCH, "run"), _WATCH_RUN),
    **_table(Rule(WATCH, "question"), "GET /api/v1/queries/{query_id}/why"),
    **_table(Rule(ANSWER, "run"), _ANSWER_RUN),
    **_table(Rule(ANSWER, "body"), "POST /runs/parent/stream"),
    **_table(Rule(ANSWER, "question"), _ANSWER_QUESTION),
    **_table(Rule(ANSWER, "job"), "GET /api/v1/jobs/{job_id}\nPOST /api/v1/jobs/{job_id}/cancel"),
    **_table(Rule(KNOWN, "run"), _KNOWN_RUN),
    **_table(Rule(KNOWN, "nothing"), _KNOWN_NOTHING),
}
"""The rule of each route, by its method and the template of its path."""


def rule_of(method: str, path: str) -> Rule | None:
    """Return who may use a route; None where it has no row, so that nobody may."""
    return ROWS.get(("GET" if method == "HEAD" else method, path))


def may(route: str) -> bool:
    """Return whether the caller of the present request may use a route: `POST /runs/{run_id}/event`.

    Pages ask, so that they show nobody what would be refused.
    """
    who, rule = current.get(), ROWS[tuple(route.split(" "))]  # type: ignore[index]  # two words
    if rule.roles is None or who is None:
        return rule.roles is None
    return who.role in rule.roles and (who.run is None or rule.where != "everything")


_YES = {
    "everything": "yes",
    "nothing": "yes",
    "run": "own run",
    "question": "own questions",
    "job": "own jobs",
    "body": "own run",
}


def as_markdown() -> str:
    """Return the matrix as the table of SECURITY.md."""
    lines = ["| Route | anyone | researcher | viewer | parent |", "| --- | --- | --- | --- | --- |"]
    for (method, path), rule in sorted(ROWS.items(), key=lambda row: (row[0][1], row[0][0])):
        cells = ["yes" if rule.roles is None else "", *(_cell(rule, role) for role in (RESEARCHER, VIEWER))]
        lines.append(f"| `{method} {path}` | {' | '.join(cells)} | {_parents(rule)} |")
    return "\n".join(lines) + "\n"


def _cell(rule: Rule, role: Role) -> str:
    return "yes" if rule.roles is None or role in rule.roles else ""


def _parents(rule: Rule) -> str:
    if rule.roles is None or PARENT not in rule.roles:
        return _cell(rule, PARENT)
    return _YES[rule.where]
