"""The cases of a test that are too long for every run (tests/slow.py)."""

import pytest


@pytest.mark.parametrize("store", ["sqlite", "postgresql"])
@pytest.mark.parametrize("case", [1, 2, 3])
@pytest.mark.slow_after(2)
def test_the_first_cases_on_each_store_are_done_in_every_run(
    request: pytest.FixtureRequest, case: int, store: str
) -> None:
    assert (request.node.get_closest_marker("slow") is not None) == (case > 2)


@pytest.mark.parametrize("case", [1, 2])
def test_other_tests_are_left_alone(request: pytest.FixtureRequest, case: int) -> None:
    assert request.node.get_closest_marker("slow") is None


@pytest.mark.parametrize("store", ["sqlite", "postgresql"])
@pytest.mark.slow_on("postgresql")
def test_a_test_may_be_slow_on_one_store(request: pytest.FixtureRequest, store: str) -> None:
    assert (request.node.get_closest_marker("slow") is not None) == (store == "postgresql")
