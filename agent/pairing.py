"""Pairs of recorded clips to ask about (Sec. 2.2): one of each kind, same start, other first actions.

Pairs are ordered by the completion of the later clip, then of the earlier, newest first. A clip's partners
that are older than itself only ever grow fewer. So once it has none it is *closed* for good, and a search
looks at open clips alone: over a run, every clip is closed at most once, and no search costs more as the
recorder fills.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Bool, Int64
from torch import Tensor

from parenting.agent.config import Config
from parenting.agent.guidance import View
from parenting.agent.query import Query, QueryKind
from parenting.agent.state import AgentState, Asked, Recorder, Ring
from parenting.envs.fingerprint import fingerprint, together, unordered
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import Stream

CAPACITY = 4096  # clips of each kind that the recorder holds
EXPLOIT, EXPLORE = 0, 1


class Pair(NamedTuple):
    """Places in the rings of the clips found, for some trials."""

    trial: Int64[Tensor, "n"]
    exploit: Int64[Tensor, "n"]
    explore: Int64[Tensor, "n"]


def store(
    world: Gridworld,
    recorder: Recorder,
    complete: Bool[Tensor, "N"],
    level: Int64[Tensor, "N"],
    tick: Int64[Tensor, "N"],
) -> Recorder:
    """File finished clips with their kind's ring; the newest overwrites the oldest. In place."""
    trial = complete.nonzero().squeeze(1)
    kind = recorder.next_kind[trial]
    ring = _room(recorder.ring)
    place = ring.count[trial, kind] % CAPACITY
    clip, length = recorder.clip.pick(trial), recorder.step[trial]
    at = (trial, kind, place)
    ring.board[at], ring.agent[at], ring.box[at] = clip.board, clip.agent, clip.box
    ring.action[at], ring.length[at], ring.level[at] = clip.action, length.to(torch.int8), level[trial]
    first = world.observe(clip.board[:, 0], clip.agent[:, 0].long(), clip.box[:, 0].long())
    ring.first[at] = fingerprint(first.flatten(1))
    ring.digest[at] = digest(clip.board, clip.agent, clip.box, clip.action, length, level[trial])
    ring.tick[at], ring.stored[at], ring.searchable[at] = tick[trial], True, True
    ring.count[trial, kind] += 1
    turn = torch.where(complete, 1 - recorder.next_kind, recorder.next_kind)
    return recorder.replace(ring=ring, running=recorder.running & ~complete, next_kind=turn)


def digest(
    board: Tensor, agent: Tensor, box: Tensor, action: Tensor, length: Tensor, level: Tensor
) -> Tensor:
    """A clip's fingerprint: true frames, agent, box, actions, length, level. Any leading axes."""
    parts = (board.flatten(-3), agent.flatten(-2), box.flatten(-2), action)
    return together(*map(fingerprint, parts), length.long(), level)


def forget(recorder: Recorder, mask: Bool[Tensor, "N"]) -> Recorder:
    """An empty recorder where `mask` holds; what was asked is remembered."""
    ring = recorder.ring
    keep = ~mask[:, None, None]
    return recorder.replace(
        running=recorder.running & ~mask,
        next_kind=recorder.next_kind.masked_fill(mask, EXPLOIT),
        ring=ring.replace(
            stored=ring.stored & keep,
            searchable=ring.searchable & keep,
            count=ring.count.masked_fill(mask[:, None], 0),
        ),
    )


def pair(
    world: Gridworld, config: Config, state: AgentState, view: View, steered: Bool[Tensor, "N"], query: Query
) -> tuple[AgentState, Query]:
    """After a step, with probability p_pref, ask about the newest pair (Sec. 2.2).

    Args:
        world: The world, which says what the agent saw in each frame.
        config: The hyperparameters; `p_pref` is read.
        state: N agents after the move.
        view: What each trial observed before the move.
        steered: Which trials chose their move.
        query: This tick's query, with the guidance that it asks for.

    Returns:
        The agents, who remember what this tick asks, guidance included, and the query with all questions.
    """
    trying = steered & view.supervised & (state.keys.uniform(Stream.PREFER) < config.p_pref)
    recorder = state.recorder
    found = _search(config, recorder, state.maturity, trying)
    if len(found.trial):
        at = _places(state, found)
        query = _ask(world, state, found, at, query)
        completed = state.info.completed.index_copy(0, found.trial, recorder.ring.tick[at])
        state = state.replace(info=state.info.replace(completed=completed))
        recorder.ring.stored[found.trial, EXPLOIT, found.exploit] = False
        recorder.ring.stored[found.trial, EXPLORE, found.explore] = False
    recorder = recorder.replace(asked=_remember(config, recorder.asked, query))
    return state.replace(recorder=recorder), query


