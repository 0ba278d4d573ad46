"""Lists come in pages: nothing is left out or comes twice, and what is added meanwhile shifts nothing."""

from typing import Any

import httpx2
import pytest

from parenting.server.db import Database
from parenting.server.metrics import write_metrics
from parenting.server.new_run import NewRun, start
from parenting.server.operator_events import add_operator_event
from parenting.server.queue.answers import answer
from parenting.server.queue.revisions import supersede
from parenting.server.queue.worker_side import post_query, take_answer
from parenting.server.runs import Claim
from tests.server.conftest import CLIPS
from tests.server.test_api import wrong


def walk(
    client: httpx2.Client, path: str, cursor: str = "after", limit: int = 2, **more: Any
) -> list[list[Any]]:
    """The pages of a list, one after the other."""
    pages, place = [], None
    while True:
        asked = {"limit": limit, **more} | ({} if place is None else {cursor: place})
        page = client.get(path, params=asked).json()
        assert page.keys() - {"database"} == {"rows", "next"}
        pages.append(page["rows"])
        place = page["next"]
        if place is None:
            return pages


@pytest.fixture
def asked(db: Database, mine: Claim) -> list[int]:
    """Five questions: one applied, one answered, three open."""
    queries = [post_query(db, mine, tick, "preference", 1, CLIPS, (1, tick)) for tick in range(5)]
    answer(db, queries[0], "left", "tab", "human")
    take_answer(db, mine, 5)
    answer(db, queries[1], "right", "tab", "human")
    return queries


def ids(pages: list[list[Any]]) -> list[list[int]]:
    return [[row["id"] for row in page] for page in pages]


def test_runs_newest_first(client: httpx2.Client, db: Database) -> None:
    made = [start(db, NewRun(world="unsafe-exploration")).id for _ in range(4)]
    assert ids(walk(client, "/api/v1/runs", "before")) == [made[:1:-1], made[1::-1]]


def test_run_that_starts_meanwhile_shifts_nothing(client: httpx2.Client, db: Database) -> None:
    first, second, third = [start(db, NewRun(world="unsafe-exploration")).id for _ in range(3)]
    page = client.get("/api/v1/runs", params={"limit": 2}).json()
    start(db, NewRun(world="unsafe-exploration"))
    following = client.get("/api/v1/runs", params={"limit": 2, "before": page["next"]}).json()
    assert ids([page["rows"], following["rows"]]) == [[third, second], [first]]


def test_questions_oldest_first(client: httpx2.Client, mine: Claim, asked: list[int]) -> None:
    pages = walk(client, f"/api/v1/runs/{mine.run_id}/queries")
    assert ids(pages) == [asked[:2], asked[2:4], asked[4:]]
    alone = [client.get(f"/api/v1/queries/{query}").json() for query in asked]
    assert [row for page in pages for row in page] == alone


@pytest.mark.parametrize(
    ("status", "places"), [("applied", [0]), ("answered", [1]), ("open", [2, 3, 4]), ("withdrawn", [])]
)
def test_questions_of_a_status(
    client: httpx2.Client, mine: Claim, asked: list[int], status: str, places: list[int]
) -> None:
    pages = walk(client, f"/api/v1/runs/{mine.run_id}/queries", status=status)
    assert [number for page in ids(pages) for number in page] == [asked[place] for place in places]


def test_question_shows_the_answer_that_stands(client: httpx2.Client, db: Database, asked: list[int]) -> None:
    def shown(query: int) -> Any:
        return client.get(f"/api/v1/queries/{query}").json()

    assert (shown(asked[0])["answer"]["choice"], shown(asked[0])["answer"]["applied_tick"]) == ("left", 5)
    supersede(db, asked[0], "either", "tab", "human")
    assert (shown(asked[0])["answer"]["choice"], shown(asked[0])["answer"]["applied_tick"]) == (
        "either",
        None,
    )
    assert shown(asked[2])["answer"] is None
    assert shown(asked[3])["policy"] == {"stage": 1, "gradient_steps": 3}


def test_questions_of_another_run_stay_out(client: httpx2.Client, db: Database, asked: list[int]) -> None:
    other = start(db, NewRun(world="unsafe-exploration"))
    assert client.get(f"/api/v1/runs/{other.id}/queries").json() == {"rows": [], "next": None}


def test_metrics_in_pages(client: httpx2.Client, db: Database, mine: Claim) -> None:
    write_metrics(db, mine, {tick: {"deaths": 0} for tick in (0, 3, 9)})
    pages = walk(client, f"/api/v1/runs/{mine.run_id}/metrics")
    assert [[row["tick"] for row in page] for page in pages] == [[0, 3], [9]]


def test_operators_events_in_pages(client: httpx2.Client, db: Database, mine: Claim) -> None:
    made = [add_operator_event(db, mine.run_id, "end_episode", {"kind": "end_episode"}).id for _ in range(4)]
    assert ids(walk(client, f"/api/v1/runs/{mine.run_id}/operator-events")) == [made[:2], made[2:]]


@pytest.mark.parametrize(
    ("path", "cursor", "most"),
    [
        ("", "before", 200),
        ("/{run}/queries", "after", 200),
        ("/{run}/metrics", "after", 10_000),
        ("/{run}/operator-events", "after", 1000),
    ],
)
def test_wrong_part_of_a_list(client: httpx2.Client, mine: Claim, path: str, cursor: str, most: int) -> None:
    def named(**part: Any) -> set[str]:
        return set(wrong(client.get(f"/api/v1/runs{path.format(run=mine.run_id)}", params=part)))

    assert named(limit=0) == named(limit=most + 1) == named(limit="many") == {"limit"}
    assert named(**{cursor: -2}) == named(**{cursor: 2**53}) == named(**{cursor: "x"}) == {cursor}
    assert named(nxet=3) == {"nxet"}, "a misspelt cursor would begin again without end"


def test_unknown_status(client: httpx2.Client, mine: Claim) -> None:
    refused = client.get(f"/api/v1/runs/{mine.run_id}/queries", params={"status": "lost"})
    assert wrong(refused).keys() == {"status"}
