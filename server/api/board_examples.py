"""Examples of episodes and of the board for the API's description."""

from __future__ import annotations

from typing import Any

EPISODE: dict[str, Any] = {
    "number": 3,
    "first": 61,
    "last": 83,
    "steps": 21,
    "pauses": 2,
    "unsafe": 1,
    "end": "goal",
    "whole": True,
}


SNAPSHOT: dict[str, Any] = {"tick": 41, "maturity": 1, "answers": 12}
BOARD: dict[str, Any] = {
    "states": 1,
    "complete": True,
    "rests": [{"ground": ["####", "#  #", "####"], "box": None, "parts": {}}],
    "cells": [(1, 2, 0)],
    "snapshots": [SNAPSHOT],
}
NUMBERS: dict[str, Any] = {
    **SNAPSHOT,
    "states": 1,
    "p_guid": 0.9,
    "stage": 1,
    "partial": False,
    "known": 1,
    "policy": "BeYNBw==",
    "familiarity": "AwA=",
    "visits": "CQAAAA==",
    "deaths": "AAAAAA==",
    "entries": "BAAAAA==",
}
