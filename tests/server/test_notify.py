"""Notifications arrive at once and never block the sender."""

import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from parenting.server.notify import News, Notifier
from tests.tree import ROOT

LISTEN = """
import os, pathlib
os.getpid = lambda: 1
from parenting.server.notify import Notifier
notifier = Notifier(pathlib.Path({!r}), "worker")
notifier.listen()
print("listening", flush=True)
print(notifier.wait(5))
"""


@contextmanager
def listening(data: Path) -> Iterator[subprocess.Popen[str]]:
    """Process 1 of a container, once it listens as a worker does."""
    command = [sys.executable, "-c", LISTEN.format(str(data))]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "listening\n"
        yield child


def test_a_notification_wakes_at_once(tmp_path: Path) -> None:
    listener, sender = Notifier(tmp_path, "worker"), Notifier(tmp_path, "worker")
    listener.listen()
    threading.Timer(0.05, sender.notify).start()
    assert listener.wait(60), "it waited to the end"
    listener.close()


def test_silence_ends_at_the_timeout(tmp_path: Path) -> None:
    notifier = Notifier(tmp_path, "worker")
    assert not notifier.wait(0.01)
    assert not notifier.wait(-1)
    notifier.close()


def test_listeners_are_told_which_runs_have_news(tmp_path: Path) -> None:
    listener, sender = Notifier(tmp_path, "web"), Notifier(tmp_path, "web")
    listener.listen()
    assert listener.drain() == News(frozenset(), others=False)
    for run in (7, 2**63 - 1, 7):
        sender.notify(run)
    assert listener.drain() == News(frozenset({7, 2**63 - 1}), others=False)
    sender.notify(7)
    sender.notify()
    assert listener.drain() == News(frozenset({7}), others=True)
    listener.wake("8")
    assert listener.drain() == News(frozenset({8}), others=False)
    for word in ("", "a word of another version"):
        listener.wake(word)
        assert listener.drain() == News(frozenset(), others=True)
    listener.close()


def test_where_some_may_be_lost_others_may_have_news(tmp_path: Path) -> None:
    listener, sender = Notifier(tmp_path, "web"), Notifier(tmp_path, "web")
    listener.listen()
    for run in range(1, 1001):
        sender.notify(run)
    assert listener.drain().others, "a socket keeps few of them"
    listener.close()


def test_many_notifications_wake_once(tmp_path: Path) -> None:
    notifier = Notifier(tmp_path, "worker")
    notifier.listen()
    for _ in range(1000):
        notifier.notify()
    assert notifier.wait(1)
    assert not notifier.wait(0)
    notifier.close()


def test_everyone_who_listens_hears_and_channels_are_apart(tmp_path: Path) -> None:
    first, second, other = (
        Notifier(tmp_path, "worker"),
        Notifier(tmp_path, "worker"),
        Notifier(tmp_path, "web"),
    )
    for notifier in (first, second, other):
        notifier.listen()
    Notifier(tmp_path, "worker").notify()
    assert first.wait(1)
    assert second.wait(1)
    assert not other.wait(0)
    for notifier in (first, second, other):
        notifier.close()


@pytest.mark.slow
def test_processes_of_two_containers_hear_both(tmp_path: Path) -> None:
    """Each is process 1 in its container, and they share the folder."""
    with listening(tmp_path) as first, listening(tmp_path) as second:
        Notifier(tmp_path, "worker").notify()
        assert [child.communicate()[0] for child in (first, second)] == ["True\n", "True\n"]


def test_nobody_listens(tmp_path: Path) -> None:
    Notifier(tmp_path, "worker").notify()
    assert list(tmp_path.iterdir()) == []


def test_socket_of_a_dead_process_is_removed(tmp_path: Path) -> None:
    dead = Notifier(tmp_path, "worker")
    dead.listen().close()  # as SIGKILL leaves it: the file without the socket
    assert list(dead.folder.iterdir())
    Notifier(tmp_path, "worker").notify()
    assert list(dead.folder.iterdir()) == []


def test_long_folder_names_are_no_obstacle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with tempfile.TemporaryDirectory() as short:  # pytest's own folder may be too long for a socket as well
        monkeypatch.setattr("parenting.server.notify.tempfile.gettempdir", lambda: short)
        deep = tmp_path / ("x" * 120)
        notifier = Notifier(deep, "worker")
        notifier.listen()
        Notifier(deep, "worker").notify()
        assert notifier.wait(1)
        notifier.close()


def test_the_last_listener_leaves_nothing_in_the_temporary_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with tempfile.TemporaryDirectory() as short:
        monkeypatch.setattr("parenting.server.notify.tempfile.gettempdir", lambda: short)
        deep = tmp_path / ("x" * 120)
        web, worker = Notifier(deep, "web"), Notifier(deep, "worker")
        web.listen()
        worker.listen()
        web.close()
        Notifier(deep, "worker").notify()
        assert worker.wait(1), "a folder went that is still needed"
        worker.close()
        assert list(Path(short).iterdir()) == []


def test_a_folder_that_goes_before_the_socket_is_bound(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The last listener before this one closes just then."""
    listener, made = Notifier(tmp_path, "worker"), Path.mkdir
    listener.folder.parent.mkdir()

    def slow(path: Path, *given: Any, **named: Any) -> None:
        made(path, *given, **named)
        monkeypatch.undo()
        path.rmdir()

    monkeypatch.setattr(Path, "mkdir", slow)
    listener.listen()
    Notifier(tmp_path, "worker").notify()
    assert listener.wait(5)
    listener.close()


def test_a_folder_that_cannot_be_written_costs_the_hint_alone(tmp_path: Path) -> None:
    """The listener waits as long as it was told to, and hears again once the folder is back."""
    (tmp_path / "sockets").write_text("in the way")
    listener, sender = Notifier(tmp_path, "worker"), Notifier(tmp_path, "worker")
    assert not listener.wait(0.01)
    sender.notify()
    listener.wake()
    listener.close()
    (tmp_path / "sockets").unlink()
    assert not listener.wait(0.01)
    sender.notify()
    assert listener.wait(5)
    listener.close()


def test_another_thread_wakes_its_own_process(tmp_path: Path) -> None:
    listener = Notifier(tmp_path, "worker")
    listener.listen()
    threading.Timer(0.05, listener.wake).start()
    assert listener.wait(5)
    listener.close()
