"""A walk in words: how it ended, whether it was safe, and the policy in every cell."""

from __future__ import annotations

import pytest

from parenting.drawing.clip import Clip
from parenting.drawing.growth import HEIGHT, WIDTH, growth_view
from parenting.drawing.walk_view import percent, policy_view, walk_view
from parenting.envs import registry

LEGEND = dict(registry.spec("unsafe-exploration").legend)
ROWS = ["######", "#   G#", "#W   #", "######"]
CELLS = {(1, 1): (0.0, 0.1, 0.2, 0.7), (1, 2): (0.97, 0.01, 0.01, 0.01), (2, 3): (0.25, 0.25, 0.25, 0.25)}


def clip(*places: tuple[int, int], actions: str) -> Clip:
    frames = [{"ground": ROWS, "observed": ROWS, "agent": list(place), "box": None} for place in places]
    return Clip(actions=actions.split(), length=len(places) - 1, frames=frames)  # type: ignore[typeddict-item]


@pytest.mark.parametrize(
    ("walk", "end", "unsafe", "said"),
    [
        (
            clip((1, 1), (1, 2), (1, 3), (1, 4), actions="right right right"),
            "goal",
            [],
            "It reached the goal after 3 steps. None of its steps was unsafe.",
        ),
        (
            clip((1, 1), (2, 1), actions="down"),
            "harm",
            [1],
            "It went into the water after 1 step. Its step was unsafe.",
        ),
        (
            clip((1, 1), (1, 1), (1, 2), actions="left right"),
            "time",
            [],
            "After 2 steps it was not at the goal. None of its steps was unsafe. "
            "Runs into a wall on the way.",
        ),
    ],
)
def test_the_end_comes_first_and_safety_after_it(walk: Clip, end: str, unsafe: list[int], said: str) -> None:
    view = walk_view(walk, end, unsafe, CELLS, LEGEND)
    assert view.spoken == said
    assert view.board.steps == walk["length"]


def test_each_row_tells_the_likeliest_move_of_each_cell() -> None:
    view = policy_view(clip((1, 1), actions=""), CELLS)
    assert view.words == (
        "Row 2: column 2 right (70\xa0%), column 3 up (97\xa0%).",
        "Row 3: column 4 up (25\xa0%).",
    )
    assert view.arrows.likely.count("M") == 6  # ties are all drawn as likely
    assert view.arrows.less.count("M") == 2


@pytest.mark.parametrize(
    ("chance", "said"), [(0.0, "0\xa0%"), (0.001, "under 1\xa0%"), (0.314, "31\xa0%"), (1.0, "100\xa0%")]
)
def test_a_rare_move_is_not_said_to_be_impossible(chance: float, said: str) -> None:
    assert percent(chance) == said


def test_the_growth_line_rises_from_left_to_right() -> None:
    view = growth_view([(0, 0.0), (10, 0.5), (20, 1.0)], 24)
    assert view.line == f"M0,{HEIGHT}L{WIDTH // 2},{HEIGHT // 2}L{WIDTH},0"
    assert view.spoken == "After 20 answers it reaches the goal safely from 100\xa0% of 24 cells."
    assert (
        growth_view([(1, 0.25)], None).spoken == "After 1 answer it earns 25\xa0% of what could be expected."
    )
    assert growth_view([(0, 0.25)], 4).line.count(",") == 2  # a single point is a level line
