"""Transfer of what agents have learnt to other levels (Sec. 3.4).

Either their policies alone, as after pre-training; or all that they have learnt: the policy with Adam's
state, X, the familiarity with local states, and what was compared. Clips of levels that they will not see
again stay behind in any case, and so does the episode that they were in.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence

import torch
from jaxtyping import Int64
from torch import Tensor

from parenting.agent.dataset import Dataset
from parenting.agent.state import AgentState, Asked, Learner, Rehearsal, current_names
from parenting.envs.struct import Struct

POLICY = "learner.params"


class Transferred(Struct):
    """The part of an agent that is transferred."""

    learner: Learner
    rehearsal: Rehearsal
    x: Dataset
    familiarity: Int64[Tensor, "N L"]
    asked: Asked


def transferred(state: AgentState) -> Transferred:
    """Return what the agents of a state have learnt."""
    return Transferred(
        learner=state.learner,
        rehearsal=state.rehearsal,
        x=state.x,
        familiarity=state.familiarity,
        asked=state.recorder.asked,
    )


def pack(what: Transferred, everything: bool) -> str:
    """As text, bit for bit, to stand in a row of plain data; the policy alone, or everything."""
    kept = {name: part.cpu().clone() for name, part in what.tensors().items() if everything or name == POLICY}
    blob = io.BytesIO()
    torch.save(kept, blob)
    return base64.b64encode(blob.getvalue()).decode("ascii")


def transfer(
    state: AgentState, packed: Sequence[str], agent: Int64[Tensor, "N"], everything: bool
) -> AgentState:
    """Trials at tick 0 that each go on from one of the packed agents.

    Raises:
        KeyError: too little was packed.
    """
    parts = [_unpack(text, agent.device) for text in packed]
    if not everything:
        live = torch.cat([part[POLICY] for part in parts]).index_select(0, agent)
        return state.replace(learner=state.learner.replace(params=live))
    mine = transferred(state).map(
        lambda name, _tensor, axis: _together([part[name] for part in parts], axis or 0)
    )
    mine = mine.pick(agent)
    return state.replace(
        learner=mine.learner,
        rehearsal=mine.rehearsal,
        x=mine.x,
        familiarity=mine.familiarity,
        recorder=state.recorder.replace(asked=mine.asked),
    )


def _unpack(text: str, device: torch.device) -> dict[str, Tensor]:
    blob = io.BytesIO(base64.b64decode(text))
    return current_names(torch.load(blob, map_location=device, weights_only=True))


def _together(parts: Sequence[Tensor], axis: int) -> Tensor:
    """Agents beside each other. X and the like have room for the fullest: what lies beyond is zero anyway."""
    sizes = torch.tensor([part.shape for part in parts]).amax(0).tolist()
    room = [part.new_zeros([*sizes[:axis], part.shape[axis], *sizes[axis + 1 :]]) for part in parts]
    for wide, part in zip(room, parts, strict=True):
        wide[tuple(slice(size) for size in part.shape)] = part
    return torch.cat(room, axis)
