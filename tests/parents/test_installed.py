"""Parents of other packages have their names in the grammar, by entry point."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import parenting as pt
from parenting.envs.installed import Installed
from parenting.parents import grammar
from parenting.parents.grammar import ParentError, read_parent

MODULE = "drowsy_parents"
SOURCE = """
import torch
from pydantic import Field
from parenting.parents.errors import Wrong

class Drowsy(Wrong):
    eps: float = Field(1.0, ge=0, le=1)

    def chance(self, asked):
        return torch.full_like(asked.gap, self.eps)
"""
Install = Callable[[str], None]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """A package on the path, with its metadata beside it, as pip leaves them."""

    def installed(entry_point: str) -> None:
        (tmp_path / f"{MODULE}.py").write_text(SOURCE)
        metadata = tmp_path / "drowsy-1.0.dist-info"
        metadata.mkdir()
        (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: drowsy\nVersion: 1.0\n")
        (metadata / "entry_points.txt").write_text(f"[parenting.parents]\n{entry_point}\n")
        monkeypatch.syspath_prepend(tmp_path)
        monkeypatch.delitem(sys.modules, MODULE, raising=False)
        fresh = Installed("parenting.parents", "parent", grammar._usable)
        monkeypatch.setattr(grammar, "INSTALLED", fresh)

    return installed


def test_it_is_read_joined_and_written_by_its_name(install: Install) -> None:
    install(f"drowsy = {MODULE}:Drowsy")
    spec = read_parent("drowsy:0.5+tiring")
    assert str(spec) == "drowsy:eps=0.5+tiring:eps=0.3,half=50.0"
    assert read_parent(str(spec)) == spec
    with pytest.raises(ParentError, match=r"drowsy:eps=2: Input should be less than or equal to 1"):
        read_parent("drowsy:2")
    with pytest.raises(ParentError, match=r"Did you mean 'drowsy'\?.*adversarial, drowsy\."):
        read_parent("drowzy")


def test_agents_are_raised_by_it(install: Install) -> None:
    """Always wrong, it names other sides than the paper's parent does."""
    install(f"drowsy = {MODULE}:Drowsy")
    first = [
        pt.train("unsafe-exploration", parent=parent, seed=3, until="queries:1", progress=False).answers[0]
        for parent in ("scripted", "drowsy", "adversarial")
    ]
    assert first[1]["choice"] == first[2]["choice"] != first[0]["choice"]


@pytest.mark.parametrize(
    ("point", "asked", "said"),
    [
        (
            "drowsy = no_such_module_anywhere:Drowsy",
            "drowsy",
            "of the package drowsy 1.0 cannot be used",
        ),
        ("drowsy = json:dumps", "drowsy", "a whole subclass of Part is wanted"),
        ("drowsy = parenting.parents.errors:Wrong", "drowsy", "a whole subclass of Part is wanted"),
        (f"noisy:2 = {MODULE}:Drowsy", "noisy:3", r"noisy:eps=3: Input"),
        (f"Drowsy = {MODULE}:Drowsy", "Drowsy", "lower-case letters"),
    ],
)
def test_a_broken_one_is_told_where_it_is_asked_for(
    install: Install, point: str, asked: str, said: str
) -> None:
    install(point)
    with pytest.raises(ParentError, match=said):
        read_parent(asked)
    assert str(read_parent("noisy:0.1")) == "noisy:eps=0.1"
