"""Sentences about names that there are not."""

import pytest

from parenting.agent import config
from parenting.envs.names import UnknownNameError, did_you_mean


def test_the_nearest_name_is_asked_for_and_one_that_is_far_is_not() -> None:
    known = {"conservative": 1, "direct": 2}
    assert did_you_mean("conservatve", known) == " Did you mean 'conservative'?"
    assert did_you_mean("bold", known) == ""
    assert did_you_mean("bold", ()) == ""


def test_the_sentence_lists_all() -> None:
    assert str(UnknownNameError("level", "wide", iter(["narrow", "tall"]), "mazes")) == (
        "There is no level 'wide' of mazes. The levels are: narrow, tall."
    )
    assert str(UnknownNameError("level", "nrrow", ["narrow"])) == (
        "There is no level 'nrrow'. Did you mean 'narrow'? The levels are: narrow."
    )
    assert str(UnknownNameError("option", "x", [])) == "There is no option 'x'. The options are: none."


def test_so_it_is_with_a_preset() -> None:
    with pytest.raises(
        ValueError, match=r"There is no preset 'diret'\. Did you mean 'direct'\? The presets are: "
    ):
        config.compose("diret", {}, {}, strict=True)
