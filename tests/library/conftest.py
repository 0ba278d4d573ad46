"""Results that several tests look at, trained once a process."""

from __future__ import annotations

import pytest

import parenting as pt


@pytest.fixture(scope="session")
def trained() -> pt.TrainResult:
    return pt.train("unsafe-exploration", trials=3, seed=5, progress=False)


@pytest.fixture(scope="session")
def policy(trained: pt.TrainResult) -> pt.Policy:
    return trained.policies[0]
