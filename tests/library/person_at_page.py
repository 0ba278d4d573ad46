"""A person at the page, played by Chromium in a thread while `train` waits."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable

from playwright.sync_api import Page, sync_playwright

from tests import simulated_person

ToGoal = dict[simulated_person.Cell, int] | Callable[[Page], dict[simulated_person.Cell, int]]
"""Steps from each cell to where the agent should go; a function where that depends on what is shown."""


class PersonAtPage(threading.Thread):
    """Answers so many questions, then calls `then`."""

    def __init__(
        self,
        url: str,
        chromium: str,
        answers: int,
        then: Callable[[], None],
        to_goal: ToGoal | None = None,
    ) -> None:
        super().__init__(daemon=True)
        self.to_goal = simulated_person.distances() if to_goal is None else to_goal
        self.url, self.chromium, self.answers, self.then = url, chromium, answers, then
        self.error: BaseException | None = None

    def run(self) -> None:
        try:
            with sync_playwright() as playwright:
                browser = playwright.chromium.launch(
                    executable_path=self.chromium, args=simulated_person.FLAGS
                )
                page = browser.new_page()
                page.goto(self.url)
                for _ in range(self.answers):
                    simulated_person.answer(
                        page, self.to_goal(page) if callable(self.to_goal) else self.to_goal
                    )
                self.then()
                browser.close()
        except BaseException as error:
            self.error = error
            os.kill(os.getpid(), signal.SIGINT)  # else `train` would never return
