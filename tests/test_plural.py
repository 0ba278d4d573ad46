"""One of a thing is a run, none and two are runs."""

from parenting._plural import counted


def test_only_one_is_singular() -> None:
    assert [counted(number, "run") for number in (0, 1, 2, 21)] == ["0 runs", "1 run", "2 runs", "21 runs"]
