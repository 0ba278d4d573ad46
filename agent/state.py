"""All that an agent is between two ticks. Checkpoints hold every field but `info`."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from jaxtyping import Bool, Float, Int8, Int64, UInt8
from torch import Tensor

from parenting.agent.dataset import Dataset
from parenting.envs.gridworld import WorldState
from parenting.envs.rng import Keys
from parenting.envs.struct import Struct

MOST_VOTES = 5
"""Votes on one pair in a pause at most; then the majority decides."""
PAIRS = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))
"""The pairs of two of the four actions, as guidance asks about them (Sec. 2.1)."""
_PAIRS = torch.tensor(PAIRS)


class Learner(Struct):
    """The policy that trains, pi_T, and Adam's state. `frozen` are pi_1 .. pi_{T-1} (Sec. 2.4)."""

    params: Float[Tensor, "N P"]
    exp_avg: Float[Tensor, "N P"]  # Adam's running mean of the gradient
    exp_avg_sq: Float[Tensor, "N P"]  # Adam's running mean of its square
    steps: Int64[Tensor, "N"]  # gradient steps of this stage
    owed: Bool[Tensor, "N"]  # all gradient steps of a tick but the first are still to be taken (`late_steps`)
    frozen: Float[Tensor, "M N P"]


class Rehearsal(Struct):
    """The state of pre-training during parenting: Adam's moments, and whether a step is owed (Sec. 3.1.4).

    P0 is P, or 0 in a run without pre-training.
    """

    exp_avg: Float[Tensor, "N P0"]  # Adam's running mean of the gradient
    exp_avg_sq: Float[Tensor, "N P0"]  # Adam's running mean of its square
    steps: Int64[Tensor, "N"]  # gradient steps
    owed: Bool[Tensor, "N"]  # the last tick trained


class RunningClip(Struct):
    """The clip that is being recorded."""

    board: UInt8[Tensor, "N T1 H W"]
    agent: Int8[Tensor, "N T1 2"]
    box: Int8[Tensor, "N T1 2"]
    action: Int8[Tensor, "N T"]


class Ring(Struct):
    """Finished clips of both kinds; the newest overwrite the oldest."""

    board: UInt8[Tensor, "N 2 C T1 H W"]
    agent: Int8[Tensor, "N 2 C T1 2"]
    box: Int8[Tensor, "N 2 C T1 2"]
    action: Int8[Tensor, "N 2 C T"]
    length: Int8[Tensor, "N 2 C"]
    level: Int64[Tensor, "N 2 C"]
    tick: Int64[Tensor, "N 2 C"]  # when the clip was completed
    first: Int64[Tensor, "N 2 C"]  # fingerprint of the first observation
    digest: Int64[Tensor, "N 2 C"]  # fingerprint of the whole clip
    stored: Bool[Tensor, "N 2 C"]  # stored, and not asked about yet
    searchable: Bool[Tensor, "N 2 C"]  # may still have an older partner
    count: Int64[Tensor, "N 2"]  # clips ever stored


class Asked(Struct):
    """Earlier comparisons: a word a query for the whole pair, one for (state, first actions, stage)."""

    pair: Int64[Tensor, "N Q"]
    compared: Int64[Tensor, "N Q"]
    count: Int64[Tensor, "N"]


class Recorder(Struct):
    """The running clip, and a ring of finished clips of each kind: 0 exploitative, 1 exploratory (Sec. 2.2).

    Only truth is stored; an observation is a function of it. `T1` is T + 1, for the longest clips of the run.
    """

    running: Bool[Tensor, "N"]
    next_kind: Int64[Tensor, "N"]  # the kind of the running clip, or of the next one
    step: Int64[Tensor, "N"]  # steps of the running clip
    clip: RunningClip
    ring: Ring
    asked: Asked


class Confirmation(Struct):
    """The votes on each pair of actions in this pause, as in `PAIRS`, and the tally of all repeats (ours)."""

    votes: Int64[Tensor, "N 6 V"]  # 1 + the class of each vote, in the order of asking; 0 for none
    mirrored: Bool[Tensor, "N 6"]  # the greater action stood left when the pair was last answered
    began: Int64[Tensor, "N"]  # the tick at which this pause, or the last one, began
    repeats: Int64[Tensor, "N"]  # votes after the first ones, on pairs that were decided
    dissents: Int64[Tensor, "N"]  # those of them that the decision overruled


