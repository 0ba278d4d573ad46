"""Examples of the routes on jobs."""

from __future__ import annotations

from typing import Any

from parenting.server.api.level_examples import PRETRAINED

WALKS = {"a walk": {"client_id": "me", "kind": "walk", "payload": {"seed": 7}}}


def of_jobs(walk: dict[str, Any], lease: dict[str, Any]) -> dict[str, tuple[Any, ...]]:
    """Return a reply, and bodies where there are any, by operationId.

    Args:
        walk: A walk that is done.
        lease: The body of a client.
    """
    waiting = {**walk, "state": "waiting", "result": None}
    weights = {**waiting, **PRETRAINED, "run": None}
    return {
        "ask_job": (waiting, WALKS),
        "ask_pretraining": (weights, {"one more row": {**lease, **PRETRAINED}}),
        "get_job": (walk,),
        "cancel_job": ({**weights, "state": "failed", "reason": "It was cancelled."},),
    }
