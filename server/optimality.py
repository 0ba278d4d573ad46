"""The verdict that ends a run once its policy is optimal: its ticks alone decide, and not the clock.

A batch judges after the same ticks (`experiments.training.batch`), so both end at the same one.
"""

from __future__ import annotations

from parenting.agent.state import AgentState
from parenting.evaluation.argmax import Evaluation
from parenting.server.finishes import Finish
from parenting.server.snapshot import Snapshot


class Optimality:
    """The verdict on the policy of one run.

    Where a look at the policy is expensive, as in the garden, the last row of metrics decides.
    """

    def __init__(self, finish: Finish, evaluation: Evaluation, state: AgentState, known: bool) -> None:
        """Begin after the last tick that has passed.

        Args:
            finish: The rule that ends the run.
            evaluation: The evaluation of its world.
            state: The agent after that tick.
            known: The verdict of the last row of metrics. It counts where no tick is judged by itself;
                elsewhere it may be that of a later tick than the state's.
        """
        self._finish, self._evaluation = finish, evaluation
        self._looks = finish.kind == "optimal" and not evaluation.refresh_seconds
        self._owed = _owes(state)
        begun = int(state.keys.tick[0]) > 0
        self.found = begun and self._is_optimal(state) if self._looks else known

    def see(self, state: AgentState) -> None:
        """Judge after a tick that may have changed the policy, and after the first."""
        changed = self._owed or bool(state.info.trained[0]) or int(state.keys.tick[0]) == 1
        self._owed = _owes(state)
        if self._looks and changed:
            self.found = self._is_optimal(state)

    def measured(self, optimal: bool) -> None:
        """Take the verdict of a row of metrics, where no tick is judged by itself."""
        if not self._looks:
            self.found = optimal

    def ends(self, saved: Snapshot) -> bool:
        """Return whether the rule ends the run after its last tick."""
        heard, state = int(saved.tally.kinds.sum()), saved.state
        stage, in_stage = int(state.maturity[0]), int(state.answered[0])
        return self._finish.is_met(self.found, heard, stage, in_stage, saved.config)

    def _is_optimal(self, state: AgentState) -> bool:
        return bool(self._evaluation.optimal(state.learner.params)[0])


def _owes(state: AgentState) -> bool:
    """Return whether the next tick takes steps that an earlier one owes."""
    return bool((state.rehearsal.owed | state.learner.owed)[0])
