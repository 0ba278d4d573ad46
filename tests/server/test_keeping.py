"""Runs are named, described, tagged and archived; the list is searched by that, and sorted."""

from __future__ import annotations

import httpx2
import pytest

from parenting.server import keeping, runs
from parenting.server.db import Database
from parenting.server.errors import InvalidFieldsError
from parenting.server.new_run import NewRun, start
from parenting.server.reads.listing import Order, Wanted, find_runs
from parenting.server.runs import get_run
from parenting.server.statuses import RunStatus
from parenting.server.tables import Run


@pytest.fixture
def three(db: Database) -> list[int]:
    """Three runs, of which the second is a script's."""
    worlds = ("unsafe-exploration", "reward-hacking", "unsafe-exploration")
    made = [
        start(db, NewRun(world=world, parent="scripted" if at == 1 else "human")).id
        for at, world in enumerate(worlds)
    ]
    keeping.describe(db, made[0], {"name": "Zebra", "tags": ["pilot", "group a"]})
    keeping.describe(
        db, made[1], {"name": "apple 100%", "description": "of the second week", "tags": ["pilots"]}
    )
    return made


def found(db: Database, limit: int = 9, before: int | None = None, **wanted: object) -> list[int]:
    return [run.id for run in find_runs(db, Wanted(**wanted), before, limit).rows]  # type: ignore[arg-type]  # of the test


def test_the_list_is_searched_and_sorted(db: Database, three: list[int]) -> None:
    for wanted, which in (
        ({"words": "zeb"}, [0]),
        ({"words": "WEEK pilots"}, [1]),
        ({"words": "100%"}, [1]),
        ({"words": "%"}, [1]),
        ({"words": "unsafe"}, [2, 0]),
        ({"words": "scripted"}, [1]),
        ({"words": "#3"}, [2]),
        ({"words": "zebra apple"}, []),
        ({"words": "zebra \0"}, []),
        ({"tag": "pilot\0"}, []),
        ({"world": "\0"}, []),
        ({"tag": "pilot"}, [0]),
        ({"tag": "group a"}, [0]),
        ({"tag": "pil_t"}, []),
        ({"world": "reward-hacking"}, [1]),
        ({"order": Order.OLDEST}, [0, 1, 2]),
        ({"order": Order.NAME}, [1, 2, 0]),
    ):
        assert found(db, **wanted) == [three[at] for at in which], wanted


def test_pages_of_every_order_hold_each_run_once(db: Database) -> None:
    made = [start(db, NewRun(world="unsafe-exploration", name=name)).id for name in "abcbacb"]
    with db.write() as session:
        for at, number in enumerate(made):
            run = session.get_one(Run, number)
            run.tick, run.answers = at % 3, at // 3
    for order in Order:
        pages: list[int] = []
        before = None
        for _ in range(4):
            page = find_runs(db, Wanted(order=order), before, 2)
            pages += [run.id for run in page.rows]
            before = page.next
        assert (pages, before, sorted(pages)) == (found(db, order=order), None, made), order


def test_archived_runs_are_hidden_not_lost(client: httpx2.Client, db: Database, three: list[int]) -> None:
    with db.write() as session:
        session.get_one(Run, three[0]).status = RunStatus.STOPPED
    url = f"/api/v1/runs/{three[0]}/archive"
    first = client.post(url, json={"archived": True}).json()["archived"]
    assert client.post(url, json={"archived": True}).json()["archived"] == first is not None
    assert found(db, archived=False) == three[:0:-1]
    assert found(db, archived=True) == [three[0]]
    assert len(client.get("/api/v1/runs").json()["rows"]) == 3
    assert "Zebra" not in client.get("/").text
    assert "Zebra" in client.get("/?archived=true").text
    assert client.post(url, json={"archived": False}).json()["archived"] is None


def test_what_is_left_out_stays(client: httpx2.Client, db: Database, three: list[int]) -> None:
    url = f"/api/v1/runs/{three[1]}/describe"
    said = client.post(url, json={"tags": ["b", "a", "b"]}).json()
    assert (said["name"], said["description"], said["tags"]) == (
        "apple 100%",
        "of the second week",
        ["b", "a"],
    )
    said = client.post(url, json={"name": None, "description": " two\r\nlines "}).json()
    assert (said["name"], said["description"], said["tags"]) == (None, "two\nlines", ["b", "a"])
    assert keeping.known_tags(db) == ["a", "b", "group a", "pilot"]


def test_wrong_words_are_named(client: httpx2.Client, three: list[int]) -> None:
    for body, field in (
        ({"tags": ["a,b"]}, "tags.0"),
        ({"tags": ["x" * 41]}, "tags.0"),
        ({"tags": ["\u200b"]}, "tags.0"),
        ({"tags": [str(number) for number in range(21)]}, "tags"),
        ({"name": "two\nlines"}, "name"),
        ({"description": "x" * 2001}, "description"),
        ({"description": "\x1b[2J"}, "description"),
        ({"nmae": "x"}, "nmae"),
    ):
        refused = client.post(f"/api/v1/runs/{three[0]}/describe", json=body)
        assert (refused.status_code, refused.json()["error"]["field"]) == (422, field)


def test_tags_come_and_go(db: Database, three: list[int]) -> None:
    keeping.tag(db, three[0], add=["new", "pilot"], remove=["group a", "absent"])
    assert keeping.split_tags(get_run(db, three[0]).tags) == ["pilot", "new"]
    with pytest.raises(InvalidFieldsError):
        keeping.tag(db, three[0], add=[str(number) for number in range(19)])


def test_a_run_that_is_over_can_be_named(db: Database, three: list[int]) -> None:
    runs.set_status(db, three[0], RunStatus.STOPPED)
    assert keeping.describe(db, three[0], {"name": "Afterwards"}).name == "Afterwards"
