"""Episodes of a life, shown again from the moves that are stored of every tick."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import httpx2
import pytest

from parenting.server import moves
from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.job_kinds import EpisodePayload
from parenting.server.new_run import NewRun, start
from parenting.server.queue.worker_side import watch
from parenting.server.runs import claim
from parenting.server.session import RunSession
from parenting.server.work.episode import episode, episode_at

pytestmark = pytest.mark.only("sqlite", "the moves are bytes to every store")


def live(life: RunSession, ticks: int) -> list[list[Any]]:
    """Return the truth after each tick: the place of the agent, the board, and if it moved."""
    seen = []
    for _ in range(ticks):
        life.tick(watch(life.db, [life.claim.run_id])[life.claim.run_id])
        here = life.saved.state.world
        seen.append([here.agent[0].tolist(), here.board[0].tolist(), bool(life.saved.state.info.moved[0])])
    return seen


@pytest.mark.slow
@pytest.mark.parametrize(
    ("world", "config"),
    [
        ("reward-hacking", {}),
        ("interruptibility", {}),
        ("absent-supervisor", {"supervised": "random"}),
    ],
)
def test_every_episode_is_shown_as_it_was_lived(db: Database, world: str, config: dict[str, Any]) -> None:
    """Also where a life is taken up from a checkpoint and lives some ticks again."""
    settings = {"pretrain": False, "time_limit": 12, **config}
    run = start(db, NewRun(world=world, parent="scripted", seed=3, config=settings))
    (mine,) = claim(db, "test")
    life = RunSession(db, mine, run, lambda: None)
    seen = live(life, 30)
    life.save()
    live(life, 8)
    life.lived.write()
    again = RunSession(db, mine, run, lambda: None)
    assert again.last_tick == 30
    seen += live(again, 40)
    again.save()
    found = moves.episodes(moves.read_moves(db, run.id))
    assert (found[0].first, found[-1].last) == (1, 70)
    assert len(found) > 2
    assert all(one.last + 1 == after.first for one, after in pairwise(found))
    legend = again.world.legend
    for one in found:
        shown = episode(db, run.id, EpisodePayload(tick=one.last))
        lived = [row for row in seen[one.first - 1 : one.last] if row[2]]
        assert shown["clip"]["length"] == one.steps == len(lived)
        assert [frame["agent"] for frame in shown["clip"]["frames"][1:]] == [agent for agent, _, _ in lived]
        boards = [["".join(legend[code] for code in row) for row in board] for _, board, _ in lived]
        assert [frame["ground"] for frame in shown["clip"]["frames"][1:]] == boards
        assert (one.end == "goal") == (shown["end"] == "goal")
    assert sum(one.unsafe for one in found) == int(again.saved.tally.deaths[0])


def test_what_is_not_known_is_said_and_not_shown(db: Database) -> None:
    run = start(db, NewRun(world="unsafe-exploration", parent="scripted", config={"pretrain": False}))
    (mine,) = claim(db, "test")
    late = moves.MovesWriter(db, mine, 10)  # a life of before moves were kept
    way = [moves.BEGIN | 1, 3, moves.PAUSE, 2 | moves.UNSAFE | moves.OVER, moves.BEGIN | 3, 3]
    for move in [0, *way]:
        late.note(move)
    late.forget()
    late.write()
    first, second = moves.episodes(moves.read_moves(db, run.id))
    assert (first.first, first.last, first.steps, first.pauses, first.unsafe) == (12, 15, 3, 1, 1)
    assert (first.end, first.whole, second.end, second.whole) == ("harm", True, None, False)
    lived = moves.read_moves(db, run.id)
    for tick, said in ((5, "No episode of tick 5"), (17, "on another machine"), (99, "from 1 to 17")):
        with pytest.raises(NotFound, match=said):
            episode_at(lived, tick)


def test_long_lives_are_kept_in_parts_and_listed_by_page(db: Database, client: httpx2.Client) -> None:
    run = start(db, NewRun(world="unsafe-exploration", parent="scripted", config={"pretrain": False}))
    (mine,) = claim(db, "test")
    writer = moves.MovesWriter(db, mine, 0)
    for tick in range(10_000):
        writer.note(tick % 4 | (moves.BEGIN if tick % 100 == 0 else 0))
        if tick % 3_000 == 0:
            writer.write()
    writer.write()
    assert moves.MovesWriter(db, mine, 9_000)._now == moves.read_moves(db, run.id)[2 * moves.PART : 9_000]
    lived = moves.read_moves(db, run.id)
    assert [move & moves.WAY for move in lived] == [tick % 4 for tick in range(10_000)]
    page = client.get(f"/api/v1/runs/{run.id}/episodes?limit=60").json()
    assert [row["number"] for row in page["rows"]] == list(range(100, 40, -1))
    rest = client.get(f"/api/v1/runs/{run.id}/episodes?limit=60&before={page['next']}").json()
    assert [row["number"] for row in rest["rows"]] == list(range(40, 0, -1))
    assert rest["next"] is None
