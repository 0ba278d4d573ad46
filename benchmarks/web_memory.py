"""The memory of the web process under a steady load, and which lines of code hold what grows.

    python -m benchmarks.web_memory                30 minutes of 50 requests a second
    python -m benchmarks.web_memory --minutes 5    a shorter look
    python -m benchmarks.web_memory --trace        the same with tracemalloc, which is slow and large itself

Web and worker serve a run in a temporary folder. The load is the same mix all the time: pages, lists, static
files, metrics, health checks, refused requests, a question leased and answered, and live streams that come
and go. A crowd comes first, since a thread that starts later for a busy moment would look like growth.
Some rows are added meanwhile, one answer a second, as a busy parent gives them.

A line is printed each minute with the resident memory of the web process. The growth that counts is the one
from minute 5 on: before, caches fill. With `--trace` the last lines name the places whose live memory grew
most between minute 5 and the end. Resident memory also holds what was freed and not given back.
"""

from __future__ import annotations

import argparse
import os
import signal
import ssl
import subprocess
import sys
import tempfile
import threading
import time
import tracemalloc
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import IO

import httpx2

from tests.server.serving import free_port, parenting, until_up

WARM_MINUTES = 5
TLS = ssl.create_default_context()
"""Unused, but each client would read all certificates again, which costs more than its requests."""
CLIENT, CLIENTS = "benchmark", 8
CROWD = 64
FRAMES = 6
SECONDS_TO_START = 300.0
TOP = 25
PATHS = (
    "/",
    "/runs/1",
    "/runs/1/parent",
    "/runs/1/stages",
    "/runs/1/history",
    "/api/v1/runs",
    "/api/v1/runs/1",
    "/api/v1/runs/1/queries?limit=20",
    "/api/v1/runs/1/metrics?limit=50",
    "/static/parent.js",
    "/healthz",
    "/readyz",
    "/metrics",
    "/api/v1/runs/999",
    "/nothing/here",
    "/api/v1/runs/one",
)
"""Read in turn; the last ones are refused."""


def serve(port: int, folder: Path) -> None:
    """Serve with tracemalloc; each SIGUSR1 writes a snapshot of what is held."""
    from parenting.server.listener import bind
    from parenting.server.serve import make_server
    from parenting.server.settings import Settings

    numbers = count(1)
    signal.signal(
        signal.SIGUSR1,
        lambda *_: tracemalloc.take_snapshot().dump(str(folder / f"snapshot-{next(numbers)}")),
    )
    chosen = Settings(port=port)
    server = make_server(chosen)
    tracemalloc.start(FRAMES)  # only now: it makes the imports several times as slow
    server.run(sockets=[bind(chosen)])


@contextmanager
def served(*arguments: str, folder: Path) -> Iterator[subprocess.Popen[str]]:
    """Run `parenting ...` as a process whose output is read all the time: a full pipe would stop it."""
    with parenting(*arguments, data=folder) as child:
        pipes = [pipe for pipe in (child.stdout, child.stderr) if pipe is not None]
        readers = [threading.Thread(target=drain, args=(pipe,)) for pipe in pipes]
        for reader in readers:
            reader.start()
        try:
            yield child
        finally:
            child.kill()
            for reader in readers:
                reader.join()


def drain(pipe: IO[str]) -> None:
    """Pass what a process says on to standard error, to its end."""
    for line in pipe:
        sys.stderr.write(line)


@contextmanager
def traced(port: int, folder: Path) -> Iterator[subprocess.Popen[str]]:
    """Run `serve` as a process."""
    command = [sys.executable, "-m", "benchmarks.web_memory", "--serve", str(port), "--folder", str(folder)]
    child = subprocess.Popen(command, env={**os.environ, "PARENTING_DATA": str(folder)}, text=True)
    try:
        yield child
    finally:
        child.kill()
        child.wait()


