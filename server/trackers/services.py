"""Trackers of other programs: TensorBoard (extra `tensorboard`), and whatever has the shape of wandb."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from parenting.server.trackers.tracker import TrackedRun, Values


class TensorBoardTracker:
    """Writes an event file of TensorBoard into FOLDER/RUN, a curve for each metric."""

    def __init__(self, folder: str | Path) -> None:
        """Load TensorBoard's writer.

        Raises:
            ImportError: it is not installed.
        """
        from torch.utils.tensorboard import SummaryWriter

        self.folder, self._writer = Path(folder), SummaryWriter
        self._open: dict[str, Any] = {}

    def begin(self, run: TrackedRun) -> None:
        """Open the run's event file, and write its settings as a text."""
        writer = self._writer(str(self.folder / run.id))
        self._open[run.id] = writer
        settings = {**asdict(run), **run.config}
        del settings["config"]
        writer.add_text("run", "\n".join(f"- {name}: {value}" for name, value in settings.items()))

    def log(self, run: str, step: int, values: Values) -> None:
        """Write a point of each curve."""
        for name, value in values.items():
            if value is not None:
                self._open[run].add_scalar(name, value, step)
        self._open[run].flush()

    def end(self, run: str, reason: str) -> None:
        """Close the event file."""
        self._open.pop(run).close()


class WandbTracker:
    """Feeds an object with the shape of the module `wandb`: `init(...)` gives a run with `log` and `finish`.

    Args:
        wandb: The module, or anything with its `init(id=, name=, config=, resume=, **options)`.
        **options: More arguments of `init`, such as `project`.
    """

    def __init__(self, wandb: Any, **options: Any) -> None:
        self.wandb, self.options = wandb, options
        self._open: dict[str, Any] = {}

    def begin(self, run: TrackedRun) -> None:
        """Begin a run of the same id there, or go on with it."""
        config = {**run.config, "world": run.world, "level": run.level, "seed": run.seed}
        given = {"id": run.id, "name": run.name, "config": config, "resume": "allow", **self.options}
        self._open[run.id] = self.wandb.init(**given)

    def log(self, run: str, step: int, values: Values) -> None:
        """Log the metrics of a step."""
        self._open[run].log({name: value for name, value in values.items() if value is not None}, step=step)

    def end(self, run: str, reason: str) -> None:
        """Finish the run there."""
        self._open.pop(run).finish()
