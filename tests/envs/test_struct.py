"""Records of tensors, joined: along the axis of trials wherever it stands, however deep."""

from __future__ import annotations

import pytest
import torch
from jaxtyping import Int64
from torch import Tensor

from parenting.envs.struct import Struct


class Leaf(Struct):
    """The axis of trials comes first."""

    row: Int64[Tensor, "N W"]


class Tree(Struct):
    """The axis of trials comes second, in a dictionary, in a record below, or not at all."""

    late: Int64[Tensor, "M N"]
    named: dict[str, Int64[Tensor, "N"]]
    leaf: Leaf
    shared: Int64[Tensor, "M"]


def tree(*trials: int) -> Tree:
    rows = torch.tensor(trials, dtype=torch.int64)
    return Tree(
        late=torch.stack([rows, 10 * rows]),
        named={"one": rows},
        leaf=Leaf(row=rows[:, None].repeat(1, 3)),
        shared=torch.tensor([7, 8]),
    )


def test_the_trials_of_all_parts_one_part_after_the_other() -> None:
    parts = [tree(1, 2), tree(3), tree()]
    whole, wanted = Tree.joined(parts).check(), tree(1, 2, 3)
    assert all(torch.equal(one, wanted.tensors()[name]) for name, one in whole.tensors().items())
    again = whole.pick(torch.tensor([2])).tensors()
    assert all(torch.equal(one, again[name]) for name, one in tree(3).tensors().items())


def test_nothing_cannot_be_joined() -> None:
    with pytest.raises(IndexError):
        Tree.joined([])
