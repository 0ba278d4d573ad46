"""The load of a web process for /metrics: connections, requests that wait, threads, and what was refused."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from parenting.server.admission import Admission
from parenting.server.connections.limits import Connections


class ConnectionFigures(Collector):
    """The figures of the open connections."""

    def __init__(self, connections: Connections) -> None:
        self.connections = connections

    def collect(self) -> Iterator[Metric]:
        """Read the counts."""
        yield GaugeMetricFamily(
            "parenting_connections_open", "Connections of clients that are open.", value=len(self.connections)
        )
        yield CounterMetricFamily(
            "parenting_connections_ended",
            "Idle connections that were closed to make room.",
            value=self.connections.ended,
        )
        refused = CounterMetricFamily(
            "parenting_connections_refused",
            "Connections and requests refused before the application, by error code.",
            labels=["code"],
        )
        for code, number in self.connections.refused.items():
            refused.add_metric([code], number)
        yield refused


class AdmissionFigures(Collector):
    """The figures of the queues before the threads."""

    def __init__(self, admission: Callable[[], Admission]) -> None:
        self.admission = admission

    def collect(self) -> Iterator[Metric]:
        """Read the counts of both gates."""
        waiting = GaugeMetricFamily(
            "parenting_requests_waiting", "Requests that wait for a thread.", labels=["kind"]
        )
        busy = GaugeMetricFamily(
            "parenting_threads_busy", "Threads that serve a request of the store.", labels=["kind"]
        )
        refused = CounterMetricFamily(
            "parenting_admission_refused", "Requests that got no thread.", labels=["kind", "reason"]
        )
        admission = self.admission()
        for kind, gate in (("write", admission.writing), ("read", admission.reading)):
            waiting.add_metric([kind], gate.waiting)
            busy.add_metric([kind], gate.busy)
            for reason, number in gate.refused.items():
                refused.add_metric([kind, reason], number)
        yield from (waiting, busy, refused)
