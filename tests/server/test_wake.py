"""Bells: heard at once, never in the way."""

import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from parenting.server.wake import Bell
from tests.tree import ROOT

LISTEN = """
import os, pathlib
os.getpid = lambda: 1
from parenting.server.wake import Bell
bell = Bell(pathlib.Path({!r}), "worker")
bell.listen()
print("listening", flush=True)
print(bell.wait(5))
"""


@contextmanager
def listening(data: Path) -> Iterator[subprocess.Popen[str]]:
    """Process 1 of a container, once it listens to the bell of a worker."""
    command = [sys.executable, "-c", LISTEN.format(str(data))]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "listening\n"
        yield child


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


def test_processes_of_two_containers_hear_both(tmp_path: Path) -> None:
    """Each is process 1 in its container, and they share the folder."""
    with listening(tmp_path) as first, listening(tmp_path) as second:
        Bell(tmp_path, "worker").ring()
        assert [child.communicate()[0] for child in (first, second)] == ["True\n", "True\n"]


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
        monkeypatch.setattr("parenting.server.wake.tempfile.gettempdir", lambda: short)
        deep = tmp_path / ("x" * 120)
        bell = Bell(deep, "worker")
        bell.listen()
        Bell(deep, "worker").ring()
        assert bell.wait(1)
        bell.close()
