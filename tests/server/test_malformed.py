"""Malformed input gets a reply of 4xx, never of 5xx (E12): numbers, text, nesting, cookies, keys, types."""

import httpx2
import pytest

from tests.server.test_api import WORLD

pytestmark = pytest.mark.only("sqlite", "such input is refused before the store is asked")
JSON = {"Content-Type": "application/json"}
NUMBERS = ["NaN", "Infinity", "-Infinity", "1e26", "-1e26", "1e400", "9" * 30, "9" * 5000, "-" + "9" * 400]
DEEP = 10_000
FIELDS = ["config", "seed", "name", "world", "preset", "parent"]
VERBS = [
    ("/api/v1/runs", f'{{"world": "{WORLD}", "seed": %s}}'),
    ("/api/v1/runs", f'{{"world": "{WORLD}", "config": {{"stages": %s}}}}'),
    ("/api/v1/runs/1/goal", '{"goal": %s}'),
    ("/api/v1/runs/1/pace", '{"ticks_per_second": %s}'),
    ("/api/v1/runs/1/change", '{"name": "p_rec", "value": %s}'),
]
LONE = ['"\\ud800"', '"\\udfff"', '"a\\udc00b"', '{"\\ud800": 1}']
PLACES = ["/api/v1/runs/%s", "/api/v1/queries/%s", "/runs/%s", "/runs/%s/parent", "/runs/%s/history"]
PERCENT = ["%ED%A0%80", "%ff", "%C0%AF", "%00", "1e26", "NaN", "9" * 400, "-1", "%F0%28%8C%28"]
JUNK = [
    "=",
    ";;;;",
    "a",
    "session=%ff%00",
    "a=b; a=c; a",
    "x" * 4000,
    '"',
    "\xff\xfe=\xed\xa0\x80",
    "parenting=;=;",
]
TYPES = [
    "",
    "text/plain",
    "application/xml",
    "application/json; charset=utf-16",
    "multipart/form-data",
    "/",
    "\xff",
]


def refused(reply: httpx2.Response) -> bool:
    return 400 <= reply.status_code < 500


@pytest.mark.parametrize("number", NUMBERS, ids=lambda number: number[:12])
def test_numbers_out_of_reach_are_refused_wherever_one_is_taken(
    client: httpx2.Client, run: object, number: str
) -> None:
    for address, body in VERBS:
        reply = client.post(address, content=body % number, headers=JSON)
        assert refused(reply), (address, reply.status_code, reply.text)


@pytest.mark.parametrize("text", LONE)
def test_lone_surrogates_are_refused(client: httpx2.Client, text: str) -> None:
    for field in FIELDS:
        body = f'{{"world": "{WORLD}", "{field}": {text}}}'
        reply = client.post("/api/v1/runs", content=body, headers=JSON)
        assert refused(reply), (field, reply.text)


@pytest.mark.parametrize("piece", PERCENT, ids=lambda piece: piece[:12])
def test_ids_and_forms_that_are_none_are_refused(client: httpx2.Client, piece: str) -> None:
    for place in PLACES:
        assert refused(client.get(place.replace("%s", piece))), place
    form = {"Content-Type": "application/x-www-form-urlencoded"}
    assert refused(client.post("/runs", content=f"world={piece}&seed={piece}", headers=form))


@pytest.mark.parametrize("bracket", ["[]", '{"a":'], ids=["lists", "objects"])
def test_nesting_of_ten_thousand_is_refused(client: httpx2.Client, bracket: str) -> None:
    inner = "[" * DEEP + "]" * DEEP if bracket == "[]" else bracket * DEEP + "1" + "}" * DEEP
    for body in (inner, *(f'{{"world": "{WORLD}", "{field}": {inner}}}' for field in FIELDS)):
        assert refused(client.post("/api/v1/runs", content=body, headers=JSON))


@pytest.mark.slow_after(3)
@pytest.mark.parametrize("cookie", JUNK, ids=range(len(JUNK)))
def test_junk_cookies_keep_nobody_out(client: httpx2.Client, run: object, cookie: str) -> None:
    sent = {b"Cookie": cookie.encode("latin-1")}
    for address in ("/", "/runs/1", "/runs/1/parent", "/api/v1/runs/1"):
        assert client.get(address, headers=sent, follow_redirects=True).status_code < 500
    assert client.get("/api/v1/runs/1", headers=sent).status_code == 200


@pytest.mark.parametrize(
    "body",
    [
        f'{{"world": "no such world", "world": "{WORLD}", "world": "none"}}',
        f'{{"world": "{WORLD}", "seed": 1, "seed": "x"}}',
        f'{{"world": "{WORLD}", "config": {{"gamma": 0.9, "gamma": 9}}}}',
    ],
)
def test_of_a_key_that_comes_twice_the_last_one_is_checked(client: httpx2.Client, body: str) -> None:
    assert refused(client.post("/api/v1/runs", content=body, headers=JSON))


@pytest.mark.parametrize("media", TYPES, ids=range(len(TYPES)))
def test_wrong_content_types_are_refused(client: httpx2.Client, run: object, media: str) -> None:
    sent = {b"Content-Type": media.encode("latin-1")}
    for address in ("/api/v1/runs", "/api/v1/runs/1/goal"):
        reply = client.post(address, content=b"\xff\xfe{\x00", headers=sent)
        assert refused(reply), (address, reply.status_code, reply.text)
