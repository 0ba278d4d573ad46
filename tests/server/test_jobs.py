"""Jobs: asked by a page, claimed by one worker at a time, bounded in number and age; and their routes."""

from __future__ import annotations

from typing import Any, get_args

import httpx2
import pytest

from parenting.server import jobs
from parenting.server.api import bodies
from parenting.server.db import Database
from parenting.server.errors import Conflict, LostClaimError, NotFound
from parenting.server.job_kinds import KINDS, OF_NO_RUN, WalkPayload
from parenting.server.jobs import JobClaim
from parenting.server.public_ids import public_id
from parenting.server.statuses import JobState
from parenting.server.tables import Job, Run
from parenting.server.work.doers import DOERS, DOERS_OF_NO_RUN
from parenting.server.workers import sign
from tests.server.conftest import Clock

WALK: dict[str, Any] = {"client_id": "me", "kind": "walk", "payload": {"seed": 7}}


def ask(db: Database, run: Run) -> Job:
    return jobs.ask(db, run.id, "walk", {"seed": 7}, "me")


def take(db: Database, worker: str, most: int = 1) -> JobClaim:
    (mine,) = jobs.claim(db, worker, most)
    return mine


def test_a_job_is_claimed_once_and_done(db: Database, run: Run) -> None:
    first, second = ask(db, run), ask(db, run)
    mine = take(db, "a")
    assert (mine.job_id, mine.kind, mine.payload) == (first.id, "walk", {"seed": 7})
    assert jobs.get(db, first.public_id).state is JobState.WORKING
    other = take(db, "b", most=5)
    assert other.job_id == second.id
    assert jobs.claim(db, "c", 5) == []
    assert not jobs.waits(db)
    jobs.finish(db, mine, {"steps": 3})
    done = jobs.get(db, first.public_id)
    assert (done.state, done.result, done.reason) == (JobState.DONE, {"steps": 3}, None)


def test_the_job_of_a_silent_worker_is_taken_and_the_old_claim_stores_nothing(
    db: Database, run: Run, clock: Clock
) -> None:
    asked = ask(db, run)
    killed = take(db, "killed")
    clock.pass_seconds(4)
    assert not jobs.waits(db)
    jobs.renew(db, [killed])
    clock.pass_seconds(4)
    assert not jobs.waits(db)  # it gave a sign of life
    clock.pass_seconds(2)
    assert jobs.waits(db)
    mine = take(db, "other")
    jobs.renew(db, [killed])
    with pytest.raises(LostClaimError):
        jobs.finish(db, killed, {"by": "killed"})
    jobs.finish(db, mine, {"by": "other"})
    assert jobs.get(db, asked.public_id).result == {"by": "other"}


def test_a_job_that_ends_its_workers_is_given_up(db: Database, run: Run, clock: Clock) -> None:
    asked = ask(db, run)
    for number in range(jobs.TRIES):
        take(db, f"worker-{number}")
        clock.pass_seconds(6)
    assert jobs.claim(db, "last", 1) == []
    found = jobs.get(db, asked.public_id)
    assert (found.state, found.reason) == (JobState.FAILED, jobs.GIVEN_UP)


def test_what_a_worker_gives_back_is_free_at_once(db: Database, run: Run) -> None:
    ask(db, run)
    jobs.let_go(db, [take(db, "ending")])
    assert take(db, "other").fencing_token == 2


def test_a_job_that_nobody_takes_fails_within_a_minute_and_is_swept(
    db: Database, run: Run, clock: Clock
) -> None:
    asked = ask(db, run)
    clock.pass_seconds(jobs.WAITS_SECONDS + 1)
    assert jobs.claim(db, "late", 1) == []
    assert jobs.get(db, asked.public_id).reason == jobs.NOT_TAKEN
    clock.pass_seconds(jobs.KEPT_SECONDS)
    fresh = ask(db, run)
    with pytest.raises(NotFound, match="kept for ten minutes"):
        jobs.get(db, asked.public_id)
    assert jobs.get(db, fresh.public_id).state is JobState.WAITING


