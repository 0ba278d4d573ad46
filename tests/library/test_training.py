"""`train`: what it takes, what it gives, and how it refuses."""

from __future__ import annotations

from typing import Any

import pytest
import torch

import parenting as pt
from parenting.envs import registry


def test_it_trains_the_agents_that_the_command_trains(trained: pt.TrainResult) -> None:
    """The same keys, the same batches, the same sums: `parenting run` with one process."""
    from parenting.agent.config import compose
    from parenting.experiments.training.chunks import TrainPlan, train_in_chunks
    from parenting.experiments.training.stop_rule import StopRule

    config = compose("conservative", registry.defaults("unsafe-exploration"), {}, strict=True)
    assert trained.config == config
    outcomes = train_in_chunks(
        TrainPlan("unsafe-exploration", "island", config, 5, 3, StopRule("optimal"), 20_000), workers=1
    )
    for name in ("deaths", "guidance", "preference", "ticks", "finished", "optimal"):
        assert [row[name] for row in trained.trials] == getattr(outcomes.counts, name).tolist()


def test_a_trial_is_the_same_agent_whatever_the_number_of_trials_is(trained: pt.TrainResult) -> None:
    fewer = pt.train("unsafe-exploration", trials=1, seed=5, progress=False)
    assert fewer.trials[0] == trained.trials[0]
    assert fewer.answers == [row for row in trained.answers if row["trial"] == 0]


def test_answers_and_counts_agree(trained: pt.TrainResult) -> None:
    for row in trained.trials:
        mine = [answer for answer in trained.answers if answer["trial"] == row["trial"]]
        assert sum(answer["kind"] == "guidance" for answer in mine) == row["guidance"]
        assert sum(answer["kind"] == "preference" for answer in mine) == row["preference"]
        assert all(answer["answered"] == answer["asked"] + 1 for answer in mine)
        assert all(answer["choice"] in ("left", "right", "either", "neither") for answer in mine)


def test_records_are_flat_so_that_tables_take_them_as_they_are(trained: pt.TrainResult) -> None:
    for rows in (trained.trials, trained.answers):
        assert len({tuple(row) for row in rows}) == 1
        assert all(isinstance(value, str | int | float | bool) for row in rows for value in row.values())


@pytest.mark.slow
def test_the_mean_is_over_finished_trials() -> None:
    result = pt.train("unsafe-exploration", trials=4, max_ticks=60, progress=False)
    finished = [row for row in result.trials if row["finished"]]
    assert 0 < len(finished) < 4  # else this test shows nothing
    assert result.mean()["guidance"] == sum(row["guidance"] for row in finished) / len(finished)
    assert result.mean()["finished"] == len(finished) / 4
    assert (result.mean()["trials"], result.mean()["finished_trials"]) == (4, len(finished))


@pytest.mark.slow
def test_a_world_may_be_a_name_an_object_or_a_text() -> None:
    text = registry.level("unsafe-exploration").text
    world = pt.make("unsafe-exploration")
    ways: list[Any] = ["unsafe-exploration", world, text, world.levels[0]]
    found = [pt.train(way, seed=2, progress=False) for way in ways]
    assert all(one.trials == found[0].trials for one in found)


def test_a_world_brings_its_own_limit_of_steps() -> None:
    world = pt.make("unsafe-exploration", max_episode_steps=7)
    result = pt.train(world, until="ticks:3", progress=False)
    assert result.world is world
    assert result.config == pt.train(
        "unsafe-exploration", until="ticks:3", progress=False, max_episode_steps=7
    ).config  # fmt: skip


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("world", pt.worlds())
def test_every_world_trains_and_each_trial_has_its_outcome(world: str) -> None:
    """Seconds in the garden, where an outcome is a mean of 1,000 episodes."""
    result = pt.train(world, trials=2, until="queries:3", progress=False)
    assert [row["finished"] for row in result.trials] == [True, True]
    assert any(name.startswith(("outcome", "waterings")) for name in result.trials[0])


def test_a_callback_sees_every_tick_and_may_end_the_training() -> None:
    seen = []

    def stop_at_5(progress: pt.Progress) -> bool:
        seen.append(progress.tick)
        return progress.tick < 5

    result = pt.train("unsafe-exploration", callback=stop_at_5, progress=False)
    assert seen == [1, 2, 3, 4, 5]
    assert [(row["ticks"], row["finished"]) for row in result.trials] == [(5, False)]


def test_trials_that_have_not_begun_are_in_the_result() -> None:
    result = pt.train("unsafe-exploration", trials=4, callback=lambda now: now.tick < 5, progress=False)
    assert [(one["trial"], one["ticks"], one["finished"]) for one in result.trials] == [
        (0, 5, False),
        (1, 5, False),
        (2, 0, False),
        (3, 0, False),
    ]
    assert len(result.policies) == 4


@pytest.mark.slow
def test_a_callback_that_returns_nothing_ends_nothing(trained: pt.TrainResult) -> None:
    same = pt.train("unsafe-exploration", trials=3, seed=5, callback=lambda _: None, progress=False)
    assert same.trials == trained.trials


