"""GET /runs/{id}/export: the answers as a file, a line each, streamed."""

import csv
import json
from io import BytesIO, StringIO
from zipfile import ZipFile

import httpx2
import pytest

from parenting.server import exports
from parenting.server.db import Database
from parenting.server.metrics import write_metrics
from parenting.server.operator_events import add_operator_event
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query, take_answer
from parenting.server.reads import answers
from parenting.server.runs import Claim
from parenting.server.spreadsheet import cell
from parenting.server.tables import CHOICES, Run
from tests.server.conftest import CLIPS
from tests.server.heard import heard_answers


@pytest.fixture
def heard(db: Database, mine: Claim) -> Claim:
    """A run whose agent has heard one answer of each choice."""
    for tick, choice in enumerate(CHOICES):
        answer(db, post_query(db, mine, 2 * tick, "guidance", 1, CLIPS), choice, "tab", "human")
        take_answer(db, mine, 2 * tick + 1)
    return mine


def test_it_is_what_the_agent_heard(client: httpx2.Client, db: Database, heard: Claim) -> None:
    reply = client.get(f"/api/v1/runs/{heard.run_id}/export")
    assert reply.status_code == 200
    rows = [json.loads(line) for line in reply.text.splitlines()]
    told = [
        (row["applied_tick"], {"left": row["left"], "right": row["right"]}, row["choice"]) for row in rows
    ]
    assert told == [
        (taken.answer.applied_tick, taken.query.clips, taken.answer.choice)
        for taken in heard_answers(db, heard.run_id)
    ]
    assert [row["mu"] for row in rows] == [[1, 0], [0, 1], [0.5, 0.5], None]


def test_it_is_a_file_with_a_name(client: httpx2.Client, heard: Claim) -> None:
    headers = client.get(f"/api/v1/runs/{heard.run_id}/export").headers
    assert headers["content-type"] == "application/x-ndjson"
    assert headers["content-disposition"] == f'attachment; filename="run-{heard.run_id}.jsonl"'
    assert "content-length" not in headers, "streamed: its length is not known before"


def test_run_without_answers_is_an_empty_file(client: httpx2.Client, run: Run) -> None:
    reply = client.get(f"/api/v1/runs/{run.id}/export")
    assert (reply.status_code, reply.content) == (200, b"")


