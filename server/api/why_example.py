"""The examples of reasons and effects for the API's description."""

from __future__ import annotations

from typing import Any

MEASURED: dict[str, Any] = {
    **{"shown": 1795348801250, "reacted": 812, "answered": 1450, "queued": 2, "away": 0},
    **{"layout": "one", "sides": "left-right", "width": 390, "height": 844},
    **{"input": "touch", "wording": "3f9a12bc"},
}
STANDING: dict[str, Any] = {
    **{"number": 4, "choice": "left", "parent": "human"},
    **{"received": "2026-11-22T12:00:00Z", "applied_tick": 6, "measured": MEASURED},
}
EXPORTED: dict[str, Any] = {
    "leased": "2026-11-22T12:00:01.000000Z",
    "replays": 1,
    "reason": {
        "pausing": True,
        "familiarity": 2,
        "p_guid": 0.5,
        "chance": 0.25,
        "p_pref": None,
        "draw": 0.113,
        "probabilities": [0.31, 0.22, 0.19, 0.28],
        "clips": None,
    },
    "effects": {
        "before": [0.31, 0.22, 0.19, 0.28],
        "after_1": [0.33, 0.21, 0.19, 0.27],
        "after_10": [0.52, 0.11, 0.16, 0.21],
        "after_100": None,
    },
}
WHY: dict[str, Any] = {
    "public_id": "8kZ4cVxtw1Rr5Qh2mPzDvN",
    "run_public_id": "5J3mBbAH58CpQ3Y8RNJpUK",
    "kind": "guidance",
    "tick": 41,
    "votes": 0,
    "status": "applied",
    "policy": {"stage": 1, "gradient_steps": 12},
    "guidance": {
        "pausing": True,
        "familiarity": 2,
        "p_guid": 0.5,
        "chance": 0.25,
        "draw": 0.113,
        "probabilities": [0.31, 0.22, 0.19, 0.28],
    },
    "preference": None,
    "posted": "2026-11-22T12:00:00Z",
    "leased": "2026-11-22T12:00:01Z",
    "answers": [
        {
            "number": 17,
            "choice": "left",
            "parent": "human",
            "who": "2c70e12b7a0646f9",
            "received": "2026-11-22T12:00:03Z",
            "applied_tick": 42,
            "standing": True,
            "replays": 1,
            "measured": MEASURED,
            "effects": [
                {"ticks": 0, "probabilities": [0.31, 0.22, 0.19, 0.28]},
                {"ticks": 1, "probabilities": [0.33, 0.21, 0.19, 0.27]},
                {"ticks": 10, "probabilities": [0.52, 0.11, 0.16, 0.21]},
                {"ticks": 100, "probabilities": None},
            ],
        }
    ],
}
