"""Faults in the queue of questions, in the claims of workers and in what other sites may do."""

from __future__ import annotations

from tests.mutants.mutant import Mutant

ANSWERS, WORKER = "tests/server/test_answers.py", "tests/server/test_worker_side.py"
RUNS, SECURITY = "tests/server/test_runs.py", "tests/server/test_security.py"
ENTRANCE = "tests/server/test_entrance.py"
SCHEDULE, OFFERING = "tests/server/work/test_schedule.py", "tests/server/test_offering.py"

QUEUE = [
    Mutant(
        "a worker that slept past its claim may write (fencing)",
        "server/runs.py",
        "if (worker, token) != (mine.worker, mine.fencing_token):",
        "if worker is None:",
        f"{RUNS}::test_finish_is_fenced",
    ),
    Mutant(
        "a claim does not raise the fencing token",
        "server/runs.py",
        "= worker, run.fencing_token + 1",
        "= worker, run.fencing_token",
        f"{RUNS}::test_one_worker_a_run",
    ),
    Mutant(
        "a run is taken from a worker that lives",
        "server/runs.py",
        "Worker.mark + seconds)",
        "Worker.mark)",
        f"{RUNS}::test_a_sign_of_life_keeps_every_claim_of_its_worker",
    ),
    Mutant(
        "a person waits for rows of another run",
        "server/work/schedule.py",
        "= now + WRITE_SECONDS, now + LEISURE_SECONDS",
        "= now + WRITE_SECONDS, now",
        f"{SCHEDULE}::test_what_is_only_written_down_keeps_nobody_waiting_for_six_seconds",
    ),
    Mutant(
        "a question waits for the next look of the watcher",
        "server/streams.py",
        "        for one in named:\n            one.offer()\n",
        "",
        f"{OFFERING}::test_a_notification_of_a_run_brings_its_question_without_a_look_of_the_watcher[sqlite]",
    ),
    Mutant(
        "a lease never ends",
        "server/queue/leases.py",
        "_FREE = is_over(*_LEASE)",
        "_FREE = Query.lease_end.is_(None)",
        f"{ANSWERS}::test_leased_question_is_offered_again_when_its_lease_ends",
    ),
    Mutant(
        "two clients get the same question",
        "server/queue/leases.py",
        "_OPEN = _ANY.where(or_(_MINE, _FREE))",
        "_OPEN = _ANY",
        f"{ANSWERS}::test_many_clients_lease_different_questions",
    ),
    Mutant(
        "anybody can let go of a lease",
        "server/queue/leases.py",
        '_QUERY.c.leased_by == bindparam("client"))',
        "_QUERY.c.leased_by.is_not(None))",
        f"{ANSWERS}::test_release_offers_it_at_once_and_only_by_its_holder",
    ),
    Mutant(
        "an answer that is sent again is refused (idempotence)",
        "server/queue/answers.py",
        "if asked.standing is not None:\n        return _again(asked, said, place)",
        'if asked.standing is not None:\n        raise Conflict("It was answered already.")',
        f"{ANSWERS}::test_same_answer_again_gets_the_same_reply",
    ),
    Mutant(
        "the number of a deleted run or question is given again",
        "server/identity.py",
        "    return number + 1\n",
        "    return None\n",
        "tests/server/test_identity.py::test_deleted_numbers_are_never_given_again",
    ),
    Mutant(
        "an answer for another database is stored here",
        "server/queue/names.py",
        "if _differs(row, names) or (missing and isinstance(query, str)):",
        "if row.query is None and isinstance(query, str):",
        "tests/server/test_elsewhere.py::test_answer_that_names_something_else_is_not_stored",
    ),
    Mutant(
        "a second answer that differs is taken for the first",
        "server/queue/answers.py",
        "if asked.choice != said.choice:",
        "if not asked.choice:",
        f"{ANSWERS}::test_another_answer_is_refused",
    ),
    Mutant(
        "a replayed tick hears what comes next, not what was recorded",
        "server/queue/worker_side.py",
        "if closed(session, mine.run_id, tick):",
        "if tick < 0:",
        f"{WORKER}::test_replay_gives_back_what_was_recorded",
    ),
    Mutant(
        "a question's person waits for what nobody waits for",
        "server/pressure.py",
        "if self._pressure.waiting and now - self._done_at < PUT_OFF_SECONDS:",
        "if now < self._done_at:",
        "tests/server/test_pressure.py::"
        "test_a_question_waits_for_nothing_else_and_the_rest_comes_with_the_next_turn",
    ),
    Mutant(
        "what was put off is lost with the worker",
        "server/work/held.py",
        "self._unless_lost(run_id, session.catch_up)",
        "pass",
        "tests/server/test_pressure.py::test_a_worker_that_ends_does_what_it_has_put_off",
    ),
    Mutant(
        "a replayed tick asks a second time",
        "server/queue/worker_side.py",
        "if known is not None:",
        "if known is not None and tick < 0:",
        f"{WORKER}::test_known_tick_is_not_asked_twice",
    ),
    Mutant(
        "a run that goes on asks guidance that the agent waits for no more",
        "server/queue/queries.py",
        "rows.where(Query.withdrawn_tick.is_(None), Query.id.not_in(skipped))",
        "rows.where(Query.id.not_in(skipped))",
        "tests/server/test_resume.py::test_guidance_that_the_agent_waits_for_no_more_is_not_asked_again",
    ),
    Mutant(
        "who never answered a question takes its lease by taking an answer back",
        "server/queue/revisions.py",
        'if session.execute(_GIVEN, {"query_id": place.query, "client_id": client_id}).first() is not None:',
        "if client_id:",
        "tests/server/test_revisions.py::test_who_never_answered_takes_nothing_back_and_no_lease",
    ),
    Mutant(
        "a damaged question is written again without a proof",
        "server/queue/repairs.py",
        "return any(proves(one, content) for one in answers) if answers else otherwise",
        "return True",
        "tests/server/test_repairs.py::test_what_no_answers_digest_proves_stays_as_it_is",
    ),
]

WEB = [
    Mutant(
        "another site may act (CSRF, by Sec-Fetch-Site)",
        "server/security.py",
        'in ("same-origin", "none")',
        'in ("same-origin", "same-site", "cross-site", "none")',
        f"{SECURITY}::test_other_sites_may_not",
    ),
    Mutant(
        "another site may act (CSRF, by Origin)",
        "server/security.py",
        "return None if origin == own else Forbidden()",
        "return None",
        f"{SECURITY}::test_other_sites_may_not",
    ),
    Mutant(
        "any host name is served",
        "server/entrance.py",
        "return None if local else UnknownHostError()",
        "return None",
        f"{SECURITY}::test_unknown_hosts_are_refused",
    ),
    Mutant(
        "whoever sends forwarded headers is believed",
        "server/entrance.py",
        "if self._trusts(peer) and (FOR in headers or PROTO in headers):",
        "if FOR in headers or PROTO in headers:",
        f"{ENTRANCE}::test_other_ways_into_a_public_server_are_refused",
    ),
    Mutant(
        "a public server takes plain http",
        "server/entrance.py",
        'if headers.getlist(PROTO) != ["https"]:',
        "if not headers.getlist(PROTO):",
        f"{ENTRANCE}::test_other_ways_into_a_public_server_are_refused",
    ),
]
