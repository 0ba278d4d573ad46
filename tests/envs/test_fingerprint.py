"""Fingerprints: one word for a content, whichever library multiplies."""

from __future__ import annotations

import pytest
import torch

from parenting.envs import fingerprint as module
from parenting.envs.fingerprint import fingerprint


@pytest.mark.parametrize("shape", [(48,), (1, 48), (3, 2, 96), (2, 7), (0, 9)])
@pytest.mark.parametrize("dtype", [torch.uint8, torch.int8, torch.int64])
def test_few_words_and_many_have_the_same_fingerprint(
    shape: tuple[int, ...], dtype: torch.dtype, monkeypatch: pytest.MonkeyPatch
) -> None:
    draws = torch.Generator().manual_seed(len(shape))
    content = torch.randint(-(2**60), 2**60, shape, generator=draws).to(dtype)
    few = fingerprint(content)
    monkeypatch.setattr(module, "FEW", -1)
    many = fingerprint(content)
    assert few.shape == many.shape == shape[:-1]
    assert few.dtype == many.dtype == torch.int64
    assert torch.equal(few, many)


def test_a_view_has_the_fingerprint_of_its_copy() -> None:
    content = torch.arange(24).view(4, 6)
    assert torch.equal(fingerprint(content.T), fingerprint(content.T.contiguous()))