def resident(pid: int) -> float:
    """Return the resident memory of a process in MB."""
    fields = Path(f"/proc/{pid}/statm").read_text().split()
    return int(fields[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def load(url: str, minutes: float, rate: float, each_minute: Callable[[int], None]) -> int:
    """Send the mix at this rate in all from a few threads; return the number of requests."""
    end = time.monotonic() + 60 * minutes
    with ThreadPoolExecutor(CLIENTS) as threads:
        sent = [threads.submit(client, url, number, end, rate / CLIENTS) for number in range(CLIENTS)]
        for minute in range(int(minutes)):
            each_minute(minute)
            time.sleep(max(0.0, end - 60 * (minutes - minute - 1) - time.monotonic()))
        each_minute(int(minutes))
        return sum(one.result() for one in sent)


def client(url: str, number: int, end: float, rate: float) -> int:
    """Send one client's part; every other client opens a connection for each request, as scripts do."""
    kept = number % 2 == 0
    web, sent, began = httpx2.Client(base_url=url, timeout=30, verify=TLS), 0, time.monotonic()
    while (now := time.monotonic()) < end:
        time.sleep(max(0.0, began + sent / rate - now))
        sent += 1
        if not kept:
            web.close()
            web = httpx2.Client(base_url=url, timeout=30, verify=TLS)
        with suppress(httpx2.TransportError):
            if sent % 50 == 0:
                answer(web, f"{CLIENT}-{number}-{sent}")
            elif sent % 50 == 25:
                look_at_stream(web)
            else:
                web.get(PATHS[(sent + number) % len(PATHS)])
    return sent


def answer(web: httpx2.Client, name: str) -> None:
    """Lease the next question and answer it, where there is one."""
    leased = web.post("/api/v1/runs/1/queries/lease", json={"client_id": name})
    if leased.status_code == 200:
        body = {"choice": "left", "client_id": name}
        web.post(f"/api/v1/queries/{leased.json()['id']}/answer", json=body)


def crowd(url: str) -> None:
    """Ask for much at once, so that all threads and their connections are there before it counts."""
    with ThreadPoolExecutor(CROWD) as threads, httpx2.Client(base_url=url, timeout=30, verify=TLS) as web:
        for _ in range(4):
            list(threads.map(web.get, CROWD // 2 * ("/runs/1/history", "/")))


def look_at_stream(web: httpx2.Client) -> None:
    """Open a live stream and leave it after the first event."""
    with web.stream("GET", "/api/v1/runs/1/events") as reply:
        next(reply.iter_lines())


def report(folder: Path) -> None:
    """Print the places whose live memory grew most between the two snapshots."""
    one, two = (tracemalloc.Snapshot.load(str(folder / f"snapshot-{number}")) for number in (1, 2))
    print("live memory that grew most, by place")
    for line in two.compare_to(one, "lineno")[:TOP]:
        print(f"  {line.size_diff / 1e3:9.1f} kB {line.count_diff:8} blocks  {line.traceback}")
    print("by way of")
    for line in two.compare_to(one, "traceback")[:5]:
        print(f"  {line.size_diff / 1e3:9.1f} kB\n    " + "\n    ".join(line.traceback.format()))


def measure(minutes: float, rate: float, trace: bool) -> None:
    """Start web and worker, send the load and print what the web process holds."""
    with tempfile.TemporaryDirectory() as name:
        folder, port = Path(name), free_port()
        with parenting("migrate", data=folder) as made:
            made.wait()
        started = traced(port, folder) if trace else served("web", "--port", str(port), folder=folder)
        with started as web, served("worker", folder=folder):
            url = f"http://localhost:{port}"
            until_up(url, SECONDS_TO_START)
            body = {"world": "unsafe-exploration"}
            httpx2.post(f"{url}/api/v1/runs", json=body, timeout=30).raise_for_status()
            crowd(url)
            seen: list[float] = []

            def look(minute: int) -> None:
                seen.append(resident(web.pid))
                print(f"minute {minute:3}  {seen[-1]:7.1f} MB", flush=True)
                if trace and minute == min(WARM_MINUTES, int(minutes) - 1):
                    web.send_signal(signal.SIGUSR1)

            sent = load(url, minutes, rate, look)
            warm = seen[min(WARM_MINUTES, len(seen) - 2)]
            print(f"{sent} requests in {minutes:g} minutes; growth since minute {WARM_MINUTES}: ", end="")
            print(f"{seen[-1] - warm:+.1f} MB")
            if trace:
                web.send_signal(signal.SIGUSR1)
                while not (folder / "snapshot-2").exists():
                    time.sleep(0.2)
                time.sleep(5)  # until it is whole
                report(folder)


def main() -> None:
    """Read the options."""
    parser = argparse.ArgumentParser(description="The web process's memory under a steady load.")
    parser.add_argument("--minutes", type=float, default=30)
    parser.add_argument("--rate", type=float, default=50)
    parser.add_argument("--trace", action="store_true")
    parser.add_argument("--serve", type=int, metavar="PORT", help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.serve:
        serve(chosen.serve, chosen.folder)
    else:
        measure(chosen.minutes, chosen.rate, chosen.trace)


if __name__ == "__main__":
    main()
