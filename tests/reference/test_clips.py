"""The reference's recordings, preferences and maturation (Sec. 2.2, 2.4), in lives worked out by hand."""

import pytest
import torch

from reference.clips import Clip, Entry, Recorded
from reference.parenting import EXPLOIT, EXPLORE
from tests.reference.examples import (
    DOWN,
    ISLAND,
    LEFT,
    RIGHT,
    ROOM,
    UP,
    always,
    bias,
    born,
    completed,
    live,
    set_logits,
    world,
)

# ---- Eq. (3) to (6): recordings ----


def test_clips_of_one_step_alternate() -> None:
    trial = born(world(ROOM), p_rec=1)
    set_logits(trial.pi, (0, 1, 0, 0))
    live(trial, 20)
    exploit, explore = completed(trial, EXPLOIT), completed(trial, EXPLORE)
    assert [clip.tick for clip in exploit] == list(range(1, 20, 2))
    assert [clip.tick for clip in explore] == list(range(2, 21, 2))
    assert {clip.clip.actions for clip in exploit} == {(DOWN,)}  # Eq. (3)
    assert {clip.clip.actions for clip in explore} == {(UP,), (LEFT,), (RIGHT,)}  # Eq. (4)


def test_the_policy_of_a_move_counts_the_moves_to_go() -> None:
    trial = born(world(ROOM), p_rec=1, stages=3)
    trial.mature()
    trial.mature()
    for policy, action in zip(trial.policies, (UP, LEFT, DOWN), strict=True):  # pi_1, pi_2, pi_3
        always(policy, action)
    live(trial, 60)
    assert {clip.clip.actions for clip in completed(trial, EXPLOIT)} == {(DOWN, LEFT, UP)}  # Eq. (5)
    explore = {clip.clip.actions for clip in completed(trial, EXPLORE)}
    assert explore == {(UP, LEFT, UP), (LEFT, LEFT, UP), (RIGHT, LEFT, UP)}  # Eq. (6)


def test_death_ends_a_clip_early() -> None:
    trial = born(world(ISLAND), p_rec=1, stages=3)
    trial.mature()
    trial.mature()
    always(trial.pi, UP)
    (recorded,) = completed(live(trial, 1), EXPLOIT)
    assert (recorded.clip.actions, trial.turn) == ((UP,), EXPLORE)
    drowned = recorded.clip.frames[1]
    assert drowned.agent == (0, 1)
    assert drowned.observation == drowned.ground  # the agent is not drawn


@pytest.mark.parametrize(
    ("time_limit", "exploit", "explore"),
    [(5, [3, 13], [8, 18]), (6, [3, 9, 15], [6, 12, 18])],  # room for one clip in an episode, and for two
)
def test_no_clip_is_begun_that_the_time_limit_would_cut(
    time_limit: int, exploit: list[int], explore: list[int]
) -> None:
    trial = born(world(ROOM, time_limit=time_limit), p_rec=1, stages=3)
    trial.mature()
    trial.mature()
    for policy in trial.policies:
        always(policy, UP)
    live(trial, 18)
    assert [clip.tick for clip in completed(trial, EXPLOIT)] == exploit
    assert [clip.tick for clip in completed(trial, EXPLORE)] == explore


def test_a_clip_leaves_when_enough_have_come_after_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("reference.parenting.RING", 2)
    trial = live(born(world(ROOM), p_rec=1), 10)
    assert [clip.tick for clip in completed(trial, EXPLOIT)] == [7, 9]


# ---- 2.2: preferences ----


def test_nothing_is_compared_twice() -> None:
    trial = born(world(ROOM), p_rec=1, p_pref=1)
    always(trial.pi, UP)
    start = trial.frame(trial.state).observation
    live(trial, 120)
    moves = [(left.start, frozenset(left.actions + right.actions)) for _, _, left, right in trial.log]
    assert len(moves) == len(set(moves))
    assert {pair for s, pair in moves if s == start} == {frozenset((UP, a)) for a in (DOWN, LEFT, RIGHT)}
    assert trial.turn == EXPLORE  # and no exploratory clip is left to begin here


def test_the_papers_letter_compares_again() -> None:
    trial = born(world(ROOM), p_rec=1, p_pref=1, recompare=True)
    always(trial.pi, UP)
    assert len(live(trial, 100).log) > 20