def test_few_jobs_of_a_run_are_open_and_few_are_kept(
    db: Database, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("parenting.server.jobs.KEPT_OF_A_RUN", 5)
    asked = []
    for _ in range(7):
        asked.append(ask(db, run).public_id)
        jobs.finish(db, take(db, "a"), {})
    with pytest.raises(NotFound):
        jobs.get(db, asked[1])
    assert jobs.get(db, asked[2]).state is JobState.DONE
    for _ in range(jobs.OPEN_OF_A_RUN):
        ask(db, run)
    with pytest.raises(Conflict, match="4 jobs of this run wait"):
        ask(db, run)
    with pytest.raises(NotFound, match="no run 9"):
        jobs.ask(db, 9, "walk", {}, "me")


def test_a_result_that_is_too_large_fails_in_a_sentence(
    db: Database, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("parenting.server.jobs.RESULT_BYTES", 20)
    asked = ask(db, run)
    jobs.finish(db, take(db, "a"), {"frames": "x" * 40})
    found = jobs.get(db, asked.public_id)
    assert (found.state, found.result) == (JobState.FAILED, None)
    assert found.reason == "Its result has 53 characters, and 20 are kept at most."


def test_every_kind_has_a_payload_a_body_and_a_doer() -> None:
    variants = get_args(get_args(bodies.JobBody)[0])
    named = {get_args(body.model_fields["kind"].annotation)[0]: body for body in variants}
    assert KINDS.keys() == named.keys()
    assert (DOERS.keys(), DOERS_OF_NO_RUN.keys()) == (KINDS.keys(), OF_NO_RUN.keys())
    assert {kind: type(body.model_fields["payload"].default) for kind, body in named.items()} == KINDS


def test_the_routes(client: httpx2.Client, db: Database, run: Run) -> None:
    asked = client.post(f"/api/v1/runs/{run.public_id}/jobs", json=WALK)
    assert asked.status_code == 202
    written_otherwise = client.post(
        f"/api/v1/runs/{run.public_id}/jobs", json=WALK | {"payload": {"seed": 7.0}}
    )
    assert written_otherwise.json()["payload"] == {"seed": 7}
    shown = asked.json()
    assert (shown["state"], shown["payload"], shown["worker"]) == ("waiting", {"seed": 7}, "silent")
    sign(db, "a")
    mine = take(db, "a")
    assert client.get(f"/api/v1/jobs/{shown['id']}").json()["state"] == "working"
    jobs.finish(db, mine, {"steps": 3})
    done = client.get(f"/api/v1/jobs/{shown['id']}").json()
    assert (done["state"], done["result"], done["worker"]) == ("done", {"steps": 3}, "alive")
    assert client.get(f"/api/v1/jobs/{public_id()}").status_code == 404
    assert client.post("/api/v1/runs/9/jobs", json=WALK).status_code == 404


@pytest.mark.only("sqlite", "the bodies are the same")
@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"kind": "dance"}, "body"),
        ({"payload": {"seed": "7"}}, "payload.seed"),
        ({"payload": {"seed": 7, "code": "x"}}, "payload.code"),
        ({"client_id": ""}, "client_id"),
    ],
)
def test_what_is_no_job_is_refused_by_its_field(
    client: httpx2.Client, run: Run, changes: dict[str, Any], field: str
) -> None:
    refused = client.post(f"/api/v1/runs/{run.id}/jobs", json={**WALK, **changes})
    assert (refused.status_code, refused.json()["error"]["field"]) == (422, field)
    assert "dance" not in refused.text


@pytest.mark.only("sqlite", "it never comes to the store")
def test_another_site_asks_for_nothing(client: httpx2.Client, db: Database, run: Run) -> None:
    path = f"/api/v1/runs/{run.id}/jobs"
    assert client.post(path, json=WALK, headers={"Origin": "https://elsewhere.example"}).status_code == 403
    assert not jobs.waits(db)


def test_a_walk_names_its_seed_or_has_one() -> None:
    assert WalkPayload().model_dump() == {"seed": 0}
