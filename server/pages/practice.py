"""Practice: five questions on a small island, with a sentence on each answer, before a parent's first run.

They are drawn and answered by what draws and answers all questions. The address tells where in the practice
somebody is, and nothing is stored: only a cookie of this browser says that the practice was finished, for
runs that require it.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Annotated, Any
from urllib.parse import urlencode

from fastapi import Query, Request, Response

from parenting.drawing.sentences import tr
from parenting.envs import registry
from parenting.server import runs
from parenting.server.admission import admitted_router
from parenting.server.deps import Db, SettingsOf
from parenting.server.pages.fields import ChoiceField
from parenting.server.pages.lessons import LESSONS, POND, TAKE_BACK, TAKEN_BACK, WORLD, Lesson
from parenting.server.pages.question import Former, Onward, QuestionView, describe
from parenting.server.pages.render import page, redirect, remember
from parenting.server.public_ids import PATTERN
from parenting.server.reads.names import run_number
from parenting.server.schemas import Choice

router = admitted_router(include_in_schema=False)

PRACTISED = "parenting_practised"
"""The cookie of a browser in which the practice was finished."""
ADDRESS = "/practice"

At = Annotated[int, Query(ge=1, le=len(LESSONS) + 1)]
Chosen = Annotated[Choice | None, Query()]
OfRun = Annotated[str | None, Query(pattern=PATTERN)]


@dataclass(frozen=True)
class Place:
    """A place in the practice: what the address tells."""

    at: int = 1  # the number of the question; one more than there are is the end
    run: str | None = None  # the public id of the run that the practice leads back to
    undone: bool = False  # the answer to this question was taken back once

    def address(self, choice: str | None = None) -> str:
        """Return the address of the question, or of what is said to an answer."""
        told = {"at": self.at, "choice": choice, "undone": "true" if self.undone else None, "run": self.run}
        return f"{ADDRESS}?{urlencode({name: value for name, value in told.items() if value is not None})}"

    @property
    def undo_address(self) -> str:
        """The address of the form that takes the answer to the question back."""
        return f"{ADDRESS}/undo?" + urlencode(
            {"at": self.at} | ({} if self.run is None else {"run": self.run})
        )

    @property
    def next(self) -> Place:
        """The question after this one."""
        return Place(self.at + 1, self.run)

    @property
    def back(self) -> str:
        """The address that the practice was opened for."""
        return "/" if self.run is None else f"/runs/{self.run}/parent"


@dataclass(frozen=True)
class PracticeView(QuestionView):
    """A question of the practice, ready for web/templates/_question.html."""

    lesson: Lesson = LESSONS[0]
    place: Place = Place()

    @property
    def action(self) -> str:
        """The address that the form is sent to."""
        return self.place.address()

    @property
    def plain(self) -> bool:
        """True: no run takes the answer, so scripts send the form as it is."""
        return True

    @property
    def grid(self) -> str:
        """The address of its board as a grid of cells."""
        return f"{ADDRESS}/grid?at={self.place.at}"

    @property
    def onward(self) -> Onward:
        """The next question, or the end."""
        last = self.place.at == len(LESSONS)
        return Onward(
            self.place.next.address(), tr("Finish") if last else tr("Next question"), first=not self._open
        )

    @property
    def lead(self) -> str:
        """Nothing: the task stands in its place."""
        return ""

    @property
    def notes(self) -> str:
        """The task."""
        return tr(TAKEN_BACK if self.place.undone and self.former is None else self.lesson.task)

    @property
    def again(self) -> str:
        """The sentences on the answer."""
        if self.former is None:
            return ""
        said = tr(self.lesson.said[self.former.choice])
        return f"{said} {tr(TAKE_BACK)}" if self._open else said

    @property
    def spoken(self) -> str:
        """The question with its board; once it is answered, what is said to the answer."""
        if self.former is None:
            return super().spoken
        answer = tr("Your answer: {answer}.", answer=self.names[self.former.choice])
        return f"{answer} {self.again}"

    @property
    def _open(self) -> bool:
        """True if the answer is still to be taken back."""
        return self.lesson.undo and not self.place.undone


@dataclass(frozen=True)
class PracticePage:
    """The content of web/templates/practice.html."""

    run: Any  # the legend and the brief of the world, as those of a run
    shown: PracticeView | None  # the question; None at the end
    place: Place
    count: int  # of the questions
    undo: str  # the name of the answer that can be taken back; "" without one
    required: bool  # the run wants the practice to be finished
    listen_after: int
    database: str = ""  # of no database, and of nobody
    client: str = ""


def practice_view(place: Place, choice: str | None = None) -> PracticeView:
    """Describe the question at a place, and the answer to it if there is one."""
    lesson = LESSONS[place.at - 1]
    one = lesson.kind == "guidance"
    legend = registry.spec(WORLD).legend
    described = describe(lesson.clips, lesson.kind, lesson.stage, legend, POND.rows, one)
    former = None if choice is None else Former(choice, heard=False)
    return PracticeView(**described, id=f"practice-{place.at}", former=former, lesson=lesson, place=place)


@router.get(ADDRESS)
def practice_page(
    db: Db,
    settings: SettingsOf,
    at: At = 1,
    choice: Chosen = None,
    undone: bool = False,
    run: OfRun = None,
) -> Response:
    """The page: a question, or what is said to an answer to it, or the end."""
    asked_for = None if run is None else runs.get_run(db, run_number(db, run))
    place = Place(at, run, undone)
    shown = None if at > len(LESSONS) else practice_view(place, choice)
    spec = registry.spec(WORLD)
    brief = {"goal": spec.brief.goal, "danger": spec.brief.danger}
    context = PracticePage(
        SimpleNamespace(legend=spec.legend, brief=brief),
        shown,
        place,
        len(LESSONS),
        shown.names[choice] if shown is not None and choice is not None else "",
        asked_for is not None and asked_for.practice == "required",
        settings.listen_after_ms,
    )
    return page("practice.html", **vars(context))


@router.post(ADDRESS)
def answer(choice: ChoiceField, at: At = 1, undone: bool = False, run: OfRun = None) -> Response:
    """For the form: go to what is said to the answer."""
    return redirect(Place(at, run, undone).address(choice))


@router.post(f"{ADDRESS}/undo")
def undo(at: At = 1, run: OfRun = None) -> Response:
    """For the form: take the answer back, and go to its question."""
    return redirect(Place(at, run, undone=True).address())


@router.post(f"{ADDRESS}/done")
def done(request: Request, run: OfRun = None) -> Response:
    """For the form at the end: remember in this browser that it has practised, and go back."""
    response = redirect(Place(run=run).back)
    remember(request, response, PRACTISED, "1")
    return response
