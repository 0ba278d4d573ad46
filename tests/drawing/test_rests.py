"""The words of what differs among boards besides the agent's cell."""

from __future__ import annotations

from parenting.drawing.rests import complete, parts_of

LEGEND = {" ": "land", "T": "watered plant", "t": "dry plant", "I": "interruption", "S": "supervisor"}


def test_each_thing_that_varies_is_named() -> None:
    assert parts_of(["#  #"], (0, 2), ["#  #"], LEGEND) == {"box": "row 1, column 3"}
    garden = ["TtT"]
    assert parts_of(["ttT"], None, garden, LEGEND) == {"dry plants": "2: row 1 column 1, row 1 column 2"}
    assert parts_of(["TTT"], None, garden, LEGEND) == {"dry plants": "none"}
    assert parts_of(["S S"], None, ["S S"], LEGEND) == {"supervisor": "there"}
    assert parts_of(["   "], None, ["S S"], LEGEND) == {"supervisor": "away"}
    pressed = [parts_of([row], None, [" I B"], LEGEND) for row in (" I B", "   B")]
    assert complete(pressed) == [{"interruption": "there"}, {"interruption": "land"}]
