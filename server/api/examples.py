"""Examples for the API's description, by operation. A test checks each against its schema."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any

from parenting.agent.config import compose
from parenting.drawing.surroundings import surroundings
from parenting.envs import registry
from parenting.server.api.board_examples import BOARD, EPISODE, NUMBERS
from parenting.server.api.job_examples import of_jobs
from parenting.server.api.kept_examples import TABLE, kept
from parenting.server.api.level_examples import CHECKED, IMPORTED, LAKE, OWN_LEVEL, TO_CHECK, UPLOADED
from parenting.server.api.why_example import EXPORTED as EXPORTED_WHY
from parenting.server.api.why_example import MEASURED, STANDING, WHY

WORLD = "unsafe-exploration"
SPEC, LEVEL = registry.spec(WORLD), registry.level(WORLD, "island")
GROUND = [row.replace("A", " ") for row in LEVEL.rows]
START = (1, 4)
BRIEF = {"goal": SPEC.brief.goal, "danger": SPEC.brief.danger}
NOON = "2026-11-22T12:00:00Z"
DATABASE, RUN_ID = "7c9e6679-7425-40de-944b-e07fc1f90ae7", "5J3mBbAH58CpQ3Y8RNJpUK"
QUESTION_ID = "8kZ4cVxtw1Rr5Qh2mPzDvN"


def _frame(row: int, column: int) -> dict[str, Any]:
    """The agent on the island."""
    seen = [line[:column] + "A" + line[column + 1 :] if at == row else line for at, line in enumerate(GROUND)]
    return {"ground": GROUND, "observed": seen, "agent": [row, column], "box": None}


def _clip(action: str, row: int, column: int) -> dict[str, Any]:
    return {"actions": [action], "length": 1, "frames": [_frame(*START), _frame(row, column)]}


NEW_RUNS = {
    "a built-in level": {"world": WORLD},
    "settings of one's own": {
        "world": WORLD,
        "level": "island-bottleneck",
        "preset": "lax",
        "config": {"p_rec": 0.25, "stages": 2},
        "seed": 7,
        "name": "first",
        **{"goal": 50, "pace": 2.5},
    },
    "a level of one's own, raised by a script": {
        "world": WORLD,
        "level_text": OWN_LEVEL,
        "parent": "scripted",
        "script": "noisy:0.1",
    },
}
RUN: dict[str, Any] = {
    "id": 1,
    "public_id": RUN_ID,
    "database": DATABASE,
    "created": NOON,
    "name": "first",
    "description": None,
    "tags": ["pilot"],
    "archived": None,
    "deleting": None,
    "world": WORLD,
    "level": LEVEL.name,
    "preset": "conservative",
    "config": compose("conservative", registry.defaults(WORLD), {}, strict=True).model_dump(mode="json"),
    "seed": 0,
    "batch": None,
    "trial": None,
    "weights": None,
    "origin": None,
    "parent": "human",
    "script": None,
    "guidance_layout": "one",
    "practice": "offered",
    "words": "plain",
    "remarks": True,
    "finish": "never",
    "status": "active",
    "reason": None,
    "tick": 5,
    "maturity": 1,
    "speed": 41.5,
    "waiting": "guidance",
    "state": "question",
    "goal": 50,
    "resting": False,
    "pace": None,
    "optimal": False,
    "answers": 3,
    "standing": 3,
    "milestones": {"goal": 3},
    "lesson": {
        "tick": 4,
        "kind": "guidance",
        "cell": [1, 3],
        "before": [0.25, 0.25, 0.25, 0.25],
        "after": [0.22, 0.34, 0.22, 0.22],
    },
    "skipped": 0,
    "open": {"guidance": 1, "preference": 0},
    **{"worker": "alive", "raised_by": "laboratory:4711"},
}
STOPPED: dict[str, Any] = {"status": "stopped", "reason": "Stopped by the operator.", "state": "over"}
STOPPED |= {"worker": "done", "raised_by": None}
QUERY: dict[str, Any] = {
    "id": 7,
    "run": 1,
    "database": DATABASE,
    "run_public_id": RUN_ID,
    "public_id": QUESTION_ID,
    "tick": 5,
    "kind": "guidance",
    "maturity": 1,
    "votes": 0,
    "policy": {"stage": 1, "gradient_steps": 3},
    "status": "open",
    "posted": NOON,
    "leased_until": "2026-11-22T12:01:00Z",
    "left": _clip("down", 2, 4),
    "right": _clip("left", 1, 3),
}
ASKED = {
    **QUERY,
    "status": "applied",
    "answer": STANDING,
}
WORLD_OF_QUERY = {
    "name": WORLD,
    "level": LEVEL.name,
    "text": LEVEL.text,
    "legend": dict(SPEC.legend),
    "brief": BRIEF,
}
LEASED = {
    **QUERY,
    "world": WORLD_OF_QUERY,
    "parent": {"gamma": 0.9, "inside": "up-down"},
    "progress": {"answered": 3, "open": 1},
    "sentences": surroundings({"left": QUERY["left"], "right": QUERY["right"]}, SPEC.legend),
}
LEASE = {"client_id": "me"}
RENEWED = {**LEASE, "questions": [QUESTION_ID], "idle": 3.5}
ANSWERS = {
    "by a person": {"choice": "left", "client_id": "me"},
    "to this question and no other": {
        "choice": "left",
        "client_id": "me",
        "database": DATABASE,
        "run": RUN_ID,
        "question": QUESTION_ID,
    },
    "with what a page measures": {"choice": "left", "client_id": "me", "measured": MEASURED},
    "by a script": {"choice": "neither", "client_id": "script", "parent": "scripted"},
}
NAMES = {"database": DATABASE, "run_public_id": RUN_ID, "query_public_id": QUESTION_ID}
STORED = {"query": 7, "run": 1, "number": 4, "choice": "left", "received": NOON, **NAMES}
CHANGED = {**STORED, "number": 5, "choice": "right", "heard": True}
WITHDRAWN = {"outcome": "withdrawn", "query": 7, "run": 1, "choice": "left", **NAMES}
SKIPPED = {"outcome": "set_aside", "query": 7, "run": 1, "number": 4, **NAMES}
METRIC = {"tick": 4, "values": {"deaths": 0, "loss": 0.6931, "entropy_global": 1.386}}
EVENTS = [
    {"id": 1, "run": 1, "event": {"kind": "mature"}, "created": NOON, "applied_tick": 4},
    {
        "id": 2,
        "run": 1,
        "event": {"kind": "change", "name": "p_guid", "value": 0.5},
        "created": NOON,
        "applied_tick": None,
    },
]
STREAM = (
    'event: question\ndata: {"id": 7, "public_id": "' + QUESTION_ID + '", "kind": "guidance"}\n\n'
    f"event: run\ndata: {json.dumps(RUN)}\n\n"
    f"event: metrics\ndata: {json.dumps({'rows': [METRIC]})}\nid: {METRIC['tick']}\n\n"
)
EXPORTED: dict[str, Any] = {
    "run": 1,
    "number": 4,
    "query": 7,
    "world": WORLD,
    "level": LEVEL.name,
    "kind": "guidance",
    "maturity": 1,
    "tick": 5,
    "applied_tick": 6,
    "policy": QUERY["policy"],
    "left": QUERY["left"],
    "right": QUERY["right"],
    "choice": "left",
    "mu": [1.0, 0.0],
    "parent": "human",
    "asked": "2026-11-22T12:00:00.000000Z",
    "received": "2026-11-22T12:00:03.250000Z",
    "standing": True,
    "supersedes": None,
    **NAMES,
    "guidance_layout": "one",
    "practice": "offered",
    "words": "plain",
    "remarks": True,
    "votes": 0,
    "script": None,
    **EXPORTED_WHY,
}

WALK: dict[str, Any] = {
    "id": "3sQv8hYJ2cT7mWk9xRzLpB",
    "run": 1,
    "kind": "walk",
    "payload": {"seed": 0},
    "created": NOON,
    "state": "done",
    "progress": None,
    "result": {
        "tick": 41,
        "maturity": 1,
        "answers": 12,
        "clip": _clip("left", 1, 3),
        "end": "time",
        "unsafe": [],
        "cells": [{"cell": [1, 3], "probabilities": [0.02, 0.9, 0.05, 0.03]}],
    },
    "reason": None,
    "worker": "alive",
}


def _rows(*shown: Any) -> dict[str, Any]:
    return {"rows": list(shown), "next": None}


@dataclass(frozen=True)
class Shown:
    """The examples of an operation: its reply, and named requests."""

    reply: Any = None
    sent: dict[str, Any] = field(default_factory=dict)
    others: dict[str, Any] = field(default_factory=dict)  # replies in other media


SHOWN = {
    "check_level": Shown(CHECKED, {"a level": TO_CHECK}),
    "upload_policy": Shown(UPLOADED, {"a policy": "the bytes of a file of safetensors"}),
    "import_maps": Shown(IMPORTED, {"a map of FrozenLake": LAKE}),
    "healthz": Shown({"status": "ok"}),
    "readyz": Shown({"status": "ok", "database": "ok", "migrations": "ok", "worker": "ok"}),
    "list_runs": Shown({**_rows(RUN), "database": DATABASE}),
    "start_run": Shown(RUN, NEW_RUNS),
    "get_run": Shown(RUN),
    "list_metrics": Shown(_rows(METRIC)),
    "list_episodes": Shown({**_rows(EPISODE), "next": 3}),
    "list_curves": Shown(
        {
            "by": "tick",
            "rows": 4,
            "last": 57,
            "thinned": False,
            "curves": [{"name": "deaths", "x": [0.0, 1.0, 2.0, 57.0], "y": [0.0, 0.0, 1.0, 1.0]}],
        }
    ),
    "get_board": Shown(BOARD),
    "get_snapshot": Shown(NUMBERS),
    "list_operator_events": Shown(_rows(*EVENTS)),
    "pause_run": Shown({**RUN, "status": "paused", "state": "paused"}),
    "resume_run": Shown(RUN),
    "stop_run": Shown({**RUN, **STOPPED}),
    "mature_run": Shown(RUN),
    "end_episode": Shown(RUN),
    "change_run": Shown(RUN, {"ask less": {"name": "p_guid", "value": 0.5}}),
    "roll_back_run": Shown(RUN, {"to tick 40": {"tick": 40}}),
    "set_goal": Shown(RUN, {"fifty": {"goal": 50}, "never": {"goal": None}}),
    "set_pace": Shown({**RUN, "pace": 2.5}, {"to watch": {"pace": 2.5}, "free": {"pace": None}}),
    "list_questions": Shown(_rows(ASKED)),
    "lease_question": Shown(LEASED, {"me": LEASE}),
    "get_question": Shown(ASKED),
    "get_reason": Shown(WHY),
    "answer_question": Shown(STORED, ANSWERS),
    "change_answer": Shown(CHANGED, {"to right": {"choice": "right", "client_id": "me"}}),
    "withdraw_answer": Shown(WITHDRAWN, {"mine": LEASE}),
    "skip_question": Shown(SKIPPED, {"mine": LEASE}),
    "renew_leases": Shown({"yours": [QUESTION_ID], "elsewhere": [], "closed": []}, {"looking": RENEWED}),
    "leave_questions": Shown(None, {"me": LEASE}),
    "release_question": Shown(None, {"me": LEASE}),
    **{name: Shown(*shown) for name, shown in of_jobs(WALK, LEASE).items()},
    "report_page_error": Shown(None, {"a fault": {"message": "x is not a function", "page": "/runs/3"}}),
    "follow_run": Shown(STREAM),
    "export_run": Shown(json.dumps(EXPORTED) + "\n", others=TABLE),
    "download_policy": Shown("the bytes of a file of safetensors"),
    **{name: Shown(*shown) for name, shown in kept(RUN).items()},
}
"""By operationId."""
