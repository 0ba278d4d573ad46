"""Runs begin with an earlier policy and earlier answers; they replay, and refuse what does not fit."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest
import torch
from sqlalchemy import text

import parenting as pt
from parenting.server import runs
from parenting.server.db import Database
from parenting.server.errors import InvalidFieldsError, SetupError
from parenting.server.export import lines
from parenting.server.migrate import downgrade
from parenting.server.new_run import NewRun, plan, start
from parenting.server.policies import present_policy
from parenting.server.queue import revisions, worker_side
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.tables import Answer
from parenting.server.verify import verify
from parenting.weights.origin import UnreadableOriginError, read_origin
from tests.database import migrated
from tests.server.raising import ISLAND


def taken_up(db: Database, run: int) -> RunSession:
    with db.write() as session:
        session.execute(text("UPDATE run SET worker = NULL"))
    mine = next(claim for claim in runs.claim(db, "worker") if claim.run_id == run)
    return RunSession(db, mine, runs.get_run(db, run), lambda: None)


def live_to(life: RunSession, tick: int) -> None:
    while life.last_tick < tick:
        life.tick(worker_side.watch(life.db, [life.claim.run_id])[life.claim.run_id])


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[bytes, str]]:
    """The policy and the answers of a run of thirty ticks."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("parenting.server.checkpoint_pace.CHECKPOINT_SECONDS", 1e9)
        db = migrated(Settings(data=tmp_path_factory.mktemp("first")))
        first = start(db, ISLAND.new("scripted")).id
        life = taken_up(db, first)
        live_to(life, 30)
        life.save()
        yield present_policy(db, first).blob, "".join(lines(db, first))
        db.close()


@pytest.fixture
def files(written: tuple[bytes, str], tmp_path: Path) -> tuple[Path, Path]:
    policy, answers = tmp_path / "first.safetensors", tmp_path / "first.jsonl"
    policy.write_bytes(written[0])
    answers.write_text(written[1])
    return policy, answers


def test_a_run_begins_with_both_and_replays(
    db: Database, client: httpx2.Client, files: tuple[Path, Path]
) -> None:
    run = start(db, ISLAND.new("scripted"), origin=read_origin(*files))
    life = taken_up(db, run.id)
    begun, policy = life.saved.state, pt.load_policy(files[0])
    assert torch.equal(begun.learner.params[0], policy.parameters)
    source = policy.about["source"]
    assert (int(begun.x.size[0]), int(begun.x.rows[0])) == (source["entries"], source["rows"])
    assert int(begun.familiarity.sum()) == 0  # so that it asks before it acts (2.1)
    live_to(life, 12)
    with db.read() as session:
        heard = session.query(Answer).filter(Answer.run_id == run.id).first()
    assert heard is not None
    revisions.supersede(db, heard.query_id, "either", heard.client_id, "scripted")
    size = int(life.saved.state.x.size[0])
    live_to(life, 14)
    assert int(life.saved.state.x.size[0]) >= size  # a correction keeps the earlier answers
    live_to(life, 30)
    life.save()
    found = verify(db, run.id)
    assert (found.sound, found.x, found.chain.problems) == (True, None, [])
    shown = client.get(f"/api/v1/runs/{run.id}").json()["origin"]
    assert shown["policy"]["run"] == shown["answers"]["run"] == source["run"]
    page = client.get(f"/runs/{run.public_id}").text
    assert f"It began with the policy first.safetensors ({shown['policy']['sha256'][:12]}, of run" in page
    assert "Its X began with" in page


@pytest.mark.only("sqlite")
def test_answers_alone_leave_the_weights_fresh(db: Database, files: tuple[Path, Path]) -> None:
    run = start(db, ISLAND.new("scripted"), origin=read_origin(None, files[1]))
    begun = taken_up(db, run.id).saved.state
    assert torch.equal(begun.learner.params, ISLAND.initial_snapshot().state.learner.params)
    assert int(begun.x.size[0]) > 5
    with pytest.raises(SetupError, match=f"Run {run.id} began with an earlier policy, answers or run"):
        downgrade(db, "0022")


