"""SIGTERM and Ctrl-C stop web and worker with a tab open, in order; none of them is left behind."""

import os
import re
import signal
import socket
import sqlite3
import subprocess
import time
from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path

import pytest

from parenting.server.db import connect
from parenting.server.new_run import NewRun, start
from parenting.server.settings import Settings
from tests.database import migrated
from tests.server.processes import Command
from tests.server.serving import Stream, free_port, parenting, until_up

SIGNALS = [signal.SIGINT, signal.SIGTERM]


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A migrated database with one run that nobody has to raise: it is paused."""
    db = migrated(Settings(data=tmp_path, database_url=None))
    start(db, NewRun(world="unsafe-exploration"))
    db.close()
    return tmp_path


def tab(url: str) -> Stream:
    stream = Stream(f"{url}/api/v1/runs/1/events?after=-1")
    stream.wait_for("run", seconds=30)
    return stream


def stop(child: subprocess.Popen[str], number: signal.Signals) -> None:
    """Send the signal, and wait until the process is gone."""
    os.kill(child.pid, number)
    child.wait(60)


@pytest.mark.slow
@pytest.mark.parametrize("number", SIGNALS)
def test_web_stops_with_a_tab_open(data: Path, number: signal.Signals) -> None:
    port = free_port()
    with parenting("web", "--port", str(port), data=data) as web:
        until_up(url := f"http://127.0.0.1:{port}")
        stream = tab(url)
        stop(web, number)
        assert stream.ended.wait(30)
        told, said = web.communicate()
        assert not said, "the stream ended by itself; uvicorn had not to cut it off"
        assert "parenting access open" in told


@pytest.mark.slow
def test_a_request_that_is_still_sent_at_the_end_is_told_to_come_again(data: Path) -> None:
    """The second that it takes is the one that open requests have after the signal."""
    port = free_port()
    with parenting("web", "--port", str(port), data=data) as web:
        until_up(f"http://127.0.0.1:{port}")
        with socket.create_connection(("127.0.0.1", port)) as slow:
            head = "POST /open HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n"
            slow.sendall(f"{head}Content-Type: application/x-www-form-urlencoded\r\n\r\nabc".encode())
            time.sleep(0.2)  # the head is read
            stop(web, signal.SIGTERM)
            reply = slow.recv(4096).decode()
        said = web.communicate()[1]
    assert reply.startswith("HTTP/1.1 503")
    assert '"stopping"' in reply
    assert "Traceback" not in said
    assert "[error" not in said


@pytest.mark.slow
@pytest.mark.parametrize("number", SIGNALS)
def test_up_stops_both_with_a_tab_open(tmp_path: Path, number: signal.Signals) -> None:
    with parenting("up", "--port", "0", "--no-browser", data=tmp_path) as up:
        assert up.stdout is not None
        url = re.findall(r"http://localhost:\d+", up.stdout.readline())[0]
        until_up(url)
        db = connect(Settings(data=tmp_path, database_url=None))
        start(db, NewRun(world="unsafe-exploration"))
        db.close()
        stream = tab(url)
        children = processes_of(up.pid)
        assert len(children) == 2
        stop(up, number)
        assert up.returncode == 0
        assert stream.ended.wait(30)
        assert not any(alive(child) for child in children)
        assert "Traceback" not in up.communicate()[1]


@pytest.mark.slow
@pytest.mark.faults
def test_up_starts_again_what_dies_and_the_pages_stay(tmp_path: Path) -> None:
    """Both are killed; the address that was printed answers again, and a signal still stops everything."""
    with parenting("up", "--port", "0", "--no-browser", data=tmp_path) as up:
        assert up.stdout is not None
        until_up(url := re.findall(r"http://localhost:\d+", up.stdout.readline())[0])
        before = processes_of(up.pid)
        os.kill(before[1], signal.SIGKILL)  # the worker
        until_up(url)
        os.kill(before[0], signal.SIGKILL)
        until(lambda: len(set(processes_of(up.pid)) - set(before)) == 2)
        until_up(url)
        children = processes_of(up.pid)
        stop(up, signal.SIGTERM)
        said = up.communicate()[1]
        assert up.returncode == 0
        for name in ("worker", "web"):
            died = f"The {name} process ended by itself (killed by SIGKILL); it starts again in 0.5 s.\n"
            assert said.count(died) == 1
        assert not any(alive(child) for child in children)


@pytest.mark.slow
def test_up_ends_with_the_sentence_of_a_wrong_setting(tmp_path: Path) -> None:
    with parenting("up", "--port", "0", "--no-browser", data=tmp_path, PARENTING_TRACKERS="none") as up:
        _, said = up.communicate(timeout=60)
    assert up.returncode == 2
    assert "'none' is not a tracker." in said
    assert "process cannot work like this, so all was stopped." in said
    assert "starts again" not in said


@pytest.mark.slow
def test_web_and_worker_do_not_outlive_up(tmp_path: Path) -> None:
    with parenting("up", "--port", "0", "--no-browser", data=tmp_path) as up:
        assert up.stdout is not None
        until_up(re.findall(r"http://localhost:\d+", up.stdout.readline())[0])
        children = processes_of(up.pid)
        os.kill(up.pid, signal.SIGKILL)
        until(lambda: not any(alive(child) for child in children))


def said(*arguments: str, data: Path, code: int = 2, environment: Mapping[str, str] | None = None) -> str:
    """Return the output of a command that ends by itself; it is a fork of a program that has loaded all."""
    ended = Command(*arguments, data=data, environment=environment)
    assert ended.wait(60) == code, ended.said()
    return ended.said()


@pytest.mark.slow
@pytest.mark.parametrize("command", ["up", "web"])
def test_port_in_use_is_told_in_a_sentence(data: Path, command: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        told = said(command, "--port", str(port), data=data)
    assert told == (
        f"port: {port} cannot be used (Address already in use). Name another one, or 0 for any free one.\n"
    )


@pytest.mark.slow
def test_a_log_folder_that_cannot_be_is_told_before_the_address(data: Path) -> None:
    told = said("up", "--port", "0", data=data, environment={"PARENTING_LOG_FOLDER": "/proc/x"})
    assert re.fullmatch(
        r"PARENTING_LOG_FOLDER: /proc/x cannot be written to: .*\. Name another folder\.\n", told
    )


@pytest.mark.parametrize("command", ["web", "worker"])
def test_unmigrated_database_is_refused_in_a_sentence(tmp_path: Path, command: str) -> None:
    with closing(sqlite3.connect(tmp_path / "parenting.db")) as connection:
        connection.execute("CREATE TABLE another (number INTEGER)")
    told = said(command, data=tmp_path)
    assert told.endswith("has no tables yet. Run: `parenting migrate`\n")
    assert told.count("\n") == 1


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("PARENTING_PORT", "99999", "PARENTING_PORT: "),
        ("PARENTING_HOST", "0.0.0.0", "host: 0.0.0.0 would let others in"),
        ("PARENTING_LOG_LEVEL", "loud", "log_level: loud is not one of"),
        (
            "PARENTING_LANGUAGES",
            "/nowhere",
            "PARENTING_LANGUAGES: '/nowhere' is wrong: there is no such folder",
        ),
    ],
)
def test_wrong_setting_is_told_in_a_sentence(data: Path, name: str, value: str, told: str) -> None:
    found = said("web", data=data, environment={name: value})
    assert told in found
    assert "Traceback" not in found


def test_a_wrong_option_is_named_as_it_was_given(data: Path) -> None:
    told = said("up", "--port", "99999", data=data)
    assert told.startswith("--port: '99999' is wrong: ")
    assert "PARENTING_PORT" not in told


def test_migrate_twice(tmp_path: Path) -> None:
    told = [said("migrate", data=tmp_path, code=0) for _ in range(2)]
    assert told == ["The database is up to date now.\n", "The database was up to date.\n"]


def until(met: Callable[[], bool]) -> None:
    """Wait until something holds."""
    end = time.monotonic() + 60
    while not met():
        assert time.monotonic() < end, "it did not come to pass"
        time.sleep(0.05)


def processes_of(parent: int) -> list[int]:
    """The processes that this one started, oldest first."""
    return sorted(map(int, Path(f"/proc/{parent}/task/{parent}/children").read_text().split()))


def alive(process: int) -> bool:
    """Return True if a process still runs; one that waits to be reaped does not."""
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"
