"""One row of metrics, as the dashboard draws it."""

from __future__ import annotations

from parenting.agent.query import QueryKind
from parenting.evaluation.argmax import Evaluation
from parenting.server.codec import CHOICES
from parenting.server.snapshot import Snapshot

Row = dict[str, float | int | None]

NOTHING_LEARNT: Row = {"loss": None, "entropy_global": None, "entropy_local": None}
"""Before the first gradient step."""


def learnt(saved: Snapshot) -> Row:
    """Return loss (Eq. 2) and both entropies of the last gradient step, means over the entries of X."""
    report = saved.state.info
    return {name: float(getattr(report, name)[0]) for name in NOTHING_LEARNT}


def measure(saved: Snapshot, evaluation: Evaluation) -> Row:
    """Counts since initial_snapshot, and what the argmax policy does from the start."""
    state, tally = saved.state, saved.tally
    live = state.learner.params
    return {
        "deaths": int(tally.deaths[0]),
        "episodes": int(tally.episodes[0]),
        "guidance": int(tally.kinds[0, QueryKind.GUIDANCE]),
        "preference": int(tally.kinds[0, QueryKind.PREFERENCE]),
        **{name: int(tally.choices[0, choice]) for name, choice in CHOICES.items() if name != "skip"},
        "skips": int(tally.skips[0]),
        "return": float(evaluation.returns(live)[0]),
        "optimal_return": evaluation.best(),
        "optimal": int(evaluation.optimal(live)[0]),
        "size": int(state.x.size[0]),
        "rows": int(state.x.rows[0]),
        "maturity": int(state.maturity[0]),
        "stage_queries": int(state.answered[0]),
    }