def test_newest_pair_first() -> None:
    trial = born(world(ROOM), p_pref=1)
    frame = trial.frame(trial.state)
    ticks = {EXPLOIT: [1, 4, 5], EXPLORE: [2, 3, 6]}
    for kind, action in (EXPLOIT, UP), (EXPLORE, DOWN):
        for tick in ticks[kind]:  # told apart by their second frame
            after = frame._replace(agent=(tick, 0))
            trial.clips[kind].append(Recorded(tick, Clip(0, (frame, after), (action,))))
    for _ in range(4):
        trial.pair()
    asked = [sorted(clip.frames[1].agent[0] for clip in query[2:]) for query in trial.log]
    assert asked == [[5, 6], [3, 4], [1, 2]]


def test_the_later_clip_decides_before_the_earlier() -> None:
    trial = born(world(ROOM), p_pref=1)
    here = trial.frame(trial.state)
    there = here._replace(observation=here.ground)
    for kind, tick, state, action in (
        (EXPLOIT, 1, here, UP),
        (EXPLORE, 6, here, DOWN),
        (EXPLOIT, 4, there, UP),
        (EXPLORE, 5, there, DOWN),
    ):
        trial.clips[kind].append(Recorded(tick, Clip(0, (state, state), (action,))))
    trial.pair()
    assert trial.log[0][2].start == here.observation


def test_a_known_pair_is_skipped() -> None:
    trial = born(world(ROOM), p_pref=1)
    frame = trial.frame(trial.state)
    for tick in range(1, 5):  # twice the same two clips
        kind, action = (EXPLOIT, UP) if tick % 2 else (EXPLORE, DOWN)
        trial.clips[kind].append(Recorded(tick, Clip(0, (frame, frame), (action,))))
    for _ in range(2):
        trial.pair()
    assert len(trial.log) == 1
    assert [clip.tick for clip in completed(trial, EXPLOIT)] == [1]


def test_preferences_do_not_block() -> None:
    trial = born(world(ROOM), p_rec=1, p_pref=1)
    for _ in range(50):
        before = trial.state
        trial.tick()
        assert before.terminated or int(trial.state.step_count) == int(before.step_count) + 1
    assert trial.log


# ---- 2.4: maturation ----


def test_a_stage_ends_after_enough_answers_and_the_last_never() -> None:
    trial = born(world(ROOM), "neither", "left", p_guid=1, p_train=1, stages=2, mature_every=2)
    stages = [live(trial, 1).stage for _ in range(12)]
    assert stages == [1, 1] + 10 * [2]  # asked in ticks 1 and 2, heard in 2 and 3
    young, grown = trial.parameters()
    assert any(not torch.equal(a, b) for a, b in zip(young, grown, strict=True))
    assert {entry.maturity for entry in trial.X} == {1}  # guidance, at whatever stage


def test_each_stage_counts_its_own_answers() -> None:
    trial = born(world(ROOM), "left", p_guid=1, stages=3, mature_every=2)
    stages = [live(trial, 1).stage for _ in range(9)]
    assert stages == [1, 1, 1, 2, 2, 2, 2, 3, 3]  # an answer is heard in every second tick


def test_a_mature_policy_is_frozen() -> None:
    trial = live(born(world(ROOM), "left", p_guid=1, p_train=1, stages=2, mature_every=2), 4)
    assert trial.stage == 2
    young, grown = ([p.clone() for p in pi] for pi in trial.parameters())
    live(trial, 10)
    assert all(torch.equal(a, b) for a, b in zip(young, trial.parameters()[0], strict=True))
    assert any(not torch.equal(a, b) for a, b in zip(grown, trial.parameters()[1], strict=True))


def test_a_late_answer_keeps_the_stage_of_its_clips() -> None:
    trial = born(world(ROOM), "left", p_rec=1, p_pref=1)
    while trial.query is None:
        trial.tick()
    trial.mature()
    trial.tick()
    assert ([entry.maturity for entry in trial.X], trial.answered) == ([1], 0)


@pytest.mark.parametrize(("own_length", "trains"), [(True, False), (False, True)])
def test_own_length_leaves_out_what_earlier_stages_learnt(own_length: bool, trains: bool) -> None:
    trial = born(world(ROOM), p_train=1, own_length=own_length)
    trial.X.append(Entry(trial.frame(trial.state).observation, (0, 1), (1, 0), 1))
    trial.mature()
    live(trial, 1)
    assert bool(bias(trial.pi.far).any()) == trains
