"""Figures for /metrics, in Prometheus' text format.

What this process did is counted as it happens. What the store holds is read at each scrape, by indexes: no
scrape reads a table that grows with answers. No label is a run, a question or anything else that people or
agents may make more of.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest
from prometheus_client.core import GaugeMetricFamily, Metric
from prometheus_client.process_collector import ProcessCollector
from prometheus_client.registry import Collector
from sqlalchemy import BigInteger, cast, func, select
from sqlalchemy.orm import Session

from parenting.server.admission import Admission
from parenting.server.connections.limits import Connections
from parenting.server.db import Database
from parenting.server.errors import ServerError
from parenting.server.load_figures import AdmissionFigures, ConnectionFigures
from parenting.server.statuses import LIVING, RUN_STATUSES, QueryStatus
from parenting.server.tables import KINDS, Query, Run, Worker

TYPE = "text/plain; version=0.0.4; charset=utf-8"
BUCKETS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0)
METHODS = ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS")


class Meters:
    """The counters of one web process."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        ProcessCollector(registry=self.registry)
        self._requests = Counter(
            "parenting_requests",
            "Requests by method, route and status.",
            ("method", "route", "status"),
            registry=self.registry,
        )
        self._seconds = Histogram(
            "parenting_request_seconds",
            "Time until a reply was complete, streams included.",
            ("route",),
            buckets=BUCKETS,
            registry=self.registry,
        )
        self._refusals = Counter(
            "parenting_refusals",
            "Requests that the store or this server could not serve, by error code.",
            ("code",),
            registry=self.registry,
        )

    def count(self, method: str, route: str, status: int, seconds: float) -> None:
        """Count a request whose reply is complete."""
        self._requests.labels(method if method in METHODS else "other", route, str(status)).inc()
        self._seconds.labels(route).observe(seconds)

    def refuse(self, code: str) -> None:
        """Count an error of the server's side by its code."""
        self._refusals.labels(code).inc()

    def watch(self, db: Database, streams: Callable[[], int], admission: Callable[[], Admission]) -> None:
        """Add the figures of the store, of the open streams and of the queues before the threads."""
        gauge = Gauge("parenting_streams_open", "Live streams that are open.", registry=self.registry)
        gauge.set_function(streams)
        self.registry.register(AdmissionFigures(admission))
        self.registry.register(StoreCollector(db))

    def watch_connections(self, connections: Connections) -> None:
        """Add the figures of the connections of a server that listens."""
        self.registry.register(ConnectionFigures(connections))

    def text(self) -> bytes:
        """Return all figures as text."""
        return generate_latest(self.registry)


class StoreCollector(Collector):
    """The figures that are read from the store at each scrape."""

    def __init__(self, db: Database) -> None:
        self.db = db

    def describe(self) -> list[Metric]:
        """Name nothing before the first scrape: the store may be away."""
        return []

    def collect(self) -> Iterator[Metric]:
        """Read the store. Where it refuses, one figure says so and the others are left out."""
        try:
            with self.db.read() as session:
                found = list(_figures(session, self.db))
        except ServerError:
            found = []
        yield _gauge("parenting_store_up", "1 if the store could be read, else 0.", float(bool(found)))
        yield from found


def _figures(session: Session, db: Database) -> Iterator[Metric]:
    runs = GaugeMetricFamily("parenting_runs", "Runs by status.", labels=["status"])
    numbers = {row[0]: row[1] for row in session.execute(_RUNS)}
    for status in RUN_STATUSES:
        runs.add_metric([str(status)], numbers.get(status, 0))
    yield runs
    answers, standing = session.execute(_ANSWERS).one()
    yield _gauge("parenting_answers_stored", "Answers in the store, corrections included.", answers)
    yield _gauge("parenting_answers_standing", "Answers that stand.", standing)
    open_now = GaugeMetricFamily(
        "parenting_questions_open", "Questions that wait for a parent.", labels=["kind"]
    )
    waits = {row.kind: row for row in session.execute(_OPEN)}
    for kind in KINDS:
        open_now.add_metric([kind], waits[kind].number if kind in waits else 0)
    yield open_now
    oldest = min((row.oldest for row in waits.values()), default=None)
    now = db.clock()
    waited = 0.0 if oldest is None else max(0.0, (now - oldest).total_seconds())
    yield _gauge("parenting_question_wait_seconds", "How long the oldest open question has waited.", waited)
    mark = db.mark(session)
    found = session.scalars(select(Worker.mark).where(Worker.epoch == mark.epoch))
    signs = [sign for sign in found if sign is not None]
    yield _gauge("parenting_workers", "Workers that have signed and not ended in order.", len(signs))
    if signs:
        age = max(0.0, mark.seconds - max(signs))
        yield _gauge("parenting_worker_sign_age_seconds", "Time since a worker's last sign of life.", age)


def _gauge(name: str, about: str, value: float) -> Metric:
    return GaugeMetricFamily(name, about, value=value)


_RUNS = select(Run.status, func.count()).group_by(Run.status)
_ANSWERS = select(
    cast(func.coalesce(func.sum(Run.answers), 0), BigInteger),
    cast(func.coalesce(func.sum(Run.answers - Run.retracted), 0), BigInteger),
)
_OPEN = (
    select(Query.kind, func.count().label("number"), func.min(Query.posted).label("oldest"))
    .join(Run, Run.id == Query.run_id)
    .where(Run.status.in_(LIVING), Query.status == QueryStatus.OPEN)
    .group_by(Query.kind)
)
