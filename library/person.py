"""A person as the parent: on a page in the browser, or at the terminal."""

from __future__ import annotations

import signal
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Literal

from parenting._plural import counted
from parenting.agent.config import Config
from parenting.agent.query import Answer
from parenting.agent.state import AgentState
from parenting.library.parent import EndedError, Parent
from parenting.library.question import Question
from parenting.library.text import both_clips
from parenting.library.worlds import World

if TYPE_CHECKING:
    from parenting.library.result import TrainResult

KEYS = {"l": "left", "r": "right", "e": "either", "n": "neither", "s": "skip"}
PROMPT = "l left, r right, e either, n neither, s skip, q stop: "


class Person:
    """A person as the parent of `train`: one agent, one question after the other.

    On the page: `train` starts a server on a free port of this machine, prints the page's address and opens
    it; in a notebook the page shows below the cell. `train` returns when the run ends. Ctrl-C (in a notebook:
    interrupt) returns what there is by then; everything that was answered stays in the data folder, and
    `train` says how to go on.

    At the terminal: both clips as text, and a letter as the answer.

    Args:
        where: "page" or "terminal".
        data: Folder of the server's database; None makes one in the system's folder for temporary files. With
            `url` it is the folder of that server, and None its default.
        url: The address of a server that runs already (`parenting up`), to join it instead of starting one.
        run: The number of a run in the data folder, to go on with it.
        browser: Open the page in a browser.
        after: At the terminal: a result to go on from. Its answers are given again first.

    Raises:
        ValueError: There is no such place, or an argument belongs to the other place.

    Example:
        >>> import parenting as pt
        >>> pt.Person("terminal")
        <Person at the terminal>
    """

    def __init__(
        self,
        where: Literal["page", "terminal"] = "page",
        *,
        data: str | Path | None = None,
        url: str | None = None,
        run: int | None = None,
        browser: bool = True,
        after: TrainResult | None = None,
    ) -> None:
        if where not in ("page", "terminal"):
            raise ValueError(f'where: {where!r} is neither "page" nor "terminal".')
        if where == "terminal" and (data, url, run) != (None, None, None):
            raise ValueError(
                "data, url and run belong to the page. At the terminal, go on with after=result."
            )
        if where == "page" and after is not None:
            raise ValueError(
                "after belongs to the terminal. On the page, go on with data=folder and run=number."
            )
        if run is not None and data is None and url is None:
            raise ValueError(f"run: say which data folder holds run {run}: Person(data=folder, run={run}).")
        self.where, self.url, self.run, self.browser, self.after = where, url, run, browser, after
        self.data = None if data is None else Path(data)

    def folder(self) -> Path | None:
        """Return the data folder, made if need be; None is the default of a server that runs already."""
        if self.data is None and self.url is None:
            self.data = Path(tempfile.mkdtemp(prefix="parenting-"))
        return self.data

    def __repr__(self) -> str:
        return f"<Person {'at the terminal' if self.where == 'terminal' else 'on the page'}>"


class TerminalParent(Parent):
    """A person at the terminal. Ctrl-C, Ctrl-D and q end the training; what was answered is kept."""

    def __init__(self, after: TrainResult | None = None) -> None:
        self.before = [] if after is None else list(after.answers)
        self.asking = self.stopped = False

    def begin(self, world: World, config: Config, trials: int) -> None:
        """Begin with the answers that were given before."""
        super().begin(world, config, trials)
        heard = [row for row in self.before if row["answered"] is not None]
        self._given = {(row["trial"], row["answered"]): row for row in heard}
        self._given_until = max((row["answered"] for row in heard), default=0)
        self._ticks: dict[int, int] = {}
        self.answers = 0

    def take(self, state: AgentState) -> Answer:
        """Ask what is open, unless the person has stopped."""
        if self.stopped:
            raise EndedError
        self._tick = int(state.keys.tick[0])
        return super().take(state)

    def answer(self, question: Question) -> str | None:
        """Show both clips and read a letter; what was said before is said again at its tick.

        Raises:
            EndedError: the person stops.
        """
        if self._tick < self._given_until:
            return self._said_before(question)
        print(f"\n{both_clips(question.kind, question.left, question.right, question.votes)}")
        self.asking = True
        try:
            while (said := input(PROMPT).strip().lower()) not in KEYS:
                if said == "q":
                    raise EndedError
        except (EOFError, KeyboardInterrupt):
            raise EndedError from None
        finally:
            self.asking = False
        self.answers += 1
        return KEYS[said]

    def _said_before(self, question: Question) -> str | None:
        """Return the answer that this question got in the tick that comes; None if it got none there."""
        row = self._given.get((question.trial, self._tick + 1))
        asked = question.kind, *(" ".join(clip.actions) for clip in (question.left, question.right))
        same = row is not None and asked == (row["kind"], row["left"], row["right"])
        return str(row["choice"]) if row is not None and same else None

    def how_to_go_on(self) -> str:
        """Return what a person who stopped wants to know."""
        return (
            f"Stopped after {counted(self.answers, 'answer')}. "
            "The result holds them; result.save(folder) keeps them."
            ' Go on with the same arguments and parent=pt.Person("terminal", after=result).'
        )

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Let Ctrl-C end the training between two ticks, where everything is whole."""

        def stop(_number: int, _frame: FrameType | None) -> None:
            self.stopped = True
            if self.asking:
                raise KeyboardInterrupt

        if threading.current_thread() is not threading.main_thread():
            yield  # signals come to the main thread alone
            return
        before = signal.signal(signal.SIGINT, stop)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)
