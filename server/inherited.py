"""Policies that are uploaded for runs to begin with, and answers of stored runs. No torch.

An upload stays for an hour (`server.weights.YOUNG`), or for as long as a run that began with it.
"""

from __future__ import annotations

from typing import NamedTuple

from sqlalchemy import select

from parenting.server.columns import Damaged
from parenting.server.db import Database
from parenting.server.errors import Conflict, InvalidFieldsError, NotFound
from parenting.server.export import lines
from parenting.server.origins import stored_hashes
from parenting.server.runs import get_run
from parenting.server.schemas import Schema
from parenting.server.tables import Run, Weights
from parenting.server.weights import INHERITED, get, put_bytes, sweep
from parenting.weights.origin import FROM_ANSWERS, FROM_POLICY, Origin, UnreadableOriginError, origin_of

POLICY_BYTES = 16 * 2**20
"""Bytes of a policy that is uploaded: one for a board of 46 x 46. Commands take larger ones."""
ANSWERS_CHARACTERS = 16 * 2**20
"""Characters of the answers of a stored run, as an export has them. Commands take more."""
LISTED = 50
"""Runs with answers that the form offers."""
UPLOADS = 16
"""Uploads that no run has begun with yet."""


class PolicySchema(Schema):
    """A policy that runs can begin with."""

    sha256: str
    """Its name: the SHA-256 of the file. Runs take it as `from_policy`."""
    file: str
    world: str
    levels: list[str]
    """The texts of the levels that it was trained on."""
    run: str | None
    """The public id of the run that it is of, where the file says so."""
    tick: int | None


def upload(db: Database, file: str, blob: bytes) -> PolicySchema:
    """Store a policy for runs to come.

    Raises:
        InvalidFieldsError: the bytes are not of a policy, or are damaged.
        Conflict: too many were uploaded that no run has begun with.
    """
    name = "".join(one for one in file if one.isprintable())[-100:] or "policy.safetensors"
    origin = _read((name, blob), None)
    sweep(db)
    if _waiting(db) >= UPLOADS:
        said = f"{UPLOADS} policies were uploaded that no run has begun with."
        raise Conflict(f"{said} Start a run on one, or wait an hour.")
    return schema(put_bytes(db, name + INHERITED, blob), origin)


def schema(sha256: str, origin: Origin) -> PolicySchema:
    """Return the schema of a policy that was read.

    Raises:
        NotFound: the origin has none.
    """
    if origin.policy is None or origin.about is None:
        raise NotFound("There is no policy.")
    about, told = origin.policy.about, origin.about["policy"]
    levels = about.get("levels")
    return PolicySchema(
        sha256=sha256,
        file=told["file"],
        world=str(about.get("world"))[:100],
        levels=[text for text in levels if isinstance(text, str)] if isinstance(levels, list) else [],
        run=told["run"] if isinstance(told["run"], str) else None,
        tick=told["tick"] if isinstance(told["tick"], int) else None,
    )


class AnsweredRun(NamedTuple):
    """A stored run whose answers another may begin with."""

    id: int
    public_id: str
    name: str | None
    world: str
    level: str
    answers: int


def answered_runs(db: Database) -> list[AnsweredRun]:
    """Return the latest runs with answers, the newest first."""
    standing = (Run.answers - Run.retracted).label("answers")
    columns = (Run.id, Run.public_id, Run.name, Run.world, Run.level, standing)
    rows = select(*columns).where(standing > 0, Run.deleting.is_(None), Run.batch.is_(None))
    with db.read() as session:
        found = session.execute(rows.order_by(Run.id.desc()).limit(LISTED)).all()
    whole = [row for row in found if not any(isinstance(value, Damaged) for value in row)]
    return [AnsweredRun(*row) for row in whole]


def chosen_policy(db: Database, sha256: str) -> PolicySchema | None:
    """Return a policy that was uploaded; None where it is not there (any more)."""
    try:
        return schema(sha256, _read(_policy(db, sha256), None))
    except InvalidFieldsError:
        return None


def chosen_origin(db: Database, policy: str | None, answers: str | None) -> Origin:
    """Return what a run should begin with.

    Args:
        db: The database.
        policy: The SHA-256 of a policy that was uploaded.
        answers: The public id of a run whose answers that stand come first in X.

    Raises:
        InvalidFieldsError: it is not there, or cannot be read.
    """
    return _read(_policy(db, policy), _answers(db, answers))


def _read(policy: tuple[str, bytes] | None, answers: tuple[str, bytes] | None) -> Origin:
    try:
        return origin_of(policy, answers)
    except UnreadableOriginError as error:
        raise InvalidFieldsError([(error.field, str(error))]) from None


def _policy(db: Database, sha256: str | None) -> tuple[str, bytes] | None:
    if sha256 is None:
        return None
    with db.read() as session:
        name = session.scalar(select(Weights.name).where(Weights.sha256 == sha256))
    try:
        return str(name).removesuffix(INHERITED), get(db, sha256, "policy")
    except NotFound:
        said = "There is no such policy. Upload it again: it is kept for an hour until a run begins with it."
        raise InvalidFieldsError([(FROM_POLICY, said)]) from None


def _answers(db: Database, public_id: str | None) -> tuple[str, bytes] | None:
    if public_id is None:
        return None
    with db.read() as session:
        number = session.scalar(select(Run.id).where(Run.public_id == public_id, Run.deleting.is_(None)))
    if number is None:
        raise InvalidFieldsError([(FROM_ANSWERS, "There is no such run.")])
    run, found, size = get_run(db, number), list[str](), 0
    for line in lines(db, number):
        found.append(line)
        size += len(line)
        if size > ANSWERS_CHARACTERS:
            said = "It has too many answers for a form. Export them, and take the command's --from-answers."
            raise InvalidFieldsError([(FROM_ANSWERS, said)])
    return f"answers of run {run.id}", "".join(found).encode()


def _waiting(db: Database) -> int:
    """Return the number of uploads that no run has begun with."""
    with db.read() as session:
        used = set[str]().union(
            *map(stored_hashes, session.scalars(select(Run.origin).where(Run.origin.is_not(None))))
        )
        inherited = Weights.name.endswith(INHERITED, autoescape=True)
        return len(set(session.scalars(select(Weights.sha256).where(inherited))) - used)