def test_it_is_read_in_batches(client: httpx2.Client, heard: Claim, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(answers.every, "__defaults__", (1,))
    assert len(client.get(f"/api/v1/runs/{heard.run_id}/export").text.splitlines()) == len(CHOICES)


def table(client: httpx2.Client, run: int, of: str) -> list[dict[str, str]]:
    reply = client.get(f"/api/v1/runs/{run}/export?of={of}&format=csv")
    assert (reply.status_code, reply.headers["content-type"]) == (200, "text/csv; charset=utf-8")
    name = f"run-{run}.csv" if of == "answers" else f"run-{run}-{of}.csv"
    assert reply.headers["content-disposition"] == f'attachment; filename="{name}"'
    return list(csv.DictReader(StringIO(reply.text)))


def test_tables_hold_what_the_lines_hold(client: httpx2.Client, db: Database, heard: Claim) -> None:
    """Rows with different keys have one head; nothing that is null, false or nested is lost."""
    write_metrics(db, heard, {1: {"deaths": 0, "loss": None}, 2: {"deaths": 1, "new": -0.5}})
    add_operator_event(db, heard.run_id, "change", {"name": "p_rec", "value": 0.5})
    answers = table(client, heard.run_id, "answers")
    assert [(row["choice"], row["left_actions"], row["mu"]) for row in answers][:2] == [
        ("left", "up", "[1.0,0.0]"),
        ("right", "up", "[0.0,1.0]"),
    ]
    assert {row["standing"] for row in answers} == {"true"}
    run = str(heard.run_id)
    assert table(client, heard.run_id, "metrics") == [
        {"run": run, "tick": "1", "deaths": "0", "loss": "", "new": ""},
        {"run": run, "tick": "2", "deaths": "1", "loss": "", "new": "-0.5"},
    ]
    (event,) = table(client, heard.run_id, "events")
    assert (event["kind"], event["payload_name"], event["payload_value"]) == ("change", "p_rec", "0.5")


def test_lines_of_every_part(
    client: httpx2.Client, db: Database, heard: Claim, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exports, "BATCH", 1)
    write_metrics(db, heard, {tick: {"deaths": tick} for tick in (1, 2, 3)})
    for kind in ("end_episode", "mature"):
        add_operator_event(db, heard.run_id, kind, {})
    for part, key, values in (
        ("metrics", "deaths", [1, 2, 3]),
        ("events", "kind", ["end_episode", "mature"]),
    ):
        lines = client.get(f"/api/v1/runs/{heard.run_id}/export?of={part}").text.splitlines()
        assert [json.loads(line)[key] for line in lines] == values


def test_a_run_without_anything_is_a_table_with_a_head(client: httpx2.Client, run: Run) -> None:
    for of in ("answers", "metrics", "events"):
        assert client.get(f"/api/v1/runs/{run.id}/export?of={of}&format=csv").text.startswith("run,")
        assert table(client, run.id, of) == []


def test_what_people_wrote_is_no_formula(client: httpx2.Client, db: Database, heard: Claim) -> None:
    with db.write() as session:
        session.get_one(Run, heard.run_id).level = '=HYPERLINK("http://evil")'
    (said, *_) = {row["level"] for row in table(client, heard.run_id, "answers")}
    assert said == '\'=HYPERLINK("http://evil")'
    assert [cell(text) for text in ("-1", "+1", "@a", "\tx", "a=b")] == ["'-1", "'+1", "'@a", "'\tx", "a=b"]
    assert [cell(value) for value in (-1, -0.5, None, True, [-1])] == ["-1", "-0.5", "", "true", "[-1]"]


@pytest.mark.parametrize(
    ("name", "known"), [("format", ("jsonl", "csv", "zip")), ("of", ("answers", "metrics", "events"))]
)
def test_an_unknown_format_is_an_error_that_names_the_known_ones(
    client: httpx2.Client, run: Run, name: str, known: tuple[str, ...]
) -> None:
    refused = client.get(f"/api/v1/runs/{run.id}/export?{name}=xlsx")
    assert (refused.status_code, refused.json()["error"]["field"]) == (422, name)
    assert all(f"'{word}'" in refused.json()["error"]["message"] for word in known)
    assert client.get(f"/api/v1/runs/{run.id}/export?fromat=csv").status_code == 422


def test_the_whole_run_as_a_zip(client: httpx2.Client, heard: Claim) -> None:
    reply = client.get(f"/api/v1/runs/{heard.run_id}/export?format=zip")
    assert (reply.status_code, reply.headers["content-type"]) == (200, "application/zip")
    assert reply.headers["content-disposition"] == f'attachment; filename="run-{heard.run_id}.zip"'
    with ZipFile(BytesIO(reply.content)) as zipped:
        assert zipped.testzip() is None
        told = json.loads(zipped.read("manifest.json"))
        assert len(zipped.read("answers.jsonl").splitlines()) == len(CHOICES)
    assert [run["counts"]["answers"] for run in told["runs"]] == [len(CHOICES)]
    assert client.get("/api/v1/runs/99/export?format=zip").status_code == 404


@pytest.mark.parametrize("of", ["metrics", "answers"])
def test_a_zip_has_no_part(client: httpx2.Client, run: Run, of: str) -> None:
    refused = client.get(f"/api/v1/runs/{run.id}/export?of={of}&format=zip")
    assert (refused.status_code, refused.json()["error"]["field"]) == (422, "of")
    assert "A zip holds the whole run." in refused.json()["error"]["message"]
