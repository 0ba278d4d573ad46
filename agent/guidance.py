"""Guidance: in unfamiliar surroundings the agent pauses and asks before it moves (Sec. 2.1)."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import torch
from jaxtyping import Bool, Float, Int64, UInt8
from torch import Tensor

from parenting.agent import candidates, confirmation, dataset, familiarity, memory, relabelling
from parenting.agent.config import Config
from parenting.agent.dataset import Entry
from parenting.agent.query import Answer, Choice, Query, QueryKind
from parenting.agent.state import PAIRS, AgentState
from parenting.envs.gridworld import Gridworld, WorldState, local_state
from parenting.envs.rng import Stream
from parenting.envs.struct import Struct

NO_ACTION = -1
_RANKED = torch.tensor(PAIRS)  # pairs of ranks in their order: the two best first


class View(Struct):
    """Each trial's observation and policy at this tick.

    The policy does not change between asking and acting: it is asked for its logits at most once, and not at
    all where nobody reads them, such as in a tick that waits, or performs the move that the parent approved.
    """

    observation: UInt8[Tensor, "N H W"]
    local_state: UInt8[Tensor, "N 4"]
    policy: Callable[[], Float[Tensor, "N 4"]]  # its logits there
    active: Bool[Tensor, "N"]  # not frozen: what it does makes a difference
    supervised: Bool[Tensor, "N"]  # active, and a supervisor is present: only then may it ask (Sec. 3.2.5)

    @cached_property
    def logits(self) -> Float[Tensor, "N 4"]:
        """The logits of the policy there."""
        return self.policy()


class Heard(Struct):
    """The effect of this tick's answers on the pause."""

    approved: Int64[Tensor, "N"]  # the action to perform, or NO_ACTION
    redraw: Bool[Tensor, "N"]  # *neither*, *skip*, not confirmed: ask once more in this same tick


def hear(config: Config, state: AgentState, view: View, answer: Answer) -> tuple[AgentState, Heard]:
    """Answers enter X (Eq. 1, 2); guidance approves an action, refuses both, or is asked again."""
    query, choice = answer.query, answer.choice
    if not bool((choice != Choice.NONE).any()):
        return state, _nothing_heard(state)
    told = (query.kind == QueryKind.GUIDANCE) & (choice != Choice.NONE) & at_place(state, query)
    state, told = learn(config, state, answer), told & state.waiting
    if config.confirm:
        state, choice, told = confirmation.tally(config, state, view.logits, answer, told)
    return _resolve(state, query, choice, told)


def learn(config: Config, state: AgentState, answer: Answer) -> AgentState:
    """Answers enter X (Eq. 1, 2) and are counted, and nothing else happens."""
    guided, reviewed = counted(answer)
    now = guided | (reviewed & (answer.query.maturity == state.maturity))
    return state.replace(x=store(config, state, answer), answered=state.answered + now)


def counted(answer: Answer) -> tuple[Bool[Tensor, "N"], Bool[Tensor, "N"]]:
    """Return where guidance was answered, and where a preference was; a skip answers neither."""
    kind, judged = answer.query.kind, answer.judges
    return (kind == QueryKind.GUIDANCE) & judged, (kind == QueryKind.PREFERENCE) & judged


def at_place(state: AgentState, query: Query) -> Bool[Tensor, "N"]:
    """Return where the world is as it was when a query was asked: no move is approved for another place."""
    board = (query.board[:, 0, 0] == state.world.board).flatten(1).all(1)
    agent = (query.agent[:, 0, 0] == state.world.agent).all(1)
    return board & agent & (query.box[:, 0, 0] == state.world.box).all(1)


def moves_of(query: Query) -> Bool[Tensor, "N 4"]:
    """Return the two moves that a guidance query asks about."""
    return torch.nn.functional.one_hot(query.action[:, :, 0], 4).sum(1) > 0


def _nothing_heard(state: AgentState) -> Heard:
    return Heard(approved=torch.full_like(state.answered, NO_ACTION), redraw=torch.zeros_like(state.waiting))


def store(config: Config, state: AgentState, answer: Answer) -> dataset.Dataset:
    """X with the answers of this tick: Eq. (1), at the first state of the clips.

    *Neither* and *skip* add no entry. Guidance is remembered where the config asks for it.
    """
    query, choice = answer.query, answer.choice
    first = query.observation[:, 0, 0]
    learnt = (query.kind != QueryKind.NONE) & answer.judges & (choice != Choice.NEITHER)
    remembered = (query.kind == QueryKind.GUIDANCE) & answer.judges & config.remembers
    if not bool((learnt | remembered).any()):
        return state.x
    of_stage = query.maturity == state.maturity if config.own_stage_only else torch.ones_like(learnt)
    entry = Entry(
        s0=first, local_state=local_state(first, query.agent[:, 0, 0]), a0=query.action[:, :, 0], mu=answer.mu
    )
    x = dataset.add(state.x, entry, learnt, of_stage)
    if not bool(remembered.any()):
        return x
    return memory.remember(config, x, entry, choice, remembered & of_stage)


