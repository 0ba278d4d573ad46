"""The access matrix has a row for every route, and SECURITY.md prints it."""

from __future__ import annotations

from fastapi.routing import iter_route_contexts
from starlette.routing import Mount

from parenting.server.access.matrix import ROWS, as_markdown, rule_of
from parenting.server.access.roles import Role
from parenting.server.app import bare_app
from tests.tree import ROOT

BEGIN, END = "<!-- access matrix -->\n", "<!-- end of the access matrix -->"


def routes() -> set[tuple[str, str]]:
    """All routes of the application by method and template; a folder of files is a GET."""
    found = set()
    for route in iter_route_contexts(bare_app().routes):
        methods = {"GET"} if isinstance(route.original_route, Mount) else (route.methods or set())
        found |= {(method, str(route.path)) for method in methods - {"HEAD"}}
    return found


def test_every_route_has_a_row_and_every_row_a_route() -> None:
    assert len(routes()) > 90
    assert routes() == set(ROWS)


def test_what_has_no_row_is_refused() -> None:
    assert rule_of("GET", "/secret") is None
    assert rule_of("POST", "/metrics") is None


def test_only_these_are_open_to_anyone() -> None:
    assert {row for row, rule in ROWS.items() if rule.roles is None} == {
        ("GET", "/healthz"),
        ("GET", "/readyz"),
        ("GET", "/api/v1/openapi.json"),
        ("GET", "/static"),
        ("GET", "/static/vendor"),
        ("GET", "/open"),
        ("POST", "/open"),
    }


def test_a_viewer_changes_nothing_and_a_parent_operates_nothing() -> None:
    for (method, path), rule in ROWS.items():
        if rule.roles is None or Role.VIEWER not in rule.roles or method == "GET":
            continue
        assert rule.where == "nothing", path
    for (_, path), rule in ROWS.items():
        if rule.roles is not None and Role.PARENT in rule.roles:
            assert rule.where != "everything", path


def test_the_researcher_may_everything() -> None:
    assert [
        path for (_, path), rule in ROWS.items() if rule.roles and Role.RESEARCHER not in rule.roles
    ] == []


def test_security_md_prints_it() -> None:
    text = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
    assert text.partition(BEGIN)[2].partition(END)[0] == as_markdown()
