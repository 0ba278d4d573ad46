"""The callers of the tests of access: what each of them sends."""

from __future__ import annotations

from dataclasses import dataclass

import httpx2

from parenting.server.tables import Run


@dataclass
class House:
    """Two runs, each with a parent's token; the first parent holds a question and has asked for a job."""

    run: Run
    other: Run
    question: str
    job: str
    bearers: dict[str, str | None]


def send(client: httpx2.Client, method: str, path: str, bearer: str | None = None) -> httpx2.Response:
    headers = {} if bearer is None else {"Authorization": bearer}
    reply: httpx2.Response = client.request(method, path, headers=headers)
    return reply
