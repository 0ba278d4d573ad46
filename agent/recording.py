"""Recording: how the agent acts, and which clips of it it keeps (Sec. 2.2 and 2.4, Eq. 3 to 6).

Which finished clips make a pair is the business of `agent.pairing`.
"""

from __future__ import annotations

import torch
from jaxtyping import Bool, Int64
from torch import Tensor

from parenting.agent import pairing
from parenting.agent.config import Config
from parenting.agent.guidance import NO_ACTION, Heard, View
from parenting.agent.pairing import EXPLORE, comparison
from parenting.agent.policy import Network, draw
from parenting.agent.state import AgentState, Recorder, RunningClip
from parenting.envs.fingerprint import fingerprint
from parenting.envs.gridworld import Gridworld, WorldState
from parenting.envs.rng import Stream, gumbel


def act(
    world: Gridworld, network: Network, config: Config, state: AgentState, view: View, heard: Heard
) -> tuple[AgentState, Bool[Tensor, "N"]]:
    """Perform the approved action, the recording's next one, or one drawn from pi_T.

    Args:
        world: The world, which moves on where the agent is not paused.
        network: The policy's architecture.
        config: The hyperparameters; `p_rec` is read.
        state: N agents.
        view: What each trial observes, and its policy there.
        heard: The actions that the parent approved in this tick.

    Returns:
        The agents after the move, and which trials chose it: neither paused nor frozen.
    """
    moving = ~state.waiting
    if not bool(moving.any()):
        broken = state.recorder.replace(running=moving)
        return state.replace(recorder=broken), moving
    recorder, begun = _begin(config, world, state, view, heard)
    action = _action(network, config, state.replace(recorder=recorder), view, heard, begun)
    before = state.world
    after = world.step(before, action, state.keys).where(moving, before)
    recorder = _record(world, state, recorder, action, after)
    info = state.info.replace(before=before, action=action, moved=moving)
    return state.replace(world=after, recorder=recorder, info=info), moving & view.active


def _begin(
    config: Config, world: Gridworld, state: AgentState, view: View, heard: Heard
) -> tuple[Recorder, Int64[Tensor, "N"]]:
    """Drop clips that a pause, an approved move or an absence broke, and begin new ones.

    The result holds the first actions of the clips that begin.
    """
    recorder, keys = state.recorder, state.keys
    free = view.supervised & ~state.waiting & (heard.approved == NO_ACTION)
    running = recorder.running & free
    idle = free & ~running
    fits = world.time_limit - state.world.step_count >= state.maturity
    wanted = idle & fits & (keys.uniform(Stream.RECORD) < config.p_rec)
    if not bool(wanted.any()):
        return recorder.replace(running=running), torch.full_like(recorder.next_kind, NO_ACTION)
    first = best = view.logits.argmax(1)
    exploring = recorder.next_kind == EXPLORE
    if bool((wanted & exploring).any()):
        permitted = _permitted(config, state, view, best)
        noise = gumbel(keys.uniform(Stream.EXPLORE, 4)).masked_fill(~permitted, -torch.inf)
        first = torch.where(exploring, draw(view.logits, noise), best)
        wanted = wanted & (~exploring | permitted.any(1))
    recorder = recorder.replace(running=running | wanted, step=recorder.step.masked_fill(wanted, 0))
    return recorder, torch.where(wanted, first, NO_ACTION)


def _permitted(
    config: Config, state: AgentState, view: View, best: Int64[Tensor, "N"]
) -> Bool[Tensor, "N 4"]:
    """The permitted first actions of an exploratory clip.

    They exclude the argmax (Eq. 4) and actions already compared with it in this state at this stage.
    """
    actions = torch.arange(4, device=best.device)
    permitted = actions != best[:, None]
    if config.repeat_queries:
        return permitted
    observation = fingerprint(view.observation.flatten(1))[:, None]
    words = comparison(observation, actions, best[:, None], state.maturity[:, None])
    asked = state.recorder.asked
    return permitted & ~(words[:, :, None] == asked.compared[:, None, :]).any(2)


def _action(
    network: Network, config: Config, state: AgentState, view: View, heard: Heard, begun: Int64[Tensor, "N"]
) -> Int64[Tensor, "N"]:
    action = torch.maximum(heard.approved, begun)  # never both
    if bool((action == NO_ACTION).any()):
        drawn = draw(view.logits, gumbel(state.keys.uniform(Stream.ACT, 4)))
        action = torch.where(action == NO_ACTION, drawn, action)
    if config.max_clip_length == 1:
        return action
    # Eq. (5), (6): move t of a clip is the argmax of pi_{T-t}, so that the last is always pi_1's
    trial = (state.recorder.running & (state.recorder.step > 0)).nonzero().squeeze(1)
    if not len(trial):
        return action
    age = (state.maturity - state.recorder.step)[trial]
    logits = network.logits(
        state.learner.frozen[age - 1, trial], view.observation[trial], view.local_state[trial]
    )
    return action.index_put((trial,), logits.argmax(1))


def _record(
    world: Gridworld, state: AgentState, recorder: Recorder, action: Int64[Tensor, "N"], after: WorldState
) -> Recorder:
    """Write this step into the running clips; file those that are complete, by length or by an early end."""
    trial = recorder.running.nonzero().squeeze(1)
    if not len(trial):
        return recorder
    step = recorder.step[trial]
    _write(recorder.clip, trial, step, state.world, action, after)
    ended = after.terminated | world.frozen(after)
    complete = recorder.running & (ended | (recorder.step + 1 >= state.maturity))
    recorder = recorder.replace(step=recorder.step + recorder.running)
    if not bool(complete.any()):
        return recorder
    return pairing.store(world, recorder, complete, state.world.level, state.keys.tick)


def _write(
    clip: RunningClip,
    trial: Int64[Tensor, "n"],
    step: Int64[Tensor, "n"],
    before: WorldState,
    action: Int64[Tensor, "N"],
    after: WorldState,
) -> None:
    first = step == 0
    fresh = trial[first]
    for part in (clip.board, clip.agent, clip.box, clip.action):
        part[fresh] = 0  # what lies beyond a clip's length is zero, whatever was recorded before
    _frame(clip, fresh, step[first], before)
    clip.action[trial, step] = action[trial].to(torch.int8)
    _frame(clip, trial, step + 1, after)


def _frame(
    clip: RunningClip, trial: Int64[Tensor, "n"], place: Int64[Tensor, "n"], world: WorldState
) -> None:
    clip.board[trial, place] = world.board[trial]
    clip.agent[trial, place] = world.agent[trial].to(torch.int8)
    clip.box[trial, place] = world.box[trial].to(torch.int8)
