"""Text of people: what is refused, what is stored, and that no text disturbs a page, a reply or a command."""

import json
import re
import unicodedata
from html.parser import HTMLParser

import httpx2
import pytest
from hypothesis import given
from hypothesis import strategies as st

from parenting.envs.people_text import LONGEST, is_visible, isolated, read_name
from parenting.server.db import Database

LEVEL = "WWWWW\nWA GW\nWWWWW"
UNSEEN = [
    "\u00a0",
    "\u2003",
    "\u200b",
    "\u200b\u200d\ufeff",
    "\u202e",
    "\u2066\u2069",
    "\u200e \u200f",
    "\u2800",
    "\u3164",
    "\u115f\u1160",
    "\u0301",
    "\u00ad",
    "\U000e0041",
    "\ue000",
    "\u0378",
]
REFUSED = [
    *UNSEEN,
    "a\u2028b",
    "a\u0085b",
    "a\x07",
    "a\x7f",
    "a\x00b",
    "e" + "\u0301" * 50,
    "\ud800",
    "\udfff",
]
ALLOWED = [
    "Zoë",
    "דנה",
    "زينب",
    "a\u202eb",
    "\u202egnp.exe",
    "\u2067a",
    "👩\u200d👩\u200d👧",
    "🏳\ufe0f\u200d🌈",
    "\U0001d518\U0001d52b\U0001d526",
    "</script><script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    "' onmouseover='alert(1)",
    "{{ 7 * 7 }}",
    "${7*7}",
    "=cmd|' /C calc'!A0",
    "@SUM(1+1)",
    "../../etc/passwd",
    "%00%s%n",
    "'; DROP TABLE runs; --",
    "[red]bold[/red]",
    "[link=http://evil.example]x[/link]",
    "ก็่",
    "NULL",
    "\uff10",
]


def test_what_cannot_be_seen_or_disturbs_is_refused_with_its_field(client: httpx2.Client) -> None:
    for text in REFUSED:
        body = json.dumps({"world": "unsafe-exploration", "name": text})
        refused = client.post("/api/v1/runs", content=body, headers={"Content-Type": "application/json"})
        assert refused.status_code == 422, repr(text)
        assert [one["field"] for one in refused.json()["error"]["fields"]] == ["name"], repr(text)
        if text.strip() and not any(0xD800 <= ord(one) < 0xE000 for one in text):
            form = client.post("/runs", data={"world": "unsafe-exploration", "name": text})
            assert form.status_code == 422, repr(text)


def test_a_name_of_a_level_obeys_the_same_rule(client: httpx2.Client) -> None:
    for name in [*UNSEEN[2:], "a" * 101]:
        text = f"name: {name}\n\n{LEVEL}"
        refused = client.post("/api/v1/runs", json={"world": "unsafe-exploration", "level_text": text})
        assert refused.status_code == 422, repr(name)
        assert refused.json()["error"]["fields"][0]["field"] == "level_text"


@pytest.mark.slow
def test_whatever_else_people_write_is_shown_as_text_everywhere(client: httpx2.Client, db: Database) -> None:
    for number, text in enumerate(ALLOWED, 1):
        level = f"name: {text}\n\n{LEVEL}"
        body = {"world": "unsafe-exploration", "name": f" {text} ", "level_text": level}
        made = client.post("/api/v1/runs", json=body)
        assert made.status_code == 201, made.text
        stored = unicodedata.normalize("NFC", text)
        assert (made.json()["name"], made.json()["level"]) == (stored, stored)
        for path in ("/", *(f"/runs/{number}{part}" for part in ("", "/parent", "/history"))):
            page = client.get(path, follow_redirects=True)
            assert page.status_code == 200
            check_page(page.text)
        assert client.get(f"/api/v1/runs/{number}/export").status_code == 200


class Tags(HTMLParser):
    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert not [name for name, _ in attrs if name.startswith("on")]


def check_page(text: str) -> None:
    """Nothing that a person typed is markup, and no sign of direction stands outside an isolate."""
    assert "<script>alert" not in text
    assert "<img src=x" not in text
    Tags().feed(text)
    head, _, body = text.partition("</head>")
    assert "\u202e" not in head, "no title is turned round"
    for sign in re.finditer("\u202e", body):
        before = body[: sign.start()]
        assert before.count("<bdi>") > before.count("</bdi>")


@given(st.text(max_size=2 * LONGEST))
def test_what_is_stored_can_be_seen_and_stored_again(text: str) -> None:
    try:
        name = read_name(text)
    except ValueError:
        return
    assert read_name(name) == name == unicodedata.normalize("NFC", name).strip()
    assert is_visible(name)
    assert len(name) <= LONGEST
    name.encode("utf-8")


@pytest.mark.parametrize("text", ["a\u202eb", "\u2067a", "דנה", "\u2069\u2069\u202ea"])
def test_an_isolate_ends_where_it_should(text: str) -> None:
    shown = isolated(text)
    assert (shown[0], shown[-1]) == ("\u2068", "\u2069")
    assert not {unicodedata.bidirectional(one) for one in shown[1:-1]} & {"RLO", "PDI", "RLI"}
    assert isolated("Zoë 1") == "Zoë 1"
