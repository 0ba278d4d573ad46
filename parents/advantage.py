"""The advantage by which the scripted parent compares clips (Sec. 3.1.3, Eq. 7 and 8)."""

from __future__ import annotations

import torch
from jaxtyping import Float64, Int64
from torch import Tensor

from parenting.agent.query import Query
from parenting.envs.mdp import Model
from parenting.parents.value_iteration import ValueTable


def advantage(model: Model, values: ValueTable, query: Query) -> Float64[Tensor, "N 2"]:
    """Eq. (7): alpha = sum_t gamma^t [Q_p(s_t, a_t) - V_p(s_t)] of both clips, each to its length."""
    at = clip_states(model, query)[:, :, :-1]
    gain = values.q[at].gather(-1, query.action[..., None]).squeeze(-1) - values.v[at]
    step = torch.arange(gain.shape[2], device=gain.device)
    return (gain * values.gamma ** step.double() * (step < query.length[..., None])).sum(-1)


def advantage_from_rewards(model: Model, values: ValueTable, query: Query) -> Float64[Tensor, "N 2"]:
    """Eq. (8): sum_t gamma^t r_t + gamma^T V_p(s_T) - V_p(s_0).

    In a deterministic world it equals Eq. (7).
    """
    at = clip_states(model, query)
    step = torch.arange(at.shape[2] - 1, device=at.device)
    reward = model.reward[at[:, :, :-1]].gather(-1, query.action[..., None]).squeeze(-1)
    earned = (reward * values.gamma ** step.double() * (step < query.length[..., None])).sum(-1)
    last = at.gather(2, query.length[..., None]).squeeze(-1)
    return earned + values.gamma ** query.length.double() * values.v[last] - values.v[at[:, :, 0]]


def clip_states(model: Model, query: Query) -> Int64[Tensor, "N 2 T1"]:
    """Return the model's states of both clips' frames.

    Beyond a clip's length, and where nothing is asked, it is the first state.
    """
    frame = torch.arange(query.board.shape[2], device=query.kind.device)
    real = (frame <= query.length[..., None]) & (query.kind > 0)[:, None, None]
    at = torch.zeros_like(real, dtype=torch.int64)
    level = query.level[:, None, None].expand(real.shape)[real]
    at[real] = model.find(query.board[real], query.agent[real], query.box[real], level)
    return at