def _search(
    config: Config, recorder: Recorder, maturity: Int64[Tensor, "N"], trying: Bool[Tensor, "N"]
) -> Pair:
    """Find the newest pair of each trial that tries; close every clip that turns out to have no partner."""
    ring = recorder.ring  # its fields are [N, 2, C]: two kinds of clips, C places
    trial = (trying & (ring.stored & ring.searchable).flatten(1).any(1)).nonzero().squeeze(1)  # [n]
    found: list[Tensor] = []
    while len(trial):  # each round looks at one clip of each trial: its newest that is not closed
        capacity = ring.tick.shape[2]  # C
        candidate = (ring.stored[trial] & ring.searchable[trial]).flatten(1)  # [n, 2 C]
        newest = torch.where(candidate, ring.tick[trial].flatten(1), -1).max(1)  # [n]
        later, kind = newest.indices % capacity, newest.indices // capacity  # [n], [n]: its place and kind
        partner = _partner(config, recorder, maturity, trial, kind, later)  # [n]: a place, or -1
        paired = partner >= 0  # [n]
        ring.searchable[trial[~paired], kind[~paired], later[~paired]] = False
        exploit, explore = (
            torch.where(kind == EXPLOIT, later, partner),
            torch.where(kind == EXPLOIT, partner, later),
        )
        found.append(torch.stack((trial, exploit, explore))[:, paired])  # [3, found in this round]
        trial = trial[~paired]  # the others look at their next clip
        trial = trial[(ring.stored[trial] & ring.searchable[trial]).flatten(1).any(1)]
    every = torch.cat(found, dim=1) if found else torch.zeros(3, 0, dtype=torch.int64, device=trying.device)
    return Pair(*every)


def _partner(
    config: Config,
    recorder: Recorder,
    maturity: Int64[Tensor, "N"],
    trial: Int64[Tensor, "n"],
    kind: Int64[Tensor, "n"],
    later: Int64[Tensor, "n"],
) -> Int64[Tensor, "n"]:
    """Find each clip's partner: the newest older clip of the other kind that makes a new pair with it.

    Both begin with the same observation, on the same level, with different actions.

    Args:
        config: The hyperparameters; `repeat_queries` and `own_stage_only` are read.
        recorder: The recorder of all N trials.
        maturity: The stage of all N trials.
        trial: The n trials that search.
        kind: The kind of their clip, `EXPLOIT` or `EXPLORE`.
        later: Its place in the ring of its kind.

    Returns:
        The partner's place in the ring of the other kind, or -1.
    """
    ring, other = recorder.ring, 1 - kind
    tick = ring.tick[trial, other]  # [n, C]
    first = ring.first[trial, kind, later][:, None]  # [n, 1]
    matches = ring.stored[trial, other] & (ring.first[trial, other] == first)  # [n, C]
    matches &= ring.action[trial, other, :, 0] != ring.action[trial, kind, later, 0][:, None]
    matches &= ring.level[trial, other] == ring.level[trial, kind, later][:, None]  # a query has one level
    matches &= tick < ring.tick[trial, kind, later][:, None]
    if not config.repeat_queries:
        row, place = matches.nonzero(as_tuple=True)  # [m], [m]: the m matches, by row of n and place of C
        clips = ring.digest[trial[row], other[row], place], ring.digest[trial, kind, later][row]  # [m], [m]
        word = same_pair(config, *clips, maturity[trial[row]])  # [m]
        matches[row, place] = ~(word[:, None] == recorder.asked.pair[trial[row]]).any(1)  # [m, Q] -> [m]
    newest = torch.where(matches, tick, -1).max(1)  # [n]
    return torch.where(newest.values >= 0, newest.indices, -1)


