"""A row that cannot be read costs itself: every other run, page, list, stream and export goes on."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest
from fastapi.testclient import TestClient

from parenting.server.app import create_app
from parenting.server.columns import Json
from parenting.server.db import Database
from parenting.server.settings import Settings
from tests.database import migrated
from tests.lengths import length
from tests.server.damaging import (
    JSON_GARBAGE,
    SOUND,
    VICTIM,
    Damage,
    all_at_once,
    columns,
    damaged,
    each_alone,
    read_lines,
    two_runs,
)

DAMAGES = length(all_at_once(), each_alone())
EVERYBODYS = ("/", "/api/v1/runs", "/healthz")
LISTS = ("queries", "metrics", "operator-events")
PAGES = (
    "/runs/{}",
    "/runs/{}/history",
    "/runs/{}/why",
    "/runs/{}/parent",
    "/api/v1/runs/{}",
    "/runs/{}/stages",
)


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    database = migrated(Settings(data=tmp_path_factory.mktemp("damaged"), database_url=None))
    two_runs(database)
    yield database
    database.close()


@pytest.fixture(scope="module")
def web(db: Database) -> Iterator[httpx2.Client]:
    file = db.engine.url.database
    assert file is not None
    settings = Settings(data=Path(file).parent, database_url=None)
    with TestClient(create_app(settings, db), base_url="http://localhost") as caller:
        yield caller


@pytest.mark.slow_after(1)
@pytest.mark.torture
@pytest.mark.parametrize("damage", DAMAGES, ids=lambda damage: "+".join(str(column) for column, _ in damage))
def test_garbage_costs_its_row_alone(db: Database, web: httpx2.Client, damage: Damage) -> None:
    with damaged(db, damage):
        others_work(web)
        own_pages_say_so(web)
        lines = read_lines(web.get(f"/api/v1/runs/{VICTIM}/export").text)
        assert len(lines) == 2 or {"run_id", "answers"} & {column.name for column, _ in damage}, lines


def others_work(web: httpx2.Client) -> None:
    """Nobody else's page or list knows of the damage, but by its own line."""
    own = [path.format(SOUND) for path in PAGES] + [f"/api/v1/runs/{SOUND}/{name}" for name in LISTS]
    for path in (*EVERYBODYS, *own):
        reply = web.get(path)
        assert reply.status_code == 200, (path, reply.text)
    lines = read_lines(web.get(f"/api/v1/runs/{SOUND}/export").text)
    assert [line["choice"] for line in lines] == ["left", "left"]
    assert not any("damaged" in line for line in lines)
    question = web.post(f"/api/v1/runs/{SOUND}/queries/lease", json={"client_id": "me"})
    assert question.status_code == 200
    assert question.json()["left"]["actions"] == ["up"]


def own_pages_say_so(web: httpx2.Client) -> None:
    """Its lists and its history work; a page that needs the row says what is damaged."""
    for name in LISTS:
        assert web.get(f"/api/v1/runs/{VICTIM}/{name}").status_code == 200
    for path in PAGES:
        reply = web.get(path.format(VICTIM))
        assert reply.status_code == 200 or (reply.status_code == 500 and "damaged" in reply.text), path
    for path, body in (("queries/lease", {"client_id": "me"}), ("resume", None)):
        reply = web.post(f"/api/v1/runs/{VICTIM}/{path}", json=body)
        assert reply.status_code < 300 or reply.json()["error"]["code"] == "damaged", (path, reply.text)


def test_every_column_of_every_table_is_tried() -> None:
    tried = {str(column) for damage in DAMAGES for column, _ in damage}
    assert tried == {str(column) for column in columns()}
    assert {name.split(".")[0] for name in tried} >= {"run", "query", "answer", "event", "metric"}
    values = {value for damage in DAMAGES for column, value in damage if isinstance(column.type, Json)}
    assert len(values) >= len(JSON_GARBAGE)
