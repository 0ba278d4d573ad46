"""The workers that `parenting up` keeps running: a fixed number, or as many as their runs need."""

from __future__ import annotations

import time
from collections.abc import Callable

from parenting.commands.children import LONGEST_WAIT, STOP_SECONDS, Child, Process


class Crew:
    """Worker processes. One that dies is started again; one that is not needed any more ends in order."""

    def __init__(self, start: Callable[[], Process], tell: Callable[[str], None], number: int = 1) -> None:
        """Start the workers.

        Args:
            start: Starts a worker process.
            tell: Takes a sentence about each death, and each change of their number.
            number: How many there are.
        """
        self._start, self._tell, self.wanted = start, tell, number
        self.children = [Child("worker", start, tell) for _ in range(number)]
        self.leaving: list[tuple[Child, float]] = []
        self._not_before = 0.0

    def look(self) -> None:
        """Start dead ones again, and bring their number to what is wanted.

        Raises:
            RefusedError: the first start of one ended with the exit code of a wrong setting.
        """
        for child in self.children:
            child.look()
        if self.wanted > len(self.children) and time.monotonic() >= self._not_before:
            self._add()
        elif self.wanted < len(self.children):
            child = self.children.pop()
            if child.process.poll() is None:
                child.process.terminate()
                self.leaving.append((child, time.monotonic() + STOP_SECONDS))
            self._say("The workers have little to do, so one of them ends")
        for child, end in self.leaving:
            if child.process.poll() is None and time.monotonic() > end:
                child.process.kill()  # what it has not saved is repeated from its checkpoints
        self.leaving = [(child, end) for child, end in self.leaving if child.process.poll() is None]

    def all(self) -> list[Child]:
        """Return every worker that may be alive, those that are just ending too."""
        return [*self.children, *(child for child, _ in self.leaving)]

    def _add(self) -> None:
        try:
            self.children.append(Child("worker", self._start, self._tell))
        except OSError as error:  # no memory or no process left: those that there are go on
            self._not_before = time.monotonic() + LONGEST_WAIT
            self._tell(f"One more worker cannot be started ({error.strerror}).")
        else:
            self._say("Runs wait for their turns, so one more worker starts")

    def _say(self, why: str) -> None:
        now = len(self.children)
        self._tell(f"{why}: {now} worker{'s' if now != 1 else ''} from now on.")
