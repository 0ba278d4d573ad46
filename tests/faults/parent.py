"""A parent as a thread: it leases, thinks, answers or skips, has second thoughts, and writes the ledger.

What it sends, it sends again until it is told what became of it.
"""

from __future__ import annotations

import random
import threading
import time
from datetime import UTC, datetime
from typing import Any

import httpx2

from tests.faults.ledger import Ledger, Offer

CHOICES = ("left", "right", "either")
"""Without *neither*: an agent that is refused everything waits for its operator."""
PAUSE = 0.05
"""Seconds before it asks or sends again. Shorter ones take the processor from what they wait for."""
SECONDS = 10.0
AGAIN = 0.1
"""The share of answers that are sent again, of those sent with another choice, and of leases let go."""
SECOND_THOUGHTS, SKIPS = 0.1, 0.05
"""The share of answers that are changed, of those taken back and given again, and of questions skipped."""


class Parent(threading.Thread):
    """One client of a run. `complaints` are replies that break a promise."""

    def __init__(
        self, url: str, run: int | str, name: str, ledger: Ledger, seed: float, skips: float = SKIPS
    ) -> None:
        super().__init__(daemon=True)
        self.http = httpx2.Client(base_url=f"{url}/api/v1/", timeout=SECONDS, trust_env=False)
        self.run_id, self.client, self.ledger, self.rng = run, name, ledger, random.Random(seed)
        self.skips = skips
        self.complaints: list[str] = []
        self.told = self.refused = self.resent = 0
        self.times: list[float] = []
        self.leaving = threading.Event()

    def run(self) -> None:
        """Answer until told to leave."""
        while not self.leaving.is_set():
            asked = time.monotonic()
            reply = self._send(f"runs/{self.run_id}/queries/lease", {})
            if reply is None or reply.status_code != 200:
                time.sleep(PAUSE)
                continue
            self._answer(reply.json(), asked)
        self.http.close()

    def _answer(self, question: dict[str, Any], asked: float) -> None:
        since, query = time.monotonic(), question["id"]
        ends = datetime.fromisoformat(question["leased_until"]) - datetime.now(UTC)
        until = time.monotonic() + ends.total_seconds()
        if self.rng.random() < AGAIN:
            if self._send(f"queries/{query}/release", {}) is not None:
                self.ledger.offered(Offer(str(query), self.client, since, since))
            return
        skips, choice = self.rng.random() < self.skips, self.rng.choice(CHOICES)
        receipt = self._until_told(query, "skip") if skips else self._until_told(query, "answer", choice)
        self.ledger.offered(Offer(str(query), self.client, since, min(until, self.sent)))
        if receipt is not None:
            self._note(receipt)
            self.told += 1
            self.times.append(time.monotonic() - asked)
            if not skips:
                self._ask_too_much(query, choice, receipt)
            self._think_again(query)

    def _note(self, receipt: dict[str, Any] | None) -> None:
        """Write a receipt down. That of a skip that was stored before has no number."""
        if receipt is not None and receipt["number"] is not None:
            self.ledger.told({"choice": "skip", **receipt}, self.client)

    def _think_again(self, query: int | str) -> None:
        """Change an answer, or take it back and give another one; what was heard can only be changed."""
        if self.rng.random() < SECOND_THOUGHTS:
            self._note(self._until_told(query, "change", self.rng.choice(CHOICES)))
        if self.rng.random() < SECOND_THOUGHTS:
            found = self._until_told(query, "withdraw")
            if found is not None:
                verb = "answer" if found["outcome"] == "withdrawn" else "change"
                self._note(self._until_told(query, verb, self.rng.choice(CHOICES)))

    def _until_told(self, query: int | str, verb: str, choice: str | None = None) -> dict[str, Any] | None:
        """Send something until a reply says what became of it: its receipt, or None where it was refused."""
        self.sent = time.monotonic()
        while not self.leaving.is_set():
            reply = self._send(f"queries/{query}/{verb}", {} if choice is None else {"choice": choice})
            if reply is not None and reply.status_code < 300:
                receipt: dict[str, Any] = reply.json()
                return receipt
            if reply is not None and reply.status_code == 409:
                self.refused += 1
                return None
            self.resent += 1
            time.sleep(PAUSE)
        return None

    def _ask_too_much(self, query: int | str, choice: str, receipt: dict[str, Any]) -> None:
        """Send the same again, or something else: the same reply (A2), or 409."""
        if self.rng.random() < AGAIN:
            again = self._send(f"queries/{query}/answer", {"choice": choice})
            if again is not None and again.status_code < 500 and again.json() != receipt:
                self.complaints.append(f"A2 the same answer got {again.json()} after {receipt}")
        if self.rng.random() < AGAIN:
            other = next(word for word in CHOICES if word != choice)
            again = self._send(f"queries/{query}/answer", {"choice": other})
            if again is not None and again.status_code < 500 and again.status_code != 409:
                self.complaints.append(f"A2 {other} after {choice} got {again.status_code}")

    def _send(self, path: str, body: dict[str, Any]) -> httpx2.Response | None:
        """The reply, or None where none came to its end. A reply that breaks E12 is a complaint."""
        try:
            reply = self.http.post(path, json={"client_id": self.client, **body})
        except httpx2.TransportError:
            return None
        if reply.status_code >= 500 and reply.status_code not in (503, 507):
            self.complaints.append(f"{reply.status_code} at {path}: {reply.text[:200]}")
        return reply
