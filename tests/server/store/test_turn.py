"""The turn to write between processes: one holds it, others get it soon, and nobody depends on it."""

import threading
import time
from pathlib import Path

import pytest

from parenting.server.store import turn
from parenting.server.store.patience import patience
from parenting.server.store.turn import Turn

pytestmark = pytest.mark.only("sqlite", "PostgreSQL has no such turn")


def test_one_has_it_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(turn, "MOST_SECONDS", 0.0)
    mine, theirs = Turn(tmp_path), Turn(tmp_path)  # each opens the folder by itself, as processes do
    assert mine.take()
    assert not theirs.take()
    mine.give_back()
    assert theirs.take()
    theirs.close()
    assert mine.take(), "a turn ends with the process that has it, or with its handle"
    mine.close()


def test_who_waits_gets_it_once_it_is_free(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(turn, "MOST_SECONDS", 60.0)
    mine, theirs = Turn(tmp_path), Turn(tmp_path)
    assert mine.take()
    got = list[bool]()
    waiting = threading.Thread(target=lambda: got.append(theirs.take()))
    waiting.start()
    mine.give_back()
    waiting.join(30)
    assert got == [True]
    mine.close()
    theirs.close()


def test_nobody_waits_for_it_longer_than_he_may(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The holder may be a process that was stopped."""
    monkeypatch.setattr(turn, "MOST_SECONDS", 60.0)
    mine, theirs = Turn(tmp_path), Turn(tmp_path)
    assert mine.take()
    began = time.monotonic()
    with patience(0.01):
        assert not theirs.take()
    assert time.monotonic() - began < 30
    mine.close()
    theirs.close()


def test_who_has_just_had_it_lets_those_who_wait_go_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(turn, "MOST_SECONDS", 60.0)
    monkeypatch.setattr(turn, "POLITE_SECONDS", 60.0)
    (tmp_path / turn.WAITING).mkdir()
    mine, theirs = Turn(tmp_path), Turn(tmp_path)
    assert mine.take()
    got = list[str]()

    def wait() -> None:
        theirs.take()
        got.append("theirs")
        theirs.give_back()

    waiting = threading.Thread(target=wait)
    waiting.start()
    while not mine._others_wait():
        time.sleep(0.001)
    mine.give_back()
    assert mine.take()
    got.append("mine")
    waiting.join(30)
    assert got == ["theirs", "mine"]
    mine.close()
    theirs.close()


def test_without_a_folder_all_go_on(tmp_path: Path) -> None:
    for folder in (None, tmp_path / "gone"):
        one = Turn(folder)
        assert not one.take()
        one.give_back()
        one.close()
