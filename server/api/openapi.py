"""The OpenAPI description of the API, with an example of each request and reply.

The examples are added last, because FastAPI drops every null, also those of an example.
"""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI

from parenting.server.api.examples import SHOWN

DONE = ("200", "201", "202")


TOKEN = {
    "type": "http",
    "scheme": "bearer",
    "description": "A token of `parenting access create token`. A browser that has come in sends its cookie.",
}


class Described(FastAPI):
    """An application whose OpenAPI description shows `server.api.examples`."""

    def openapi(self) -> dict[str, Any]:
        """Return the description, which is made once."""
        if self.openapi_schema is None:
            found = super().openapi()
            found["components"]["securitySchemes"] = {"token": TOKEN}
            for path, methods in found["paths"].items():
                for operation in methods.values():
                    _show(operation)
                    if path.startswith("/api/"):
                        operation["security"] = [{"token": []}]
        return super().openapi()


def _show(operation: dict[str, Any]) -> None:
    shown = SHOWN[operation["operationId"]]
    for parameter in operation.get("parameters", []):
        if "examples" in parameter["schema"]:  # here too, for pages that fill it in
            parameter["example"] = parameter["schema"]["examples"][0]
    for media in operation.get("requestBody", {}).get("content", {}).values():
        media["examples"] = {name: {"value": value} for name, value in shown.sent.items()}
    for reply in (reply for status, reply in operation["responses"].items() if status in DONE):
        for kind, media in reply["content"].items():
            media["example"] = shown.others.get(kind, shown.reply)
