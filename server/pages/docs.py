"""The API's own page, offline: Swagger UI from a package; without JavaScript, a list of the routes."""

from __future__ import annotations

from typing import Any

from fastapi import Request, Response

from parenting.server.admission import admitted_router
from parenting.server.pages.render import page

router = admitted_router(include_in_schema=False)


@router.get("/docs")
def docs(request: Request) -> Response:
    """The page."""
    described = request.app.openapi()
    return page("docs.html", about=_paragraphs(described["info"]["description"]), groups=_groups(described))


def _paragraphs(text: str) -> list[str]:
    """Plain text from the little Markdown that descriptions use."""
    return [" ".join(part.split()).replace("*", "") for part in text.split("\n\n")]


def _groups(described: dict[str, Any]) -> list[tuple[str, list[tuple[str, str, str]]]]:
    """Return the description of each tag with its routes: method, path, summary."""
    routes = [
        (operation["tags"][0], (method.upper(), path, operation["summary"]))
        for path, methods in described["paths"].items()
        for method, operation in methods.items()
    ]
    return [
        (tag["description"], [route for name, route in routes if name == tag["name"]])
        for tag in described["tags"]
    ]
