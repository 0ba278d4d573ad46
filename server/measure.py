"""One row of metrics: what the dashboard draws."""

from __future__ import annotations

from agent.query import Choice, Kind
from parents.evaluation import Evaluation
from server.checkpoint import Saved


def measure(saved: Saved, evaluation: Evaluation) -> dict[str, float | int | None]:
    """Counts since birth, the last gradient step, and what the argmax policy does from the start.

    `loss` and the entropies are null before the first gradient step, and after a tick that took none.
    """
    state, tally = saved.state, saved.tally
    report, live = state.report, state.learner.live
    trained = bool(report.trained[0])
    return {
        "deaths": int(tally.deaths[0]),
        "episodes": int(tally.episodes[0]),
        "guidance": int(tally.kinds[0, Kind.GUIDANCE]),
        "preference": int(tally.kinds[0, Kind.PREFERENCE]),
        **{choice.name.lower(): int(tally.choices[0, choice]) for choice in Choice if choice != Choice.NONE},
        "loss": float(report.loss[0]) if trained else None,
        "entropy_global": float(report.entropy_global[0]) if trained else None,
        "entropy_local": float(report.entropy_local[0]) if trained else None,
        "return": float(evaluation.returns(live)[0]),
        "optimal_return": evaluation.best(),
        "optimal": int(evaluation.optimal(live)[0]),
        "size": int(state.x.size[0]),
        "rows": int(state.x.rows[0]),
        "maturity": int(state.maturity[0]),
    }
