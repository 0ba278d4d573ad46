"""The commands of docker-compose.yml, as processes of this machine: what can be tested without Docker."""

import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest

from tests.server.serving import free_port
from tests.services import Stack

SECONDS_TO_STOP = 5
OWN_NETWORK = ["unshare", "--user", "--map-root-user", "--net", "--"]
LOOPBACK_UP = """
import fcntl, os, socket, struct, sys
with socket.socket() as any_socket:
    fcntl.ioctl(any_socket, 0x8914, struct.pack("16sh14x", b"lo", 1))  # SIOCSIFFLAGS, IFF_UP
os.execvp(sys.argv[1], sys.argv[1:])
"""
ASK = """
import sys, urllib.request
for host in sys.argv[1:]:
    request = urllib.request.Request("http://127.0.0.2:8765/healthz", headers={"Host": host})
    try:
        print(urllib.request.urlopen(request, timeout=5).status)
    except urllib.error.HTTPError as error:
        print(error.code)
"""


@pytest.fixture
def stack(tmp_path: Path) -> Stack:
    """On loopback: this machine's network is not a container's own."""
    return Stack(tmp_path, PARENTING_PORT=str(free_port()), PARENTING_HOST="127.0.0.1")


def migrate(stack: Stack) -> None:
    with stack.service("migrate") as child:
        assert child.wait(60) == 0


@pytest.fixture
def running(stack: Stack) -> Iterator[dict[str, subprocess.Popen[bytes]]]:
    """Web and worker, both healthy."""
    migrate(stack)
    with stack.service("web") as web, stack.service("worker") as worker:
        for name in ("web", "worker"):
            stack.until_healthy(name)
        yield {"web": web, "worker": worker}


def stop(child: subprocess.Popen[bytes]) -> int:
    child.send_signal(signal.SIGTERM)
    return child.wait(SECONDS_TO_STOP)


def until_raised(run: str, answers: int) -> dict[str, Any]:
    """Wait until the agent has had so many answers."""
    end = time.monotonic() + 60
    while True:
        seen: dict[str, Any] = httpx2.get(run).json()
        if seen["answers"] >= answers:
            return seen
        assert time.monotonic() < end, f"the run does not go on: {seen}"
        time.sleep(0.1)


@pytest.mark.slow
@pytest.mark.faults
@pytest.mark.timeout(900)
def test_the_services_raise_an_agent_and_stop(
    stack: Stack, running: dict[str, subprocess.Popen[bytes]]
) -> None:
    runs = f"http://127.0.0.1:{stack.instead['PARENTING_PORT']}/api/v1/runs"
    made = httpx2.post(runs, json={"world": "unsafe-exploration", "parent": "scripted"})
    assert made.status_code == 201
    before = until_raised(f"{runs}/{made.json()['id']}", answers=2)
    after = until_raised(f"{runs}/{made.json()['id']}", answers=before["answers"] + 2)
    assert after["tick"] > 0
    assert (stack.check("web"), stack.check("worker")) == (0, 0)

    assert stop(running["worker"]) == 0
    assert (stack.check("web"), stack.check("worker")) == (0, 1)
    assert stop(running["web"]) in (0, -signal.SIGTERM)  # uvicorn ends by the signal that it heard
    assert stack.check("web") != 0
    assert not list(stack.data.glob("sockets/*/*")), "every socket is taken away"


@pytest.mark.slow
def test_in_a_network_of_its_own_the_web_runs_as_it_stands(tmp_path: Path) -> None:
    """Its environment unchanged, in a network namespace as a container has one: nobody else is on it."""
    if (
        shutil.which("unshare") is None
        or subprocess.run([*OWN_NETWORK, "true"], capture_output=True).returncode
    ):
        pytest.skip("this system lets nobody make a network namespace")
    stack = Stack(tmp_path)
    migrate(stack)
    with stack.service("web", before=[*OWN_NETWORK, sys.executable, "-c", LOOPBACK_UP]) as web:
        inside = ["nsenter", "--target", str(web.pid), "--user", "--net", "--preserve-credentials", "--"]
        stack.until_healthy("web", before=inside)
        asked = [*inside, sys.executable, "-c", ASK, "localhost:8765", "evil.example"]
        said = subprocess.run(asked, capture_output=True, text=True, check=True).stdout.split()
        assert said == ["200", "400"], (
            "it listens on more than 127.0.0.1, and refuses unknown hosts there too"
        )
        stop(web)
