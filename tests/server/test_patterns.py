"""Texts of a wrong form are refused in plain words: the field, what is wanted, an example."""

from __future__ import annotations

import re

import httpx2
import pytest

from parenting.server.patterns import WRITE
from parenting.server.runs import Claim

pytestmark = pytest.mark.only("sqlite", "it is about requests, not about a store")


@pytest.mark.parametrize(
    ("path", "body", "field", "words"),
    [
        ("/api/v1/runs/1/queries/lease", {"client_id": "a b"}, "client_id", "such as tab-1"),
        ("/api/v1/runs", {"world": "side-effects", "from_policy": "X"}, "from_policy", "64 digits"),
        ("/api/v1/runs", {"world": "side-effects", "from_answers": "0"}, "from_answers", "22 letters"),
        ("/api/v1/runs", {"world": "side-effects", "name": "a\tb"}, "name", "one line"),
        ("/api/v1/runs", {"world": "side-effects", "finish": "soon"}, "finish", "such as goal:50"),
    ],
)
def test_a_text_of_a_wrong_form_is_refused_in_plain_words(
    client: httpx2.Client, mine: Claim, path: str, body: dict[str, str], field: str, words: str
) -> None:
    error = client.post(path, json=body).json()["error"]
    assert field in str(error)
    assert words in error["message"]
    assert "pattern" not in error["message"]


def test_names_of_metrics_have_their_form(client: httpx2.Client, mine: Claim) -> None:
    error = client.get("/api/v1/runs/1/curves?names=Deaths!").json()["error"]
    assert "such as deaths,return" in error["message"]


def test_every_pattern_has_a_sentence_with_a_remedy() -> None:
    for pattern, said in WRITE.items():
        re.compile(pattern)
        assert "rite " in said
        assert said.endswith(".")
