"""Sabotaged servers, continued: files, locks, disk space, migrations, and the numbers of answers.

Where other designs hold an `flock` around each write, this one asks for a SQLite without the fault of its
write-ahead log. Locks hold the files that are logged to, a database that is restored, and migrations; each
is dropped here.
"""

from __future__ import annotations

from tests.mutants.mutant import Mutant

BALLAST = (
    "tests/server/store/test_ballast.py::"
    "test_disk_that_fills_up_costs_one_refusal_until_the_ballast_is_used_up"
)

FILES = [
    Mutant(
        "the ballast is missing (D4)",
        "server/db.py",
        "            self._ballast.keep()\n",
        "            pass\n",
        BALLAST,
    ),
    Mutant(
        "the ballast is not given up on a full disk (D4)",
        "server/db.py",
        "                self._ballast.heed(error)\n",
        "                pass\n",
        BALLAST,
    ),
    Mutant(
        "a file that is removed while in use goes unnoticed (A1)",
        "server/store/held.py",
        "        there = node(self._name)\n",
        "        return\n        there = node(self._name)\n",
        "tests/server/store/test_guard.py::test_file_removed_around_the_commit_is_noticed_before_the_reply",
    ),
    Mutant(
        "a log that is lost goes unnoticed (A1)",
        "server/store/high_water.py",
        "    found = counted(database)\n    if found is None or",
        "    found = None\n    if found is None or",
        "tests/server/store/test_high_water.py::test_lost_log_is_noticed_and_accepted",
    ),
    Mutant(
        "pages are not checked at the start (A1)",
        "server/store/check.py",
        "        require_sound(database)\n    if (sentence := _lost(database))",
        "        pass\n    if (sentence := _lost(database))",
        "tests/server/store/test_check.py::test_page_that_is_overwritten_is_refused",
    ),
    Mutant(
        "an answer that was changed in the file has the hash of another, and nobody says so (A4)",
        "server/chain.py",
        "        elif digest_of(salt, text) != digest:\n",
        "        elif not digest:\n",
        "tests/faults/test_bit_flips.py::test_changed_answer_is_told",
    ),
    Mutant(
        "any SQLite will do, without a lock of our own (D1)",
        "server/store/driver.py",
        "        if module.sqlite_version_info >= SAFE_SQLITE:",
        "        if module.sqlite_version_info:",
        "tests/server/test_sqlite.py::test_old_sqlite_is_refused",
    ),
    Mutant(
        "the lock of a file that is logged to is dropped",
        "server/log.py",
        "            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)\n",
        "            pass\n",
        "tests/server/test_log.py::test_two_processes_of_a_kind_have_a_file_each",
    ),
    Mutant(
        "the lock of a database that is restored is dropped",
        "server/backups/restoring.py",
        "                until_replaced.enter_context(alone(target))",
        "                pass",
        "tests/server/backups/test_restoring.py::test_never_while_another_program_has_the_file_open",
    ),
    Mutant(
        "the lock of a migration is dropped on PostgreSQL (D6)",
        "server/store/postgresql.py",
        '    connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({MIGRATION})")\n',
        "",
        "tests/server/store/test_postgresql.py::test_of_many_who_migrate_at_once_one_does",
    ),
    Mutant(
        "each step of a migration is committed by itself (D6)",
        "server/migrate.py",
        '        _alembic(connection, "upgrade", "head")\n',
        "        while _revision(connection) != newest():\n"
        '            _alembic(connection, "upgrade", "+1")\n'
        '            connection.exec_driver_sql("COMMIT")\n'
        '            connection.exec_driver_sql("BEGIN IMMEDIATE")\n',
        "tests/faults/test_migration_kills.py::"
        "test_migration_killed_anywhere_leaves_the_old_or_the_new_tables[sqlite]",
    ),
    Mutant(
        "a migration makes no copy first (D6)",
        "server/migrate.py",
        "            keep(before)\n",
        "            pass\n",
        "tests/server/backups/test_before_migrating.py::test_the_copy_is_the_database_as_it_was",
    ),
    Mutant(
        "answers are numbered by a sequence, not by the run's counter (A5)",
        "server/queue/answers.py",
        "    if not db.one_writer:\n        lock(session, place.run)\n",
        "    from sqlalchemy import text\n\n"
        "    drawn = session.execute(text(\"SELECT nextval('event_id_seq')\")).scalar_one()\n"
        "    lock(session, place.run)\n"
        '    session.execute(text(f"UPDATE run SET answers = {drawn - 1} WHERE id = {place.run}"))\n',
        "tests/server/store/test_cursors.py::test_answers_by_their_number[postgresql]",
    ),
]