class Impatient:
    """Ctrl-C once so many trials are done, and a tracker that hears of the end."""

    def __init__(self, done: int) -> None:
        self.done, self.ended = done, list[str]()

    def __call__(self, now: pt.Progress) -> None:
        if now.done >= self.done:
            raise KeyboardInterrupt

    def begin(self, run: pt.TrackedRun) -> None: ...

    def log(self, run: str, step: int, values: Any) -> None: ...

    def end(self, run: str, reason: str) -> None:
        self.ended.append(reason)


@pytest.mark.parametrize("done", [0, 2, 5])
def test_ctrl_c_hands_out_the_trials_that_had_ended(done: int) -> None:
    """As they are in the whole result, and with nothing of those that were cut off."""
    arguments: dict[str, Any] = {"trials": 8, "until": "queries:6", "progress": False}
    whole, impatient, threads = (
        pt.train("unsafe-exploration", **arguments),
        Impatient(done),
        1 + torch.get_num_threads(),
    )
    torch.set_num_threads(threads)
    with pytest.raises(KeyboardInterrupt) as stop:
        pt.train("unsafe-exploration", callback=impatient, trackers=impatient, **arguments)
    assert torch.get_num_threads() == threads
    torch.set_num_threads(threads - 1)
    partial = stop.value.partial  # type: ignore[attr-defined]
    whole_batches = 4 * (done > 4)  # their trials have been told by then
    assert impatient.ended == ["It came to the end that was set: queries:6."] * whole_batches
    if not done:
        assert partial is None
        return
    numbers = [row["trial"] for row in partial.trials]
    assert len(numbers) >= done
    assert f"{len(numbers)} of 8 trials had ended" in stop.value.__notes__[0]
    assert partial.trials == [whole.trials[number] for number in numbers]
    assert partial.answers == [row for row in whole.answers if row["trial"] in numbers]
    for one in partial.policies:
        assert torch.equal(one.parameters, whole.policies[one.trial].parameters)


def test_the_number_of_threads_is_left_as_it_was() -> None:
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    try:
        pt.train("unsafe-exploration", until="ticks:1", progress=False)
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(before)


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        (
            {"world": "unsafe-explorations"},
            ValueError,
            ["world", "Did you mean 'unsafe-exploration'?"],
        ),
        ({"level": "islnd"}, ValueError, ["level", "islnd", "Did you mean 'island'?"]),
        ({"preset": "conservativ"}, ValueError, ["preset", "conservativ", "Did you mean 'conservative'?"]),
        ({"p_gid": 0.5}, TypeError, ["p_gid", "Did you mean 'p_guid'?"]),
        ({"p_guid": 2.0}, ValueError, ["p_guid=2.0", "less than or equal to 1"]),
        ({"lambda_global": 1e308}, ValueError, ["lambda_global: 1e+308 is more than 100: "]),
        ({"until": "soon"}, ValueError, ["until", "soon", "queries:N"]),
        ({"until": "queries:0"}, ValueError, ["until", "queries:0", "from 1 to"]),
        ({"world": "reward-hacking"}, ValueError, ["until", "no goal", "queries:1000"]),
        ({"until": "ticks:" + "9" * 5000}, ValueError, ["until", "from 1 to 1000000000"]),
        ({"until": 100}, ValueError, ["until", "100", "queries:N"]),
        ({"world": 3}, TypeError, ["world: 3", "unsafe-exploration"]),
        ({"preset": {"p_guid": 1.0}}, TypeError, ["preset", "p_guid", "Config"]),
        ({"trials": 0}, ValueError, ["trials", "0", "from 1"]),
        ({"seed": -1}, ValueError, ["seed", "-1", "from 0"]),
        ({"parent": "mother"}, ValueError, ["parent", "mother", "scripted, noisy"]),
        ({"world": "\nWWW\nWAW\nWWW\n"}, ValueError, ["world", "world: unsafe-exploration"]),
    ],
)
def test_what_is_wrong_is_named_with_its_value_and_the_remedy(
    arguments: dict[str, Any], error: type[Exception], words: list[str]
) -> None:
    with pytest.raises(error) as found:
        pt.train(**{"world": "unsafe-exploration", "progress": False, **arguments})
    assert [word for word in words if word not in str(found.value)] == []


class Silent(pt.Parent):
    def answer(self, question: pt.Question) -> None:
        """Say nothing."""


class NeverContent(pt.Parent):
    def answer(self, question: pt.Question) -> str:
        return "neither"


def test_the_representation_says_why_a_trial_is_not_finished() -> None:
    often: dict[str, Any] = {"p_guid": 1.0, "progress": False, "max_ticks": 20}
    silent = pt.train("unsafe-exploration", parent=Silent(), **often)
    assert "1 trial, 0 finished, 0 queries answered, 0 unsafe steps" in repr(silent)
    stuck = pt.train("unsafe-exploration", parent=NeverContent(), **often)
    assert "1 trial, 0 finished, 1 stuck, 0 unsafe steps" in repr(stuck)


def test_the_representation_is_one_short_line(trained: pt.TrainResult) -> None:
    for thing in (trained, trained.policies[0], trained.world):
        assert len(repr(thing)) < 110
        assert "\n" not in repr(thing)
