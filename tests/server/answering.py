"""A parent as a program of its own: leases questions over HTTP and answers as the scripted parent would.

It knows nothing but what the lease reply holds: the clips, the level's text, the parent's settings.
Run as: python -m tests.server.answering URL RUN LIMIT
"""

from __future__ import annotations

import sys
import time
from typing import Any

import httpx2
import torch

from envs import registry
from envs.gridworld import Gridworld
from parents.scripted import Judgement
from server.codec import CHOICE_NAMES, decode

PATIENCE = 60.0


class Parent:
    """Answers questions one by one; what it knows of the run's world it has from the first lease reply."""

    def __init__(self) -> None:
        self.world: Gridworld | None = None
        self.judgement: Judgement | None = None

    def answer_one(self, web: httpx2.Client, run: int) -> bool:
        """Answer the most urgent question, if there is one."""
        question = _lease(web, run)
        if question is not None:
            _send(web, question["id"], self.choice(question))
        return question is not None

    def choice(self, question: dict[str, Any]) -> str:
        """What the scripted parent would say."""
        if self.world is None or self.judgement is None:
            said = question["parent"]
            self.world = registry.make(question["world"]["name"], question["world"]["text"])
            self.judgement = Judgement(self.world, said["gamma"], inside=said["inside"])
        longest = max(question["left"]["length"], question["right"]["length"])
        query = decode(self.world, longest, question["kind"], question["maturity"], question)
        return CHOICE_NAMES[int(self.judgement.choose(query)[0])]


def answer(url: str, run: int, limit: int) -> int:
    """Answer up to `limit` questions of a run, each as soon as it is asked. Web and worker may vanish and
    come back.
    """
    parent = Parent()
    answered, quiet_since = 0, time.monotonic()
    with httpx2.Client(base_url=url, timeout=5) as web:
        while answered < limit and time.monotonic() - quiet_since < PATIENCE:
            if not parent.answer_one(web, run):
                time.sleep(0.005)
                continue
            answered, quiet_since = answered + 1, time.monotonic()
    return answered


def _lease(web: httpx2.Client, run: int) -> dict[str, Any] | None:
    try:
        reply = web.post(f"/api/v1/runs/{run}/queries/lease", json={"client_id": "script"})
    except httpx2.TransportError:
        return None
    reply.raise_for_status()
    return None if reply.status_code == 204 else reply.json()


def _send(web: httpx2.Client, query: int, choice: str) -> None:
    """Send until the server says that it is stored: after a lost reply the same again is harmless."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        try:
            reply = web.post(
                f"/api/v1/queries/{query}/answer", json={"choice": choice, "client_id": "script"}
            )
        except httpx2.TransportError:
            time.sleep(0.02)
            continue
        reply.raise_for_status()
        return
    raise TimeoutError(f"The answer to question {query} could not be sent.")


if __name__ == "__main__":
    torch.set_num_threads(1)
    print(answer(sys.argv[1], int(sys.argv[2]), int(sys.argv[3])))
