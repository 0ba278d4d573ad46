"""Runs begin with an earlier policy and earlier answers; they replay, and refuse what does not fit."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest
import torch
from sqlalchemy import select, text

import parenting as pt
from parenting.server import inherited, runs
from parenting.server.beginnings import parameters
from parenting.server.db import Database
from parenting.server.errors import InvalidFieldsError, SetupError
from parenting.server.export import lines
from parenting.server.migrate import downgrade
from parenting.server.new_run import NewRun, plan, start
from parenting.server.policies import present_policy
from parenting.server.queue import revisions, worker_side
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.tables import Answer, Weights
from parenting.server.verify import verify
from parenting.weights.origin import UnreadableOriginError, origin_of, read_origin
from parenting.weights.policy_file import pack, unpack
from tests.database import migrated
from tests.server.raising import ISLAND

BYTES = {"Content-Type": "application/octet-stream"}


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


@pytest.mark.slow
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
        heard = session.query(Answer).filter(Answer.run_id == run.id).limit(1).one()
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
    assert (read_origin(None, named).about or {})["answers"]["file"] == "\\udcff\\x1b.jsonl"


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
    files[1].write_text("{}", encoding="utf-16")
    with pytest.raises(UnreadableOriginError, match="it is UTF-16, and a table is read in UTF-8; save it as"):
        read_origin(None, files[1])


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


def test_a_policy_is_uploaded_and_a_run_begins_with_it_and_with_stored_answers(
    db: Database, client: httpx2.Client, written: tuple[bytes, str]
) -> None:
    earlier = start(db, ISLAND.new("scripted"))
    live_to(taken_up(db, earlier.id), 12)
    told = client.post("/api/v1/policies?file=../first.safetensors", content=written[0], headers=BYTES)
    assert (told.status_code, told.json()["world"]) == (201, "unsafe-exploration")
    sha256 = told.json()["sha256"]
    body = {**ISLAND.new("scripted").model_dump(exclude_none=True), "from_policy": sha256}
    begun = client.post("/api/v1/runs", json={**body, "from_answers": earlier.public_id})
    origin = begun.json()["origin"]
    assert (begun.status_code, origin["policy"]["stored"]) == (201, sha256)
    assert (origin["policy"]["file"], origin["answers"]["run"]) == ("first.safetensors", earlier.public_id)
    state = taken_up(db, begun.json()["id"]).saved.state
    assert torch.equal(state.learner.params[0], parameters(unpack(written[0])))
    assert int(state.x.size[0]) > 0
    for field, name in (("from_policy", "0" * 64), ("from_answers", "3sQv8hYJ2cT7mWk9xRzLpB")):
        refused = client.post("/api/v1/runs", json={**body, field: name})
        assert (refused.status_code, refused.json()["error"]["field"]) == (422, field)


def test_the_form_takes_a_policy_and_keeps_it_until_the_run_begins(
    db: Database, client: httpx2.Client, written: tuple[bytes, str]
) -> None:
    """Without a script, too; a file that was chosen and not sent is not passed over."""
    form = {"world": "unsafe-exploration", "preset": "lax", "parent": "scripted", "seed": "5"}
    page = client.post("/policies", data=form, files={"policy_file": ("<b>.safetensors", written[0])})
    assert page.status_code == 200
    assert "The policy &lt;b&gt;.safetensors" in page.text
    assert "Of the world Unsafe Exploration" in page.text
    assert 'value="5"' in page.text
    (sha256,) = re.findall(r'name="from_policy" value="(\w+)" checked', page.text)
    wrong = client.post("/runs", data={**form, "seed": "many", "from_policy": sha256})
    assert f'name="from_policy" value="{sha256}" checked' in wrong.text
    assert client.post("/runs", data={**form, "policy_file": "mine.safetensors"}).status_code == 422
    assert client.post("/policies", data=form).status_code == 422
    assert client.post("/runs", data={**form, "from_policy": sha256, "policy_file": ""}).is_success
    (run,) = runs.list_runs(db)
    assert run.origin is not None
    assert run.origin["policy"]["file"] == "<b>.safetensors"
    elsewhere = client.post("/runs", data={**form, "world": "side-effects", "from_policy": sha256})
    assert "The policy is of the world unsafe-exploration, not of side-effects." in elsewhere.text


def _header(text: str) -> bytes:
    return len(text).to_bytes(8, "little") + text.encode()


NONE = "it is not a policy of Parenting"


@pytest.mark.only("sqlite")
@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda _: b"PK\x03\x04" * 100, NONE),
        (lambda _: (2**40).to_bytes(8, "little"), NONE),
        (lambda _: _header('{"__metadata__": {"about": "' + "[" * 200_000 + '"}}'), NONE),
        (lambda _: _header('{"__metadata__": {"about": "{}"}}'), NONE),
        (lambda blob: blob[:-1] + bytes([blob[-1] ^ 1]), "its parameters are not those that were written"),
        (lambda blob: blob[:-4], NONE),
    ],
    ids=["zip", "length", "nested", "empty", "flipped", "cut"],
)
def test_what_is_no_policy_is_refused_by_a_sentence(
    db: Database,
    client: httpx2.Client,
    written: tuple[bytes, str],
    damage: Callable[[bytes], bytes],
    words: str,
) -> None:
    sent = damage(written[0])
    told = client.post("/api/v1/policies", content=sent, headers=BYTES)
    assert (told.status_code, told.json()["error"]["field"]) == (422, "from_policy")
    assert words in told.json()["error"]["message"]
    page = client.post("/policies", data={}, files={"policy_file": ("bad.safetensors", sent)})
    assert (page.status_code, words in page.text) == (422, True)
    with db.read() as session:
        assert session.scalars(select(Weights)).all() == []


@pytest.mark.only("sqlite")
def test_uploads_are_bounded_in_size_and_number_and_only_from_our_pages(
    client: httpx2.Client, written: tuple[bytes, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    large = client.post("/api/v1/policies", content=bytes(inherited.POLICY_BYTES + 1), headers=BYTES)
    assert large.status_code == 413
    for path in ("/policies", "/api/v1/policies"):
        abroad = client.post(path, content=b"x", headers={**BYTES, "sec-fetch-site": "cross-site"})
        assert abroad.status_code == 403
    monkeypatch.setattr(inherited, "UPLOADS", 1)
    made, refused = (client.post("/api/v1/policies", content=written[0], headers=BYTES) for _ in range(2))
    assert (made.status_code, refused.status_code) == (201, 409)
    assert client.post("/policies", files={"policy_file": ("a", written[0])}).status_code == 422


def test_a_policy_with_too_few_parameters_is_refused() -> None:
    level = ISLAND.make().levels[0]
    about = {"world": level.world, "levels": [level.text], "config": {}, "stage": 1, "seed": 0}
    short = origin_of(("short", pack(bytes(40), "float32", about)), None)
    ((field, said),) = short.misfits(level, ISLAND.config)
    assert (field, said.startswith("It is damaged: a policy for this level has ")) == ("from_policy", True)
