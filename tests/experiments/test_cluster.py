"""`--cluster`: a Dask cluster of two processes does the same pieces, and a death costs its own piece only."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from commands.main import app
from experiments.labour import do, work
from experiments.pieces import Row, Store, Task

dask = pytest.importorskip("dask", reason="the extra `dask` is not installed")


def die_once(mark: str) -> list[Row]:
    """Killed at the first try, as for want of memory."""
    if not Path(mark).exists():
        Path(mark).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return [{"lived": True}]


def raised(number: int) -> Task:
    """One real piece: two agents for a few ticks."""
    mine: dict[str, Any] = {"world": "unsafe-exploration", "level": "island", "preset": "lax", "changes": {}}
    goal = {"until": ("ticks", 5), "max_ticks": 5, "span": (2 * number, 2 * number + 2), "trials": 8}
    call = "experiments.raising:parent_some"
    return Task(f"piece-{number}", call, {"label": "some", "seed": 0, **mine, **goal})


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    """The address of two worker processes on this machine. A piece is given up at the first death over it."""
    from dask.distributed import LocalCluster

    root = str(Path(__file__).parents[2])
    with (
        pytest.MonkeyPatch.context() as patch,
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
    ):
        patch.setenv("PYTHONPATH", root)  # workers find this module by its name
        with LocalCluster(  # type: ignore[no-untyped-call]
            n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None
        ) as two:
            yield two.scheduler_address


def test_a_cluster_does_the_same_and_a_death_costs_its_own_piece(cluster: str, tmp_path: Path) -> None:
    store = Store(tmp_path / "pieces", {"seed": 0})
    fatal = Task("fatal", f"{__name__}:die_once", {"mark": str(tmp_path / "mark")})
    told: list[str] = []
    rows = work([raised(0), fatal, raised(1)], store, 1, cluster, lambda task: told.append(task.key))
    assert rows == [*do(raised(0)), {"lived": True}, *do(raised(1))]
    assert sorted(told) == ["fatal", "piece-0", "piece-1"]


def test_no_cluster_at_an_address_is_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("experiments.labour.PATIENCE", 0.2)
    arguments = ["experiment", "table1", "--trials", "1", "--out", str(tmp_path)]
    said = CliRunner().invoke(app, [*arguments, "--cluster", "tcp://127.0.0.1:9"])
    assert said.exit_code == 2
    assert "Look at --out and --cluster." in " ".join(said.output.split())