def _places(state: AgentState, found: Pair) -> tuple[Tensor, Tensor, Tensor]:
    """Where the clips lie, by side; the exploitative one is shown on the left by the toss of a coin.

    They index parts of the ring, [N, 2, C, ...], to [n, 2, ...].
    """
    trial = found.trial
    leftward = state.keys.uniform(Stream.PAIR_SIDES)[trial] < 0.5  # [n]
    kinds = torch.where(leftward[:, None], torch.tensor([EXPLOIT, EXPLORE]), torch.tensor([EXPLORE, EXPLOIT]))
    places = torch.stack((found.exploit, found.explore), 1).gather(1, kinds)  # [n, 2], as kinds: by side
    return trial[:, None], kinds, places


def _ask(
    world: Gridworld, state: AgentState, found: Pair, at: tuple[Tensor, Tensor, Tensor], query: Query
) -> Query:
    """The pair as a query."""
    ring, trial = state.recorder.ring, found.trial
    board, agent, box = ring.board[at], ring.agent[at].long(), ring.box[at].long()
    frames = {
        "board": board,
        "agent": agent,
        "box": box,
        "observation": _observations(world, board, agent, box, ring.length[at]),
    }
    parts = {
        **frames,
        "kind": torch.full_like(trial, QueryKind.PREFERENCE),
        "action": ring.action[at].long(),
        "length": ring.length[at].long(),
        "maturity": state.maturity[trial],
        "level": ring.level[trial, EXPLOIT, found.exploit],
    }
    return query.replace(
        **{name: getattr(query, name).index_copy(0, trial, part) for name, part in parts.items()}
    )


def _observations(world: Gridworld, board: Tensor, agent: Tensor, box: Tensor, length: Tensor) -> Tensor:
    """The observation of each frame; like all else, it is zero beyond a clip's length."""
    frame = torch.arange(board.shape[2], device=board.device)
    within = frame <= length[:, :, None]
    return world.observe(board, agent, box) * within[..., None, None]


def comparison(observation: Tensor, one: Tensor, other: Tensor, maturity: Tensor) -> Int64[Tensor, "..."]:
    """One word for: these two first actions were compared in this state at this stage."""
    return together(observation, (1 << one) + (1 << other), maturity)


def same_pair(config: Config, one: Tensor, other: Tensor, maturity: Tensor) -> Int64[Tensor, "..."]:
    """One word for a pair of clips in either order.

    With `own_stage_only` also for its stage: what another stage has compared is not in X, so it is not known.
    """
    word = unordered(one, other)
    return together(word, maturity) if config.own_stage_only else word


def _remember(config: Config, asked: Asked, query: Query) -> Asked:
    """Keep the digest of what is asked, guidance too, and which actions it compares where. In place."""
    trial = (query.kind != QueryKind.NONE).nonzero().squeeze(1)
    if not len(trial):
        return asked
    asked, query = _more(asked), query.pick(trial)
    place = asked.count[trial]
    clips = digest(query.board, query.agent, query.box, query.action, query.length, query.level[:, None])
    one, other = clips.unbind(1)
    asked.pair[trial, place] = same_pair(config, one, other, query.maturity)
    observation, first = fingerprint(query.observation[:, 0, 0].flatten(1)), query.action[:, :, 0]
    asked.compared[trial, place] = comparison(observation, first[:, 0], first[:, 1], query.maturity)
    asked.count[trial] += 1
    return asked


def _more(asked: Asked) -> Asked:
    size = asked.pair.shape[1]
    if int(asked.count.max()) < size:
        return asked
    return asked.replace(pair=_widen(asked.pair, 1, 2 * size), compared=_widen(asked.compared, 1, 2 * size))


def _room(ring: Ring) -> Ring:
    """Twice the room, up to CAPACITY, where one more clip would not fit."""
    size = ring.tick.shape[2]
    if size == CAPACITY or int(ring.count.max()) < size:
        return ring
    room = min(2 * size, CAPACITY)
    return ring.map(lambda _name, part, _axis: part if part.dim() == 2 else _widen(part, 2, room))


def _widen(part: Tensor, axis: int, size: int) -> Tensor:
    shape = list(part.shape)
    shape[axis] = size
    wide = part.new_zeros(shape)
    wide.narrow(axis, 0, part.shape[axis]).copy_(part)
    return wide
