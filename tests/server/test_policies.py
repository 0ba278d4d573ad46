"""The policy of a stored run as a file: taken without torch from its last good checkpoint, and read back."""

from __future__ import annotations

import io
import pickle
import subprocess
import sys
import zipfile
from pathlib import Path

import httpx2
import pytest
import torch

import parenting as pt
from parenting.agent.config import Config
from parenting.agent.init import world_of
from parenting.server.checkpoints import save_checkpoint
from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.identity import database_id
from parenting.server.new_run import NewRun, start
from parenting.server.policies import present_policy
from parenting.server.runs import Claim, claim
from parenting.server.snapshot import Snapshot, initial_snapshot, initial_weights, pack
from parenting.server.tables import Run
from parenting.server.tensor_archive import TensorArchive, UnreadableArchiveError
from tests.tree import ROOT


def begun(db: Database, run: Run, seed: int = 3) -> Snapshot:
    config = Config.model_validate(run.config)
    world = world_of(run.world, run.level_text, config)
    return initial_snapshot(world, config, seed, initial_weights(db, run, world))


def saved(db: Database, mine: Claim, run: Run, tick: int, seed: int = 3) -> Snapshot:
    """Save a checkpoint of a tick, whose weights depend on the seed."""
    found = begun(db, run, seed)
    found.state.keys.tick[0] = tick
    save_checkpoint(db, mine, tick, pack(found))
    return found


def test_the_file_holds_the_policy_of_the_last_checkpoint(
    db: Database, client: httpx2.Client, run: Run, mine: Claim, tmp_path: Path
) -> None:
    saved(db, mine, run, 10)
    last = saved(db, mine, run, 25, seed=4)
    reply = client.get(f"/api/v1/runs/{run.public_id}/policy")
    assert reply.headers["content-disposition"].endswith(f'"policy-{run.public_id}-25.safetensors"')
    file = tmp_path / "policy.safetensors"
    file.write_bytes(reply.content)
    policy = pt.load_policy(file)
    assert torch.equal(policy.parameters, last.state.learner.params[0])
    assert (policy.config, policy.seed, policy.stage) == (last.config, run.seed, 1)
    assert policy.world.levels[0].text == run.level_text
    source = policy.about["source"]
    assert (source["run"], source["database"], source["tick"]) == (run.public_id, database_id(db), 25)
    assert f"Run: {run.public_id}" in policy.about["card"]
    assert "pt.load_policy" in policy.about["card"]


@pytest.mark.only("sqlite")
def test_every_world_has_its_options(db: Database, tmp_path: Path) -> None:
    run = start(db, NewRun(world="absent-supervisor", config={"supervised": "random"}))
    (mine,) = claim(db, "w")
    last = saved(db, mine, run, 1)
    file = tmp_path / "policy.safetensors"
    file.write_bytes(present_policy(db, run.id).blob)
    policy = pt.load_policy(file)
    assert torch.equal(policy.parameters, last.state.learner.params[0])
    assert policy.world.options == world_of(run.world, run.level_text, last.config).options


@pytest.mark.only("sqlite")
def test_a_damaged_checkpoint_is_passed_over(db: Database, run: Run, mine: Claim) -> None:
    with pytest.raises(NotFound, match="no policy to take yet"):
        present_policy(db, run.id)
    saved(db, mine, run, 10)
    save_checkpoint(db, mine, 20, b"not the state of an agent")
    assert present_policy(db, run.id).about["source"]["tick"] == 10


def test_every_tensor_is_read_as_torch_reads_it() -> None:
    kept = {
        name: torch.arange(12).reshape(3, 4).to(getattr(torch, name)) for name in ("float32", "int8", "uint8")
    }
    kept["view"] = torch.arange(20, dtype=torch.float64)[5:9]
    out = io.BytesIO()
    torch.save({"some": kept, "words": "abc"}, out)
    archive = TensorArchive(out.getvalue())
    assert archive.content["words"] == "abc"
    for name, tensor in kept.items():
        found = archive.content["some"][name]
        assert (found.shape, archive.read(found)) == (tuple(tensor.shape), tensor.numpy().tobytes())


class Harmful:
    """A pickle that would run a command."""

    def __reduce__(self) -> tuple[object, tuple[str]]:
        import os

        return os.system, ("exit 1",)


def test_an_archive_that_names_anything_else_is_refused_and_runs_nothing() -> None:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as made:
        made.writestr("archive/data.pkl", pickle.dumps({"state": Harmful()}))
        made.writestr("archive/byteorder", "little")
    with pytest.raises(UnreadableArchiveError, match="UnpicklingError"):
        TensorArchive(out.getvalue())


def test_no_torch_is_loaded_for_it() -> None:
    code = "import parenting.server.policies, sys; assert not {'torch', 'numpy'} & sys.modules.keys()"
    result = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
