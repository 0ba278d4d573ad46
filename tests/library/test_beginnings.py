"""`train` begins with an earlier policy and earlier answers."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch
from typer.testing import CliRunner

import parenting as pt
from parenting.commands.main import app
from tests.server.conftest import CLIP


@pytest.fixture
def export(tmp_path: Path) -> Path:
    """Two answers on an island of 3 x 3: up is better than down."""
    row = {"world": "unsafe-exploration", "kind": "guidance", "maturity": 1, "votes": 0}
    told = row | {"left": CLIP, "right": {**CLIP, "actions": ["down"]}, "choice": "left", "standing": True}
    file = tmp_path / "run-1.jsonl"
    file.write_text("".join(json.dumps({**told, "run_public_id": "abc"}) + "\n" for _ in range(2)))
    return file


ISLET = "world: unsafe-exploration\nname: islet\n\nWWW\nWAG\nWWW\n"


@pytest.mark.slow
def test_no_tick_leaves_a_policy_as_it_began(policy: pt.Policy, tmp_path: Path) -> None:
    """Without guidance heard nothing is trained, so the first tick shows the weights that it began with."""
    result = pt.train("unsafe-exploration", from_policy=policy, until="ticks:1", trials=2, progress=False)
    assert all(torch.equal(one.parameters, policy.parameters) for one in result.policies)
    assert result.origin["policy"]["stage"] == 1
    again = pt.load_result(result.save(tmp_path / "result"))
    assert again.origin == result.origin
    kept = pt.load_policy(result.policies[1].save(tmp_path / "one.safetensors"))
    assert kept.about["origin"] == result.origin


def test_earlier_answers_are_trained_on(export: Path) -> None:
    """One gradient step a tick on X, before anybody answers anything here."""
    with_x, without = (
        pt.train(ISLET, from_answers=file, until="ticks:40", progress=False, p_guid=0.0, p_pref=0.0)
        for file in (export, None)
    )
    assert with_x.origin["answers"]["answers"] == 2
    assert with_x.origin["answers"]["run"] == "abc"
    start = with_x.world.beginnings()
    seen = with_x.world.observe(start.board, start.agent, start.box).numpy()
    learnt, fresh = (one.policies[0].probabilities(seen)[0] for one in (with_x, without))
    assert learnt[0] - learnt[1] > fresh[0] - fresh[1]
    assert learnt[0] > learnt[1]


@pytest.mark.slow
def test_what_does_not_fit_is_told_with_its_field(policy: pt.Policy, export: Path, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="world: The policy is of the world unsafe-exploration"):
        pt.train("side-effects", from_policy=policy, progress=False)
    with pytest.raises(ValueError, match=r"level: The policy is for boards of 6 x 8, .* has 3 x 3"):
        pt.train(ISLET, from_policy=policy, progress=False)
    with pytest.raises(ValueError, match=r"level: Answer 1 is on a board of 3 x 3"):
        pt.train("unsafe-exploration", from_answers=export, progress=False)
    with pytest.raises(ValueError, match=r"from_policy: .*no-such-file cannot be read"):
        pt.train("unsafe-exploration", from_policy=tmp_path / "no-such-file", progress=False)
    with pytest.raises(ValueError, match=r"from_answers: .*line 1 is not JSON"):
        pt.train("unsafe-exploration", from_answers=policy.save(tmp_path / "p"), progress=False)


def test_the_command_begins_with_them_and_says_so(policy: pt.Policy, tmp_path: Path) -> None:
    file = str(policy.save(tmp_path / "careful.safetensors"))
    asked = ["run", "unsafe-exploration", "--from-policy", file, "--trials", "2", "--until", "ticks:1"]
    said = CliRunner().invoke(app, [*asked, "--workers", "1"])
    assert said.exit_code == 0, said.output
    assert "from policy careful.safetensors (" in said.stdout
    wrong = CliRunner().invoke(app, ["run", "side-effects", "--from-policy", file])
    assert (wrong.exit_code, "world: The policy is of the world" in wrong.stderr) == (2, True)
