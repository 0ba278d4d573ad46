"""The rest that Ctrl-C leaves of a training: its exception carries the trials that had ended by then."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from parenting.experiments.training import batch
from parenting.experiments.training.batch import BatchTrainer

if TYPE_CHECKING:
    from parenting.library.result import TrainResult

Collect = Callable[[Sequence[batch.TrainResult], Sequence[int]], "TrainResult"]
"""Makes a result of parts of a run and the numbers of their trials."""


class Batches:
    """The batches of a run: results of those that have ended, and the one that is trained."""

    def __init__(self, trials: int) -> None:
        self.trials = trials
        self.ended: list[batch.TrainResult] = []
        self._live: tuple[range, BatchTrainer] | None = None

    def begun(self, chunk: range, trainer: BatchTrainer) -> None:
        """Note the batch that is trained from here on."""
        self._live = chunk, trainer

    @contextmanager
    def kept(self, collect: Collect) -> Iterator[None]:
        """Let Ctrl-C through, with the trials that had ended as its attribute `partial`, None without any.

        A tick may have been cut in half, so the other trials of its batch are left out.
        """
        try:
            yield
        except KeyboardInterrupt as stop:
            parts, numbers = self._whole()
            partial = collect(parts, numbers) if numbers else None
            stop.partial = partial  # type: ignore[attr-defined]  # else Python would exit with another code
            stop.add_note(
                f"{len(numbers)} of {self.trials} trials had ended; the exception's attribute `partial` holds"
                f" {'their result' if numbers else 'None'}."
            )
            raise

    def _whole(self) -> tuple[list[batch.TrainResult], list[int]]:
        numbers = list(range(sum(len(part.counts.ticks) for part in self.ended)))
        if self._live is None or self._live[0].start < len(numbers):
            return self.ended, numbers
        chunk, trainer = self._live
        done = trainer.result.done.nonzero().squeeze(1)
        if not len(done):
            return self.ended, numbers
        counts, policies = trainer.result.pick(done), trainer.policies[:, done]
        part = batch.TrainResult(counts, policies, trainer.evaluation)
        return [*self.ended, part], numbers + [chunk[place] for place in done.tolist()]