@pytest.mark.parametrize(
    ("new", "field", "words"),
    [
        (NewRun(world="side-effects"), "world", "is of the world unsafe-exploration, not of side-effects"),
        (
            NewRun(world="unsafe-exploration", level_text="WWWWW\nWA GW\nWWWWW", config={"stages": 3}),
            "level",
            "boards of 6 x 8, and this level has 3 x 5",
        ),
        (
            NewRun(world="unsafe-exploration", config={"dtype": "float64", "stages": 3}),
            "config.dtype",
            "numbers of float32, and the run of float64",
        ),
    ],
)
def test_what_does_not_fit_is_refused_with_its_field(
    files: tuple[Path, Path], new: NewRun, field: str, words: str
) -> None:
    with pytest.raises(InvalidFieldsError) as refused:
        plan(new, origin=read_origin(*files))
    assert any(name == field and words in said for name, said in refused.value.fields), refused.value.fields


def _changed(change: Callable[[dict[str, Any]], None]) -> Callable[[str], str]:
    def changed(lines: str) -> str:
        row = json.loads(lines.splitlines()[0])
        change(row)
        return json.dumps(row) + "\n"

    return changed


def test_of_an_origin_names_and_numbers_are_kept(files: tuple[Path, Path], tmp_path: Path) -> None:
    """A number that is none cannot be stored, and other texts have no end."""
    for told, kept in ((math.nan, None), ("x" * 101, None), ({"a": 1}, None), ("5J3m", "5J3m"), (7, 7)):
        text = files[1].read_text()
        files[1].write_text(_changed(lambda row: row.update(database=told, run_public_id=told))(text))  # noqa: B023
        about = read_origin(None, files[1]).about
        assert about is not None
        assert (about["answers"]["database"], about["answers"]["run"]) == (kept, kept)
    named = tmp_path / "\udcff\x1b.jsonl"
    named.write_bytes(files[1].read_bytes())
    about = read_origin(None, named).about
    assert about is not None
    assert about["answers"]["file"] == "\\udcff\\x1b.jsonl"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda lines: "not JSON\n", "line 1 is not JSON"),
        (lambda lines: "[" * 100_000, "line 1 is not JSON"),
        (lambda lines: '{"a": 1}\n', "line 1 is not an answer"),
        (lambda lines: "", "no answer stands in it"),
        (_changed(lambda row: row.update(standing=False)), "no answer stands in it"),
        (_changed(lambda row: row["left"].update(actions=["jump"])), "line 1: left.actions.0"),
    ],
)
def test_an_export_that_is_none_is_refused_by_its_line(
    files: tuple[Path, Path], change: Callable[[str], str], words: str
) -> None:
    files[1].write_text(change(files[1].read_text()))
    with pytest.raises(UnreadableOriginError, match=words) as refused:
        read_origin(None, files[1])
    assert refused.value.field == "from_answers"


@pytest.mark.parametrize(
    ("damage", "field"),
    [
        (lambda row: row["left"]["frames"].pop(), "level"),
        (lambda row: row["left"]["frames"][0]["observed"].pop(), "level"),
        (lambda row: row["left"]["frames"][0].update(agent=[99, 0]), "level"),
        (lambda row: row["left"]["frames"][0]["ground"].__setitem__(0, "????????"), "level"),
        (lambda row: row.update(maturity=9), "config.stages"),
    ],
)
def test_an_answer_that_does_not_fit_is_refused(
    files: tuple[Path, Path], damage: Callable[[Any], None], field: str
) -> None:
    files[1].write_text(_changed(damage)(files[1].read_text()))
    origin = read_origin(None, files[1])
    assert [name for name, _ in origin.misfits(ISLAND.make().levels[0], ISLAND.config)] == [field]
