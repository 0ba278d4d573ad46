"""Bells: heard at once, never in the way."""

import tempfile
import threading
import time
from pathlib import Path

import pytest

from server.wake import Bell


def test_ring_wakes_at_once(tmp_path: Path) -> None:
    ear, hand = Bell(tmp_path, "worker"), Bell(tmp_path, "worker")
    ear.listen()
    threading.Timer(0.05, hand.ring).start()
    began = time.monotonic()
    assert ear.wait(5)
    assert time.monotonic() - began < 1
    ear.close()


def test_silence_ends_at_the_timeout(tmp_path: Path) -> None:
    bell = Bell(tmp_path, "worker")
    assert not bell.wait(0.01)
    assert not bell.wait(-1)
    bell.close()


def test_many_rings_wake_once(tmp_path: Path) -> None:
    bell = Bell(tmp_path, "worker")
    bell.listen()
    for _ in range(1000):
        bell.ring()
    assert bell.wait(1)
    assert not bell.wait(0)
    bell.close()


def test_everyone_who_listens_hears_and_bells_are_apart(tmp_path: Path) -> None:
    first, second, other = Bell(tmp_path, "worker"), Bell(tmp_path, "worker"), Bell(tmp_path, "web")
    for bell in (first, second, other):
        bell.listen()
    Bell(tmp_path, "worker").ring()
    assert first.wait(1)
    assert second.wait(1)
    assert not other.wait(0)
    for bell in (first, second, other):
        bell.close()


def test_nobody_listens(tmp_path: Path) -> None:
    Bell(tmp_path, "worker").ring()
    assert list(tmp_path.iterdir()) == []


def test_socket_of_a_dead_process_is_removed(tmp_path: Path) -> None:
    dead = Bell(tmp_path, "worker")
    dead.listen().close()  # as SIGKILL leaves it: the file without the socket
    assert list(dead.folder.iterdir())
    Bell(tmp_path, "worker").ring()
    assert list(dead.folder.iterdir()) == []


def test_long_folder_names_are_no_obstacle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with tempfile.TemporaryDirectory() as short:  # pytest's own folder may be too long for a socket as well
        monkeypatch.setattr("server.wake.tempfile.gettempdir", lambda: short)
        deep = tmp_path / ("x" * 120)
        bell = Bell(deep, "worker")
        bell.listen()
        Bell(deep, "worker").ring()
        assert bell.wait(1)
        bell.close()
