"""`--cluster`: a Dask cluster of two processes does the same pieces, and a death costs its own piece only."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.experiments.runner.dask_cluster import NoClusterError
from parenting.experiments.runner.executor import run_task, work
from parenting.experiments.runner.store import Row, Store, Task

run = CliRunner().invoke
COMMAND = ["experiment", "figure4", "--trials", "1", "--out"]
FREE = "127.0.0.1:0"
dask = pytest.importorskip("dask", reason="the extra `dask` is not installed")


def die_once(mark: str) -> list[Row]:
    """Killed at the first try, as for want of memory."""
    if not Path(mark).exists():
        Path(mark).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return [{"lived": True}]


def wait(seconds: float) -> list[Row]:
    """A piece that takes a while."""
    time.sleep(seconds)
    return [{"waited": True}]


def raised(number: int) -> Task:
    """One real piece: two agents for a few ticks."""
    mine: dict[str, Any] = {"world": "unsafe-exploration", "level": "island", "preset": "lax", "changes": {}}
    goal = {"until": ("ticks", 5), "max_ticks": 5, "span": (2 * number, 2 * number + 2)}
    call = "parenting.experiments.training.tasks:parent_trials"
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
            n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=FREE
        ) as two:
            yield two.scheduler_address


@pytest.mark.faults
def test_a_cluster_does_the_same_and_a_death_costs_its_own_piece(cluster: str, tmp_path: Path) -> None:
    store = Store(tmp_path / "pieces", {"seed": 0})
    fatal = Task("fatal", f"{__name__}:die_once", {"mark": str(tmp_path / "mark")})
    on_done: list[str] = []
    rows = work([raised(0), fatal, raised(1)], store, 1, cluster, lambda task: on_done.append(task.key))
    assert rows == [*run_task(raised(0)), {"lived": True}, *run_task(raised(1))]
    assert sorted(on_done) == ["fatal", "piece-0", "piece-1"]


@pytest.mark.parametrize(
    "address", ["foo", "", "http://127.0.0.1:1", "tcp://", "tcp://127.0.0.1", "a b:1", "h:x"]
)
def test_what_is_no_address_is_said_before_anything_is_written(address: str, tmp_path: Path) -> None:
    said = run(app, [*COMMAND, str(tmp_path), "--cluster", address])
    assert said.exit_code == 2
    assert f"--cluster {address or repr(address)}: this is not the address" in said.output
    assert "tcp://127.0.0.1:8786" in said.output
    assert list(tmp_path.iterdir()) == []


def test_an_address_where_nobody_answers_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("parenting.experiments.runner.dask_cluster.PATIENCE", 0.2)
    said = run(app, [*COMMAND, str(tmp_path), "--cluster", "tcp://127.0.0.1:9"])
    assert said.exit_code == 2
    assert "--cluster tcp://127.0.0.1:9: no Dask scheduler answers there" in said.output
    assert "Start one by: dask scheduler" in said.output
    assert "Traceback" not in said.output
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_cluster_without_a_worker_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from dask.distributed import LocalCluster

    monkeypatch.setattr("parenting.experiments.runner.dask_cluster.PATIENCE", 2)
    with LocalCluster(  # type: ignore[no-untyped-call]
        n_workers=0, host="127.0.0.1", dashboard_address=FREE
    ) as empty:
        said = run(app, [*COMMAND, str(tmp_path), "--cluster", empty.scheduler_address])
    assert said.exit_code == 2
    assert f"it has no worker. Start one by: dask worker {empty.scheduler_address}" in said.output
    assert list(tmp_path.iterdir()) == []


def test_without_dask_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("parenting.experiments.runner.dask_cluster.find_spec", lambda _name: None)
    said = run(app, [*COMMAND, str(tmp_path), "--cluster", "tcp://127.0.0.1:9"])
    assert said.exit_code == 2
    assert "pip install 'parenting[dask]'" in said.output


@pytest.mark.slow
@pytest.mark.faults
@pytest.mark.usefixtures("cluster")  # its workers, too, find this module by its name
def test_a_scheduler_that_goes_away_costs_what_is_in_work_alone(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    from dask.distributed import LocalCluster

    tasks = [Task(f"piece-{number}", f"{__name__}:wait", {"seconds": 3.0 * number}) for number in (0, 1)]
    store = Store(tmp_path / "pieces", {"seed": 0})
    one = LocalCluster(  # type: ignore[no-untyped-call]
        n_workers=1, threads_per_worker=2, processes=True, host="127.0.0.1", dashboard_address=FREE
    )

    def leave(_task: Task) -> None:
        one.close()

    with one, pytest.raises(NoClusterError, match="the scheduler is gone"):
        work(tasks, store, 1, one.scheduler_address, leave)
    assert [store.has(task.key) for task in tasks] == [True, False]
    assert [record.name for record in caplog.records if record.exc_info] == []
