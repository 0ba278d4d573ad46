"""Writers of trackers: CSV, JSON lines, TensorBoard, and whatever has the shape of wandb."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from parenting.server.trackers.choosing import tracker
from parenting.server.trackers.services import WandbTracker
from parenting.server.trackers.tracker import TrackedRun, Tracker

RUN = TrackedRun("abc", "first", "unsafe-exploration", "island", 3, {"p_guid": 0.5})


def told(one: Tracker) -> None:
    """A life of two rows, then the same run is gone on with."""
    one.begin(RUN)
    one.log("abc", 2, {"deaths": 0, "loss": None})
    one.end("abc", "The worker ended.")
    one.begin(RUN)
    one.log("abc", 7, {"deaths": 1, "loss": 0.25})
    one.end("abc", "finished")


def test_a_table_has_a_number_a_line(tmp_path: Path) -> None:
    told(tracker(f"csv:{tmp_path / 'deep' / 'curves'}"))
    with (tmp_path / "deep" / "curves" / "abc.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [tuple(row.values()) for row in rows] == [
        ("2", "deaths", "0"),
        ("7", "deaths", "1"),
        ("7", "loss", "0.25"),
    ]


def test_json_lines_have_the_run_its_metrics_and_its_end(tmp_path: Path) -> None:
    told(tracker(f"jsonl:{tmp_path}"))
    rows = [json.loads(line) for line in (tmp_path / "abc.jsonl").read_text().splitlines()]
    assert [row["event"] for row in rows] == ["begin", "metrics", "end", "begin", "metrics", "end"]
    assert (rows[0]["id"], rows[0]["config"]) == ("abc", {"p_guid": 0.5})
    assert (rows[4]["step"], rows[4]["values"]) == (7, {"deaths": 1, "loss": 0.25})


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_tensorboard_reads_the_curves(tmp_path: Path) -> None:
    accumulator: Any = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")
    told(tracker(f"tensorboard:{tmp_path}"))
    found = accumulator.EventAccumulator(str(tmp_path / "abc")).Reload()
    points = [(point.step, point.value) for point in found.Scalars("deaths")]
    assert points == [(2, 0.0), (7, 1.0)]
    assert [point.value for point in found.Scalars("loss")] == [0.25]


class FakeWandb:
    """A stand-in for the module wandb and its runs, which keeps the calls."""

    def __init__(self) -> None:
        self.calls: list[tuple[str, Any]] = []

    def init(self, **given: Any) -> FakeWandb:
        self.calls.append(("init", given))
        return self

    def log(self, values: dict[str, Any], step: int) -> None:
        self.calls.append(("log", (step, values)))

    def finish(self) -> None:
        self.calls.append(("finish", None))


def test_the_shape_of_wandb_is_fed() -> None:
    wandb = FakeWandb()
    told(WandbTracker(wandb, project="islands"))
    assert [name for name, _ in wandb.calls] == ["init", "log", "finish"] * 2
    begun = wandb.calls[0][1]
    assert (begun["id"], begun["resume"], begun["project"]) == ("abc", "allow", "islands")
    assert begun["config"] == {"p_guid": 0.5, "world": "unsafe-exploration", "level": "island", "seed": 3}
    assert wandb.calls[1] == ("log", (2, {"deaths": 0}))
