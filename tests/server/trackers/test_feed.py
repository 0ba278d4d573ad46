"""The feed of trackers: no tracker stops or slows who feeds it; steps grow; losses are counted and said."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import pytest
from structlog.testing import capture_logs

from parenting.server.trackers import feed as feeds
from parenting.server.trackers.choosing import UnknownTrackerError, tracker
from parenting.server.trackers.choosing import feeds as feeds_of
from parenting.server.trackers.feed import Feed
from parenting.server.trackers.tracker import TrackedRun, Values

RUN = TrackedRun("abc", "first", "unsafe-exploration", "island", 3, {"p_guid": 0.5})


class Recorded:
    """Keeps what it is told."""

    def __init__(self) -> None:
        self.told: list[tuple[Any, ...]] = []

    def begin(self, run: TrackedRun) -> None:
        self.told.append(("begin", run.id))

    def log(self, run: str, step: int, values: Values) -> None:
        self.told.append((run, step, dict(values)))

    def end(self, run: str, reason: str) -> None:
        self.told.append(("end", run, reason))


class Hanging(Recorded):
    """Hangs at its first row until it is let go."""

    def __init__(self) -> None:
        super().__init__()
        self.free, self.hangs = threading.Event(), threading.Event()

    def log(self, run: str, step: int, values: Values) -> None:
        self.hangs.set()
        self.free.wait(20)
        super().log(run, step, values)


class Raising(Recorded):
    """Raises whatever it is told, even what ends a process."""

    def log(self, run: str, step: int, values: Values) -> None:
        raise SystemExit("no room")


@pytest.fixture
def hanging() -> Iterator[Hanging]:
    one = Hanging()
    yield one
    one.free.set()


def test_everything_is_told_in_order_and_steps_only_grow() -> None:
    recorded = Recorded()
    feed = Feed(recorded)
    feed.begin(RUN, after=4)
    for step in (3, 4, 5, 7, 6, 7, 8):  # replayed ticks among them
        feed.log("abc", step, {"deaths": step})
    feed.end("abc", "finished")
    assert feed.close(10)
    steps = [(run, step) for run, step, _ in recorded.told[1:-1]]
    assert steps == [("abc", 5), ("abc", 7), ("abc", 8)]
    assert (recorded.told[0], recorded.told[-1]) == (("begin", "abc"), ("end", "abc", "finished"))
    assert (feed.dropped, feed.failed) == (0, 0)


def test_a_hanging_tracker_holds_nobody_up_and_its_losses_are_said(
    hanging: Hanging, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(feeds, "MOST_ROWS", 3)
    with capture_logs() as said:
        feed = Feed(hanging)
        feed.begin(RUN)
        feed.log("abc", 0, {})
        assert hanging.hangs.wait(10)
        for step in range(1, 9):
            feed.log("abc", step, {})
        feed.end("abc", "stopped")
        assert feed.close(0) is False
    assert feed.dropped == 5
    assert [line["event"] for line in said] == [
        "a tracker is too slow; rows of metrics are dropped",
        "a tracker was not told everything",
    ]
    assert said[1]["dropped"] == 5 + 3  # the rest waits, and nobody waits for it
    hanging.free.set()
    assert feed.close(10)
    assert hanging.told[-1] == ("end", "abc", "stopped")


def test_what_a_tracker_raises_is_counted_and_said_once() -> None:
    raising = Raising()
    with capture_logs() as said:
        feed = Feed(raising)
        feed.begin(RUN)
        for step in range(4):
            feed.log("abc", step, {})
        feed.end("abc", "finished")
        assert feed.close(10)
    assert raising.told == [("begin", "abc"), ("end", "abc", "finished")]
    assert feed.failed == 4
    assert [line["event"] for line in said] == [
        "a tracker failed; the run goes on",
        "a tracker was not told everything",
    ]
    assert "no room" in said[0]["error"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("csv", "is not a tracker. Write csv:FOLDER"),
        ("no_such_module:it", "cannot be loaded"),
        ("json:nothing_there", "cannot be made"),
        ("json:dumps", "cannot be made"),
        ("json:decoder", "needs the methods begin, log and end"),
    ],
)
def test_what_is_no_tracker_is_refused(text: str, words: str) -> None:
    with pytest.raises(UnknownTrackerError, match=words):
        tracker(text)


def test_a_tracker_of_ones_own_is_given_or_named() -> None:
    assert isinstance(tracker(f"{__name__}:Recorded"), Recorded)
    assert [feed.name for feed in feeds_of([Recorded()]).feeds] == ["Recorded"]
    with pytest.raises(UnknownTrackerError, match="needs the methods"):
        feeds_of([Recorded])  # type: ignore[list-item]  # the class instead of one of it
