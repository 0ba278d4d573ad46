"""Name, describe, tag and archive a run, over or not: nothing of this changes what its agent does.

Tags are stored in one text, between commas, in the order in which they were given.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, StringConstraints
from sqlalchemy import select

from parenting.envs.people_text import plain, read_name
from parenting.server.columns import Damaged
from parenting.server.damage import readable
from parenting.server.db import Database
from parenting.server.errors import InvalidFieldsError
from parenting.server.patterns import TAG
from parenting.server.runs import hold
from parenting.server.store.relay import announce
from parenting.server.tables import Run

LONGEST_DESCRIPTION, LONGEST_TAG, MOST_TAGS = 2000, 40, 20


def read_tag(text: str) -> str:
    """Return a tag as it is stored.

    Raises:
        ValueError: it cannot be seen, is too long, or holds a comma, which divides tags.
    """
    tag = read_name(text)
    if "," in tag:
        raise ValueError("a comma divides tags and cannot be part of one")
    if len(tag) > LONGEST_TAG:
        raise ValueError(f"at most {LONGEST_TAG} characters are allowed here")
    return tag


def read_description(text: str) -> str:
    """Return a description as it is stored: line ends of one kind, no blanks around it."""
    return plain(text.replace("\r\n", "\n")).strip()


Description = Annotated[
    str, StringConstraints(max_length=LONGEST_DESCRIPTION), AfterValidator(read_description)
]
Tag = Annotated[
    str,
    StringConstraints(min_length=1, max_length=LONGEST_TAG, pattern=TAG),
    AfterValidator(read_tag),
]


def describe(db: Database, run_id: int, words: Mapping[str, Any]) -> Run:
    """Change what is given of a run: its `name`, its `description` (None removes it), its list of `tags`.

    Raises:
        NotFound: there is no such run.
        InvalidFieldsError: there are too many tags.
        DamagedRowError: its row cannot be read.
    """
    changes = {name: words[name] or None for name in ("name", "description") if name in words}
    if "tags" in words:
        changes["tags"] = join_tags(words["tags"])
    with db.write() as session:
        run = readable(hold(session, run_id))
        for name, value in changes.items():
            setattr(run, name, value)
        announce(session, "web")
        return run


def tag(db: Database, run_id: int, add: Iterable[str] = (), remove: Iterable[str] = ()) -> Run:
    """Add tags to a run and take others away.

    Raises:
        NotFound: there is no such run.
        InvalidFieldsError: there would be too many.
        DamagedRowError: its row cannot be read.
    """
    gone = set(remove)
    with db.write() as session:
        run = readable(hold(session, run_id))
        run.tags = join_tags([*(one for one in split_tags(run.tags) if one not in gone), *add])
        return run


def archive(db: Database, run_id: int, archived: bool = True) -> Run:
    """Leave a run out of the list, or take it in again; a second call changes nothing.

    Raises:
        NotFound: there is no such run.
    """
    with db.write() as session:
        run = hold(session, run_id)
        if archived is not (run.archived is not None):
            run.archived = db.clock() if archived else None
        return run


def known_tags(db: Database) -> list[str]:
    """Return every tag that a run has, in alphabetical order."""
    with db.read() as session:
        stored = session.scalars(select(Run.tags).where(Run.tags != "").distinct()).all()
    found = {tag for tags in stored if not isinstance(tags, Damaged) for tag in split_tags(tags)}
    return sorted(found, key=str.casefold)


def split_tags(stored: str) -> list[str]:
    """Return the tags of a stored text."""
    return [tag for tag in stored.split(",") if tag]


def join_tags(tags: Iterable[str]) -> str:
    """Return tags as they are stored, each once.

    Raises:
        InvalidFieldsError: there are too many.
    """
    once = list(dict.fromkeys(tags))
    if len(once) > MOST_TAGS:
        raise InvalidFieldsError([("tags", f"A run has at most {MOST_TAGS} tags.")])
    return f",{','.join(once)}," if once else ""