class TickInfo(Struct):
    """The events of the last tick, for display.

    No part of the agent reads them, and no checkpoint holds them.
    """

    before: WorldState  # the world before the move
    action: Int64[Tensor, "N"]
    moved: Bool[Tensor, "N"]
    trained: Bool[Tensor, "N"]
    pausing: Bool[Tensor, "N"]  # a draw below p_guid ** f began a pause; where it asks again, none decided
    # of guidance that is asked
    familiarity: Int64[Tensor, "N"]  # f of the local state before this question
    logits: Float[Tensor, "N 4"]  # of the policy there
    completed: Int64[Tensor, "N 2"]  # of a preference: when each clip was completed, by side
    # Eq. (2) before the last gradient step, and each head's entropy in nats: means over the entries in it
    loss: Float[Tensor, "N"]
    entropy_global: Float[Tensor, "N"]
    entropy_local: Float[Tensor, "N"]


class AgentState(Struct):
    """One agent a trial."""

    keys: Keys
    world: WorldState
    maturity: Int64[Tensor, "N"]  # the stage T
    answered: Int64[Tensor, "N"]  # queries answered in this stage
    familiarity: Int64[Tensor, "N L"]  # guidance queries made in each local state
    waiting: Bool[Tensor, "N"]  # paused for guidance
    refused: Bool[Tensor, "N 4"]  # actions refused in this pause
    set_aside: Bool[Tensor, "N 6"]  # pairs of actions skipped in this pause, as in `PAIRS`
    confirmation: Confirmation
    x: Dataset
    recorder: Recorder
    learner: Learner
    rehearsal: Rehearsal
    info: TickInfo

    def __repr__(self) -> str:
        trials = len(self.waiting)
        return f"<AgentState of {trials} trial{'' if trials == 1 else 's'} at tick {int(self.keys.tick[0])}>"

    @property
    def all_refused(self) -> Bool[Tensor, "N"]:
        """Paused, and every action refused: *no acceptable action*."""
        return self.waiting & self.refused.all(1)

    @property
    def free_pairs(self) -> Bool[Tensor, "N 6"]:
        """The pairs of actions that may be asked about in this pause, as in `PAIRS`."""
        neither_refused = ~self.refused[:, _PAIRS.to(self.refused.device)].any(2)
        return neither_refused & ~self.set_aside

    @property
    def unsure(self) -> Bool[Tensor, "N"]:
        """Paused, and every pair of acceptable actions skipped: the parent cannot tell."""
        return self.waiting & ~self.refused.all(1) & ~self.free_pairs.any(1)


RENAMED = {
    "world.t": "world.step_count",
    "world.over": "world.terminated",
    "x.near": "x.local_state",
    "x.at": "x.state_index",
    "recorder.turn": "recorder.next_kind",
    "recorder.clip.ground": "recorder.clip.board",
    "recorder.ring.ground": "recorder.ring.board",
    "recorder.ring.here": "recorder.ring.stored",
    "recorder.ring.open": "recorder.ring.searchable",
    "learner.live": "learner.params",
    "learner.first": "learner.exp_avg",
    "learner.second": "learner.exp_avg_sq",
    "learner.elders": "learner.frozen",
    "rehearsal.first": "rehearsal.exp_avg",
    "rehearsal.second": "rehearsal.exp_avg_sq",
}
"""The names of tensors of the state in version 0.1, and their names today."""


def current_names(parts: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Stored tensors by the names that they have today, whichever version stored them.

    X of a version before 0.5 remembers no guidance (`agent.memory`).
    """
    named = {RENAMED.get(name, name): part for name, part in parts.items()}
    if "x.digest" in named and "x.guided" not in named:
        named["x.guided"] = named["x.digest"].new_zeros(*named["x.digest"].shape, 6, 4)
    return named
