"""A flood of equal refusals is one line a second in the log."""

from typing import Any

from parenting.server.log_limit import LogLimit


def test_one_line_a_second_says_how_many_were_left_out() -> None:
    now, lines = 0.0, []

    def write(event: str, **fields: Any) -> None:
        lines.append((event, fields))

    limit = LogLimit(clock=lambda: now)
    for _ in range(100):
        limit.say("busy", write, "refused", path="/")
    limit.say("disk_full", write, "refused", path="/")  # another key has a line of its own
    now = 1.0
    limit.say("busy", write, "refused", path="/")
    assert lines == [
        ("refused", {"path": "/"}),
        ("refused", {"path": "/"}),
        ("refused", {"path": "/", "repeated": 99}),
    ]