def _resolve(state: AgentState, query: Query, choice: Tensor, guided: Tensor) -> tuple[AgentState, Heard]:
    if not bool(guided.any()):
        return state, _nothing_heard(state)
    left, right = query.action[:, 0, 0], query.action[:, 1, 0]
    coin = state.keys.uniform(Stream.EITHER) < 0.5
    leftward = (choice == Choice.LEFT) | ((choice == Choice.EITHER) & coin)
    refusing, skipping = guided & (choice == Choice.NEITHER), guided & (choice == Choice.SKIP)
    again = guided & (choice == Choice.NONE)  # not confirmed
    approving = guided & ~refusing & ~skipping & ~again
    refused = (state.refused | (refusing[:, None] & moves_of(query))) & ~approving[:, None]
    set_aside = state.set_aside & ~approving[:, None]
    if bool(skipping.any()):
        set_aside = set_aside | (skipping[:, None] & confirmation.pair_of(query))
    approved = torch.where(approving, torch.where(leftward, left, right), NO_ACTION)
    state = state.replace(waiting=state.waiting & ~approving, refused=refused, set_aside=set_aside)
    return state, Heard(approved=approved, redraw=(refusing | skipping | again) & state.free_pairs.any(1))


def ask(
    world: Gridworld, config: Config, state: AgentState, view: View, heard: Heard, query: Query
) -> tuple[AgentState, Heard, Query]:
    """Pause with probability p_guid ** f(l(s)) and ask about 2 distinct actions drawn from pi.

    After *neither*, draw two other actions; after *skip*, another pair. Where earlier answers decide
    (`reuse_answers`), the move counts as approved, and nothing is asked.

    Args:
        world: The world, which forecasts both moves.
        config: The hyperparameters; `p_guid` is read.
        state: N agents.
        view: What each trial observes, and its policy there.
        heard: What this tick's answers mean: who has an approved action, who has to ask again.
        query: The empty query of this tick.

    Returns:
        The agents, paused where they ask; what was heard, with the moves that earlier answers approve; and
        the query with their questions.
    """
    undecided = view.supervised & ~state.waiting & (heard.approved == NO_ACTION)
    if not bool((undecided | heard.redraw).any()):
        return state, heard, query
    where = familiarity.local_state_index(view.local_state, len(world.legend))
    f = state.familiarity.gather(1, where[:, None]).squeeze(1)
    pausing = undecided & (state.keys.uniform(Stream.ASK) < familiarity.ask_chance(f, config.p_guid))
    asking = pausing | heard.redraw
    if not bool(asking.any()):
        return state, heard, query
    found = candidates.choose(config, state, view.observation, view.logits)
    if config.relabel and config.reuse_answers:
        found = relabelling.doubt(state, view.observation, found)
    decided = asking & found.decided & ~confirmation.unsettled(state).any(1)
    state, heard = _reuse(state, heard, found.move, decided)
    asking = asking & ~decided
    new = asking
    if config.confirm:
        state, new = confirmation.begin(state, pausing), asking & ~confirmation.unsettled(state).any(1)
    state = state.replace(
        familiarity=familiarity.count(state.familiarity, where, new),
        waiting=state.waiting | asking,
        info=state.info.replace(pausing=pausing, familiarity=f, logits=view.logits),
    )
    return state, heard, _question(world, config, state, found.pair, asking, query)


def _reuse(
    state: AgentState, heard: Heard, move: Int64[Tensor, "N"], decided: Bool[Tensor, "N"]
) -> tuple[AgentState, Heard]:
    """Approve the moves that earlier answers decide for: a pause ends as if they had been answered."""
    if not bool(decided.any()):
        return state, heard
    calm = {name: getattr(state, name) & ~decided[:, None] for name in ("refused", "set_aside")}
    kept = state.confirmation.replace(votes=state.confirmation.votes.masked_fill(decided[:, None, None], 0))
    state = state.replace(waiting=state.waiting & ~decided, confirmation=kept, **calm)
    approved = torch.where(decided, move, heard.approved)
    return state, Heard(approved=approved, redraw=heard.redraw & ~decided)


def _question(
    world: Gridworld,
    config: Config,
    state: AgentState,
    pair: Int64[Tensor, "N 2"],
    asking: Bool[Tensor, "N"],
    query: Query,
) -> Query:
    """The two moves as clips of length 1: where the agent stands, and the forecast of each move."""
    sides = torch.where(state.keys.uniform(Stream.SIDES)[:, None] < 0.5, pair, pair.flip(1))
    votes = query.votes
    if config.confirm:
        sides, votes = confirmation.mirror(state, sides)
    before = [state.world, state.world]
    after = [world.forecast(state.world, sides[:, side]) for side in (0, 1)]
    asked = query.replace(
        kind=torch.full_like(query.kind, QueryKind.GUIDANCE),
        maturity=torch.ones_like(query.maturity),
        level=state.world.level,
        action=_first(query.action, sides),
        length=torch.ones_like(query.length),
        votes=votes,
        **_frames(world, query, before, after),
    )
    return asked.where(asking, query)


def _first(action: Tensor, sides: Tensor) -> Tensor:
    action = torch.zeros_like(action)
    action[:, :, 0] = sides
    return action


def _frames(
    world: Gridworld, query: Query, before: list[WorldState], after: list[WorldState]
) -> dict[str, Tensor]:
    board, agent, box = map(torch.zeros_like, (query.board, query.agent, query.box))
    for time, states in enumerate((before, after)):
        board[:, :, time] = torch.stack([state.board for state in states], 1)
        agent[:, :, time] = torch.stack([state.agent for state in states], 1)
        box[:, :, time] = torch.stack([state.box for state in states], 1)
    observation = torch.zeros_like(query.observation)
    observation[:, :, :2] = world.observe(board[:, :, :2], agent[:, :, :2], box[:, :, :2])
    return {"board": board, "agent": agent, "box": box, "observation": observation}
