"""Sabotaged servers: a promise broken in one place each, with the test that must catch it.

`make faults` tries some, by its seed, and `make torture` all (scripts/mutants.py --sabotage). Not here: a
session's cookie that is not renewed at login, since there is no login.
"""

from __future__ import annotations

from tests.faults.sabotage_files import FILES
from tests.mutants.mutant import Mutant

KILLS, CLIENTS = "tests/faults/test_kills.py", "tests/faults/test_clients.py"
STATEMENTS = "tests/faults/test_web_statements.py::test_refusal_at_every_statement_of_a_request"

BROKEN = [
    Mutant(
        "commit after the reply (A3)",
        "server/store/commits.py",
        "    with session:\n"
        "        with session.begin():\n"
        "            info = session.connection().info  "
        "# BEGIN IMMEDIATE now, not at the first statement\n"
        "            yield session\n"
        "        confirm(info)  # before anybody is told\n",
        "    session.connection()\n"
        "    yield session\n"
        "    session.flush()\n"
        "    threading.Timer(0.05, session.commit).start()\n",
        f"{KILLS}::test_killed_as_an_answer_is_committed[sqlite]",
    ),
    Mutant(
        "who shares a transaction is told before its commit (A3)",
        "server/group_commit.py",
        "_call(write, session, alone=len(group) == 1)\n",
        "_call(write, session, alone=len(group) == 1)\n                    _tell([write])\n",
        "tests/server/test_group_commit.py::test_nobody_is_told_before_the_commit",
    ),
    Mutant(
        "answers are committed with synchronous NORMAL (A1)",
        "server/db.py",
        'self._writing = engine.execution_options(begin="IMMEDIATE", synchronous="full")',
        'self._writing = engine.execution_options(begin="IMMEDIATE", synchronous="normal")',
        "tests/faults/test_power_cuts.py::test_power_cuts[full-sqlite]",
    ),
    Mutant(
        "writes begin deferred (D2)",
        "server/store/sqlite.py",
        "f\"BEGIN {options.get('begin', 'DEFERRED')}\"",
        '"BEGIN DEFERRED"',
        f"{CLIENTS}::test_races_for_one_query_have_one_winner[sqlite]",
    ),
    Mutant(
        "no lock of the run's row on PostgreSQL (A2)",
        "server/runs.py",
        'bindparam("run_id"), Run.deleting.is_(None)).with_for_update()',
        'bindparam("run_id"), Run.deleting.is_(None))',
        f"{CLIENTS}::test_races_for_one_query_have_one_winner[postgresql]",
    ),
    Mutant(
        "answers are numbered after the largest, not by the run's counter (A5)",
        "server/queue/answers.py",
        'number = session.execute(_NUMBERED, {"run_id": run_id}).scalar_one()',
        "number = len(session.scalars(select(Answer.id).where(Answer.run_id == run_id)).all()) + 1",
        f"{CLIENTS}::test_clients_killed_at_random_statements[postgresql]",
    ),
    Mutant(
        "two answers of a query may stand, as far as the database knows (A2)",
        "migrations/versions/0001_first_tables.py",
        '["query_id"],\n        unique=True,',
        '["query_id"],\n        unique=False,',
        "tests/faults/test_guards.py::test_database_itself_refuses[sqlite-a second standing answer]",
    ),
    Mutant(
        "a lease is held by no name (B1)",
        "server/queue/leases.py",
        '_MINE = and_(Query.leased_by == bindparam("client_id"), ',
        '_MINE = and_(bindparam("client_id") == bindparam("client_id"), ',
        "tests/faults/test_queue_machine.py::test_queue_does_what_its_model_says[sqlite]",
    ),
    Mutant(
        "a checkpoint without Adam's first moments (C1)",
        "server/snapshot.py",
        '"state": {name: part for name',
        '"state": {name: part * (name != "learner.exp_avg") for name',
        "tests/faults/test_learner_kills.py::test_killed_learner_goes_on_with_the_same_bits[sqlite]",
    ),
    Mutant(
        "a GET that leases (E1)",
        "server/pages/parent.py",
        "_page_state(run_schema(db, run_id).state, may_lease(db, run_id, client))",
        "_page_state(run_schema(db, run_id).state, leases.lease(db, run_id, client, 60) is not None)",
        "tests/pages/test_looking.py::test_no_get_changes_anything",
    ),
    Mutant(
        "a text of people is shown as markup (E7)",
        "web/templates/start.html",
        "{{ form.level_text }}</textarea>",
        "{{ form.level_text | safe }}</textarea>",
        "tests/pages/test_start.py::test_what_was_typed_is_escaped",
    ),
    Mutant(
        "streams without a cap (E8)",
        "server/streams.py",
        "if self.number() >= self.limit:",
        "if self.number() < 0:",
        "tests/server/test_streams.py::test_one_stream_too_many_is_refused",
    ),
]

OLD = [
    Mutant(
        "an I/O error, such as a quota that is used up, is a 500",
        "server/store/refusals.py",
        '    "SQLITE_IOERR": RefusedError,',
        "   ",
        f"{STATEMENTS}[sqlite-answer]",
    ),
    Mutant(
        "a PostgreSQL that restarts is a 500",
        "server/store/refusals.py",
        '    "57P": GoneError,',
        "   ",
        f"{STATEMENTS}[postgresql-answer]",
    ),
    Mutant(
        "a store that refuses ends the worker",
        "server/worker.py",
        "self._go_on()\n            except StoreError as error:\n"
        "                self.patience.refused(error)",
        "self._go_on()\n            except StoreError as error:\n                raise",
        "tests/faults/test_worker_locked_out.py::"
        "test_a_lock_of_another_program_neither_ends_the_worker_nor_fails_the_run",
    ),
    Mutant(
        "a deleted question's number is given again",
        "server/identity.py",
        "func.coalesce(kept, 0), tables[Identity.__tablename__].c[deleted]))",
        "func.coalesce(kept, 0), 0))",
        "tests/server/test_identity.py::test_deleted_numbers_are_never_given_again",
    ),
    Mutant(
        "an answer meant for another database is stored",
        "server/queue/names.py",
        "    if _differs(row, names) or (missing and isinstance(query, str)):",
        "    if row.query is None and isinstance(query, str):",
        "tests/server/test_elsewhere.py::test_two_databases_of_equal_numbers_never_share_an_answer",
    ),
    Mutant(
        "an event that came is forgotten by the replay",
        "server/queue/worker_side.py",
        "        if max(high(session, mine.run_id)) >= tick:",
        "        if max(high(session, mine.run_id)) > tick:",
        "tests/server/test_worker_side.py::test_events_apply_once_and_replay",
    ),
]

SABOTAGES = [*BROKEN, *FILES, *OLD]
