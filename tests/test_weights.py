"""Pre-trained weights as files (Sec. 3.1.4), and those that are shipped."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
import torch

from parenting.agent.policy import network_for
from parenting.agent.pretraining_loop import Pretrainer
from parenting.envs import registry
from parenting.weights import store
from parenting.weights.store import NoWeightsError, Wanted, find, load, metadata, save
from tests.tree import ROOT

BOX = Wanted(registry.spec("side-effects"), 6, 6)
SHIPPED = {
    Wanted(kind, level.height, level.width).name: Wanted(kind, level.height, level.width)
    for kind in registry.WORLDS.values()
    if kind.defaults["pretrain"]
    for level in [registry.level(kind.name, name) for name in kind.levels]
}


def test_a_file_comes_back(tmp_path: Path) -> None:
    weights = torch.arange(5.0)
    path = tmp_path / "deep" / f"{BOX.name}.safetensors"
    sha256 = save(path, BOX, weights, {"steps": "3"})
    blob = path.read_bytes()
    assert store.digest(blob) == sha256
    assert torch.equal(load(blob, BOX), weights)
    assert metadata(blob)["steps"] == "3"
    assert [file.name for file in path.parent.iterdir()] == [path.name]


def test_ones_own_come_before_the_shipped(tmp_path: Path) -> None:
    assert find(BOX, tmp_path) == store.SHIPPED / f"{BOX.name}.safetensors"
    own = tmp_path / f"{BOX.name}.safetensors"
    save(own, BOX, torch.zeros(2), {})
    assert find(BOX, tmp_path) == own


def test_missing_weights_name_the_command_that_makes_them(tmp_path: Path) -> None:
    with pytest.raises(NoWeightsError, match=r"pretrain --world side-effects --size 7x5.*pretrain to false"):
        find(BOX._replace(height=7, width=5), tmp_path)


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        (BOX._replace(height=7), "size '6x6', not '7x6'"),
        (BOX._replace(world=registry.spec("interruptibility")), "legend '# GXA'"),
    ],
)
def test_weights_of_something_else_are_refused(tmp_path: Path, wanted: Wanted, said: str) -> None:
    save(tmp_path / "some.safetensors", BOX, torch.zeros(2), {})
    with pytest.raises(NoWeightsError, match=said):
        load((tmp_path / "some.safetensors").read_bytes(), wanted)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda b: b[: len(b) // 2],
        lambda b: b"",
        lambda b: b"\xff" * 64,
        lambda b: (2).to_bytes(8, "little") + b"[]",  # a header, but no table
        lambda b: b.replace(b'"weights"', b'"heights"'),
    ],
)
def test_damaged_weights_are_refused(spoil: object) -> None:
    blob = find(BOX).read_bytes()
    assert callable(spoil)
    with pytest.raises(NoWeightsError, match="cannot be read as weights"):
        load(spoil(blob), BOX)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_weights_walk_in_mazes_that_they_have_never_seen(name: str) -> None:
    wanted = SHIPPED[name]
    path = find(wanted)
    assert path.parent == store.SHIPPED
    blob = path.read_bytes()
    said = metadata(blob)
    network = network_for(wanted.height, wanted.width, len(said["legend"]))
    exam = Pretrainer(network, wanted.world.glyphs).evaluate(load(blob, wanted))
    assert exam.solved >= 0.95
    assert float(said["solved"]) == pytest.approx(exam.solved, abs=5e-4)
    assert exam.entropy > 0.2  # logits far apart would leave parenting nothing to explore
    rows = list(csv.reader(path.with_suffix(".csv").read_text().splitlines()))
    assert rows[0] == ["step", "mean_return"]
    assert int(rows[-1][0]) >= int(said["steps"]) > int(rows[-2][0])


def test_shipped_weights_are_small_and_no_others() -> None:
    files = {file.stem: file.stat().st_size for file in store.SHIPPED.glob("*.safetensors")}
    assert set(files) == set(SHIPPED)
    assert sum(files.values()) < 2_000_000


@pytest.mark.parametrize("name", SHIPPED)
def test_the_docs_say_what_the_file_says(name: str) -> None:
    blob = find(SHIPPED[name]).read_bytes()
    said = metadata(blob)
    cells = (
        f"{len(blob) / 1000:.0f} | {said['steps']} | {said['return']} | {100 * float(said['solved']):.1f} %"
    )
    line = f"| `{name}.safetensors` | {cells} | `{store.digest(blob)[:12]}` |"
    assert line in (ROOT / "docs/paper.md").read_text(encoding="utf-8")
