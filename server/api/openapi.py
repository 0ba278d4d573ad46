"""The OpenAPI description of the API, with an example of each request and reply.

The examples are added last, because FastAPI drops every null, also those of an example.
"""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI

from parenting.server.api.examples import SHOWN

DONE = ("200", "201", "202")


class Described(FastAPI):
    """An application whose OpenAPI description shows `server.api.examples`."""

    def openapi(self) -> dict[str, Any]:
        """Return the description, which is made once."""
        if self.openapi_schema is None:
            for path in super().openapi()["paths"].values():
                for operation in path.values():
                    _show(operation)
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
