"""Results that several tests look at, trained once a process."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

import parenting as pt
from parenting.library import page_training
from tests.library.person_at_page import PersonAtPage, ToGoal


@pytest.fixture(scope="session")
def trained() -> pt.TrainResult:
    return pt.train("unsafe-exploration", trials=3, seed=5, progress=False)


@pytest.fixture(scope="session")
def policy(trained: pt.TrainResult) -> pt.Policy:
    return trained.policies[0]


@pytest.fixture
def person_at_the_page(
    monkeypatch: pytest.MonkeyPatch, chromium_path: str
) -> Iterator[Callable[..., list[PersonAtPage]]]:
    """Where `train` would open a browser, a browser is opened that answers."""
    opened: list[PersonAtPage] = []

    def prepare(
        answers: int, then: Callable[[], None] = lambda: None, to_goal: ToGoal | None = None
    ) -> list[PersonAtPage]:
        def open_page(url: str, _browser: bool) -> None:
            opened.append(PersonAtPage(url, chromium_path, answers, then, to_goal))
            opened[-1].start()

        monkeypatch.setattr(page_training, "open_page", open_page)
        return opened

    yield prepare
    for one in opened:
        one.join(30)
        assert one.error is None, one.error
