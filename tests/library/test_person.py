"""A person as the parent, from Python: on the page by a real browser, and at the terminal."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import torch

import parenting as pt
from parenting.library import page_run, page_training
from parenting.library.page_server import is_ready
from parenting.library.task import prepare, stop_rule
from parenting.server.db import connect
from parenting.server.migrate import upgrade
from parenting.server.reads.schemas import run_schema
from parenting.server.security import NOBODY
from parenting.server.settings import Settings
from tests import simulated_person
from tests.library.person_at_page import PersonAtPage

WORLD = "unsafe-exploration"


@pytest.mark.slow
@pytest.mark.faults
@pytest.mark.timeout(900)
def test_a_person_on_the_page_raises_an_agent_and_goes_on_after_an_interruption(
    person_at_the_page: Callable[..., list[PersonAtPage]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One test for the whole of it: starting the server twice takes seconds.

    The first run is interrupted after six answers; they are kept. The second goes on to the tenth.
    """
    opened = person_at_the_page(6, then=lambda: os.kill(os.getpid(), signal.SIGINT))
    arguments: dict[str, Any] = {"until": "queries:10", "seed": 3, "p_guid": 1.0, "p_pref": 0.0}
    first = pt.train(WORLD, parent=pt.Person(data=tmp_path), **arguments)
    said = capsys.readouterr().out
    assert len(first.answers) == 6
    assert first.trials[0]["finished"] is False
    assert f"6 answers are kept in {tmp_path}, as run 1" in said
    assert f'parent=pt.Person(data="{tmp_path}", run=1)' in said

    opened.clear()
    opened = person_at_the_page(4)
    result = pt.train(WORLD, parent=pt.Person(data=tmp_path, run=1), **arguments)
    assert [row["choice"] for row in result.answers[:6]] == [row["choice"] for row in first.answers]
    assert (len(result.answers), result.trials[0]["guidance"]) == (10, 10)
    assert result.trials[0]["finished"] is True

    with pytest.raises(ValueError, match="seed: run 1 has 3, not 4"):
        pt.train(WORLD, parent=pt.Person(data=tmp_path, run=1), **{**arguments, "seed": 4})
    # what the page stored is what the engine does with these answers
    replayed = pt.train(WORLD, parent=pt.ReplayParent(result), progress=False, **arguments)
    assert torch.equal(replayed.policies[0].parameters, result.policies[0].parameters)


@pytest.mark.parametrize(("until", "finish"), [("optimal", "optimal"), ("queries:5", "never")])
def test_the_worker_ends_a_persons_run_at_the_tick_of_the_optimum(
    until: str, finish: str, tmp_path: Path
) -> None:
    """A row of metrics, which may come later, does not (`server.optimality`)."""
    task, settings = prepare(WORLD, None, "conservative", {}), Settings(data=tmp_path)
    rule = stop_rule(task.world, until)
    with closing(connect(settings)) as db:
        upgrade(db)
        run = page_run.begin(db, settings, task, rule, 3, pt.Person())
        seen = run_schema(db, run).model_copy(update={"optimal": True})
    assert seen.finish == finish
    assert not page_training._is_done(seen, rule)


def test_a_server_that_does_not_come_up_is_told_with_its_last_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PARENTING_LEASE_SECONDS", "60")
    monkeypatch.setattr(page_training, "running_server", _broken)
    with pytest.raises(RuntimeError, match="no room"):
        pt.train(WORLD, parent=pt.Person(data=tmp_path))


