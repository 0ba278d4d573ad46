"""Episodes as a dataset of Minari: read again by Minari, each step is the one that was lived."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import parenting as pt
from parenting.commands.main import app
from parenting.envs.gym import GridworldEnv
from parenting.server import moves
from parenting.server.archive.target import target
from parenting.server.archive.writing import write_export
from parenting.server.db import Database
from parenting.server.errors import NotFound, SetupError
from parenting.server.new_run import NewRun, start
from parenting.server.queue.worker_side import watch
from parenting.server.runs import claim
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.tables import Run

minari = pytest.importorskip("minari")
pytestmark = pytest.mark.only("sqlite", "the moves are bytes to every store")
NAME = "parenting/garden/child-v0"


@pytest.fixture(autouse=True)
def _datasets(tmp_path: Path, settings: Settings, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARENTING_DATA", str(settings.data))
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))


@pytest.fixture
def lived(db: Database) -> tuple[Run, list[Any]]:
    """A run of fifty ticks in a world with random events, and the truth after each tick."""
    config: dict[str, Any] = {"pretrain": False, "max_episode_steps": 12}
    run = start(db, NewRun(world="reward-hacking", parent="scripted", seed=3, config=config))
    (mine,) = claim(db, "test")
    life, seen = RunSession(db, mine, run, lambda: None), []
    for _ in range(50):
        life.tick(watch(db, [run.id])[run.id])
        here = life.saved.state.world
        codes = life.world.observe(here.board, here.agent, here.box)[0].numpy()
        bits = np.eye(len(life.world.legend), dtype=np.int8)[codes]
        report = life.saved.state.info
        seen.append((bits, int(report.action[0]), bool(report.moved[0]), bool(here.terminated[0])))
    life.save()
    return run, seen


def export(db: Database, path: Path) -> Path:
    with target(path) as files:
        write_export(db, [1], files)
    return path


@pytest.mark.slow
def test_minari_reads_every_step_as_it_was_lived(
    db: Database, lived: tuple[Run, list[Any]], tmp_path: Path
) -> None:
    _, seen = lived
    pt.to_minari(export(db, tmp_path / "out.zip"), NAME)
    dataset = minari.load_dataset(NAME)
    found = [one for one in moves.episodes(moves.read_moves(db, 1)) if one.steps]
    assert (dataset.total_episodes, dataset.total_steps) == (len(found), sum(one.steps for one in found))
    assert len(found) > 2
    for one, row in zip(found, dataset.iterate_episodes(), strict=True):
        stepped = [(tick, *seen[tick - 1]) for tick in range(one.first, one.last + 1) if seen[tick - 1][2]]
        assert row.infos["tick"].tolist() == [one.first - 1, *(tick for tick, *_ in stepped)]
        assert row.actions.tolist() == [action for _, _, action, _, _ in stepped]
        assert np.array_equal(row.observations[1:], np.stack([bits for _, bits, *_ in stepped]))
        assert row.terminations.tolist() == [over for *_, over in stepped]
        assert row.truncations.tolist() == [False] * (one.steps - 1) + [not stepped[-1][-1]]
        assert sum(row.infos["cost"]) == one.unsafe
    told = list(dataset.storage.get_episode_metadata(range(len(found))))
    assert [(row["first"], row["end"]) for row in told] == [(one.first, one.end) for one in found]


@pytest.mark.slow
def test_its_environment_makes_the_same_steps(
    db: Database, lived: tuple[Run, list[Any]], tmp_path: Path
) -> None:
    """The world that Minari recovers has the spaces of the data, and gives the stored rewards."""
    dataset = pt.to_minari(export(db, tmp_path / "out"), NAME)
    env = dataset.recover_environment()
    assert (env.observation_space, env.action_space) == (dataset.observation_space, dataset.action_space)
    row = dataset[0]
    observation, _ = env.reset(seed=0)
    assert np.array_equal(observation, row.observations[0])
    _, reward, *_, info = env.step(row.actions[0])
    assert (reward, info["cost"]) == (row.rewards[0], row.infos["cost"][1])
    assert isinstance(env.unwrapped, GridworldEnv)
    assert env.unwrapped.world.time_limit == 12


@pytest.mark.slow
def test_the_command_writes_the_same_and_replaces_nothing(
    db: Database, lived: tuple[Run, list[Any]], tmp_path: Path
) -> None:
    said = CliRunner().invoke(app, ["export", "1", "--minari", NAME])
    assert said.exit_code == 0, said.output
    dataset = minari.load_dataset(NAME)
    assert f"{dataset.total_episodes} episodes with {dataset.total_steps} steps of run 1" in said.output
    again = CliRunner().invoke(app, ["export", "1", "--minari", NAME])
    assert (again.exit_code, "already" in again.output) == (2, True)
    other = CliRunner().invoke(app, ["export", "1", "--minari", NAME, "--out", "x"])
    assert (other.exit_code, "--out" in other.output) == (2, True)


def test_what_cannot_be_a_dataset_is_refused_and_leaves_none(
    db: Database, five: list[int], tmp_path: Path
) -> None:
    with target(tmp_path / "out") as files:
        write_export(db, five, files)
    with pytest.raises(NotFound, match="5 runs: 1, 2, 3, 4, 5"):
        pt.to_minari(tmp_path / "out", NAME)
    with pytest.raises(NotFound, match="No episode of run 2"):
        pt.to_minari(tmp_path / "out", NAME, run=2)
    with pytest.raises(SetupError, match="cannot be the name"):
        pt.to_minari(tmp_path / "out", "no name!", run=2)
    assert not minari.list_local_datasets()


def test_without_minari_a_sentence_names_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "minari", None)
    with pytest.raises(SetupError, match=r"pip install 'parenting\[minari\]'"):
        pt.to_minari("out", NAME)
