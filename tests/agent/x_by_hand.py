"""X as plain numbers, and the same from the answers alone (Sec. 2.3)."""

from __future__ import annotations

from collections.abc import Sequence

from parenting.agent.query import Answer, Choice
from parenting.agent.state import AgentState


def entries(state: AgentState) -> dict[tuple[bytes, int, int], float]:
    """The summed mu of each first action against the other, at each first state."""
    x, found = state.x, dict[tuple[bytes, int, int], float]()
    for row in range(int(x.rows[0])):
        s0 = bytes(x.s0[0, x.state_index[0, row]].flatten().tolist())
        one, other = x.a0[0, row].tolist()
        found[s0, one, other] = float(x.mu[0, row, 0])
        found[s0, other, one] = float(x.mu[0, row, 1])
    return found


def summed(answers: Sequence[Answer], stage: int | None) -> dict[tuple[bytes, int, int], float]:
    """The same from the answers alone; with a stage, from those of that stage."""
    found = dict[tuple[bytes, int, int], float]()
    for answer in answers:
        query = answer.query
        if answer.choice[0] in (Choice.NEITHER, Choice.SKIP) or (
            stage is not None and int(query.maturity[0]) != stage
        ):
            continue
        s0 = bytes(query.observation[0, 0, 0].flatten().tolist())
        one, other = query.action[0, :, 0].tolist()
        for side, pair in enumerate([(one, other), (other, one)]):
            found[(s0, *pair)] = found.get((s0, *pair), 0.0) + float(answer.mu[0, side])
    return found