def _broken(data: Path) -> Any:
    (data / "server.log").write_text("no room\n")
    from contextlib import contextmanager

    @contextmanager
    def server() -> Iterator[Any]:
        import subprocess
        import sys

        command = [sys.executable, "-c", "pass"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            yield process

    return server()


class Typist:
    """The keys that a person types, and the screen before each of them."""

    def __init__(self, keys: list[str]) -> None:
        self.keys, self.prompts = iter(keys), list[str]()

    def __call__(self, prompt: str) -> str:
        self.prompts.append(prompt)
        key = next(self.keys)
        if key == "^C":
            raise KeyboardInterrupt
        if key == "^D":
            raise EOFError
        return key


def test_at_the_terminal_a_letter_answers(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    typist = Typist(["l", "what?", "R", "e", "n", "l"])
    monkeypatch.setattr("builtins.input", typist)
    result = pt.train(WORLD, parent=pt.Person("terminal"), until="queries:5", p_guid=1.0, p_pref=0.0)
    assert [row["choice"] for row in result.answers] == ["left", "right", "either", "neither", "left"]
    said = capsys.readouterr().out
    assert said.count("guidance: Which move is better?") == 5
    first = result.answers[0]
    assert f"left: {first['left']}\n" in said
    assert f"right: {first['right']}\n" in said
    assert all("l left, r right, e either, n neither" in prompt for prompt in typist.prompts)


@pytest.mark.parametrize("key", ["^C", "^D", "q"])
def test_at_the_terminal_the_answers_outlive_a_stop_and_a_result_goes_on(
    key: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments: dict[str, Any] = {"until": "queries:6", "seed": 2}
    monkeypatch.setattr("builtins.input", Typist(["l", "r", "e", key]))
    part = pt.train(WORLD, parent=pt.Person("terminal"), **arguments)
    assert [row["choice"] for row in part.answers] == ["left", "right", "either"]
    assert "Stopped after 3 answers" in capsys.readouterr().out
    monkeypatch.setattr("builtins.input", Typist(["l", "l", "l"]))
    whole = pt.train(WORLD, parent=pt.Person("terminal", after=part), **arguments)
    assert whole.answers[:3] == part.answers
    assert [row["choice"] for row in whole.answers[3:]] == ["left"] * 3
    assert whole.trials[0]["finished"] is True


def test_ctrl_c_between_two_questions_ends_at_the_next_tick(monkeypatch: pytest.MonkeyPatch) -> None:
    """A signal that comes while a tick computes must not leave half of it behind."""

    def interrupt(progress: pt.Progress) -> None:
        if progress.queries == 2:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr("builtins.input", Typist(["l"] * 4))
    before = signal.getsignal(signal.SIGINT)
    result = pt.train(
        WORLD, parent=pt.Person("terminal"), until="queries:4", callback=interrupt, p_guid=1.0, p_pref=0.0
    )
    assert len(result.answers) == 2
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"where": "kitchen"}, "where: 'kitchen'"),
        ({"where": "terminal", "data": "x"}, "belong to the page"),
        ({"after": object()}, "belongs to the terminal"),
        ({"run": 3}, r"run: say which data folder holds run 3"),
    ],
)
def test_what_does_not_go_together_is_told(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        pt.Person(**arguments)


def test_a_person_raises_one_agent_at_a_time() -> None:
    with pytest.raises(ValueError, match="trials: a person raises one agent"):
        pt.train(WORLD, parent=pt.Person("terminal"), trials=2)


def test_a_server_that_is_not_there_cannot_be_joined(tmp_path: Path) -> None:
    person = pt.Person(url="http://localhost:9", data=tmp_path)
    with pytest.raises(ValueError, match=r"url: no server with a worker answers at http://localhost:9"):
        pt.train(WORLD, parent=person)


@pytest.mark.slow
def test_a_server_of_another_data_folder_is_refused_before_a_run_is_stored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Run 1 of that server would be somebody else's."""
    from starlette.testclient import TestClient

    from parenting.server.app import create_app
    from parenting.server.identity import renew
    from parenting.server.runs import list_runs
    from parenting.server.settings import Settings
    from parenting.server.workers import sign
    from tests.database import migrated

    theirs, ours = (Settings(data=tmp_path / name, database_url=None) for name in ("theirs", "ours"))
    there, here = migrated(theirs), migrated(ours)
    renew(there)
    sign(there, "worker")
    with TestClient(create_app(theirs, there), base_url="http://localhost") as web:
        monkeypatch.setattr("parenting.library.page_server.httpx2.get", lambda url, **_: web.get(url))
        person = pt.Person(url="http://localhost:9", data=ours.data)
        with pytest.raises(ValueError, match=r"url: the server at .* has another database than the folder"):
            pt.train(WORLD, parent=person)
    assert list_runs(here) == []
    here.close()


def test_pages_may_be_framed_only_by_whom_the_settings_name(tmp_path: Path) -> None:
    from starlette.testclient import TestClient

    from parenting.server.app import create_app
    from parenting.server.db import connect
    from parenting.server.migrate import upgrade
    from parenting.server.settings import Settings

    for setting, expected in (("none", NOBODY), ("http://localhost:*", "frame-ancestors http://localhost:*")):
        settings = Settings(data=tmp_path, frame_ancestors=setting)
        db = connect(settings)
        upgrade(db)
        with TestClient(create_app(settings, db), base_url="http://localhost") as client:
            assert client.get("/").headers["Content-Security-Policy"].endswith(expected)


@pytest.mark.slow
@pytest.mark.faults
@pytest.mark.timeout(900)
def test_a_server_that_runs_already_is_joined_and_left_running(
    person_at_the_page: Callable[..., list[PersonAtPage]], tmp_path: Path
) -> None:
    """Takes long: it starts web, worker and Chromium."""
    person_at_the_page(3)
    with simulated_person.up(tmp_path) as url:
        person = pt.Person(url=url, data=tmp_path)
        # a worker signs some seconds after the pages are there
        simulated_person.until(lambda: is_ready(url), 60, "no worker")
        result = pt.train(WORLD, parent=person, until="queries:3", seed=3, p_guid=1.0, p_pref=0.0)
        assert is_ready(url)
    assert (len(result.answers), result.trials[0]["guidance"]) == (3, 3)
    assert result.trials[0]["finished"] is True
