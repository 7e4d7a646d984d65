"""Queue of notifications in a store: an entry stays until its recipient has received it."""

import json
from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple, cast
from uuid import uuid4

from asperity.core.documents import JsonObject
from asperity.monitoring.store.database import SensorAddress, Store
from asperity.monitoring.store.schema import Run
from asperity.monitoring.store.sensor import now
from asperity.trend import ALARM_STATES


class PendingNotification(NamedTuple):
    """A notification that has not been delivered: its number, attempts, next attempt [s], JSON."""

    number: int
    attempts: int
    due_s: float
    text: str


class NotificationQueue:
    """Notifications on changes of state of the sensors of one place.

    `notify_states` are the states of which entering or leaving is notified.
    """

    def __init__(self, store: Store) -> None:
        self.store = store
        self.notify_states: Collection[str] = ALARM_STATES

    def add(
        self,
        run: Run,
        sensor: int,
        address: SensorAddress,
        recipients: Sequence[str],
        content: JsonObject,
    ) -> None:
        """Queue a notification to each recipient that does not know the state or one of its causes.

        `run` is that of the judgement's transaction: neither is stored without the other.
        """
        for name in recipients:
            query = "SELECT state, content FROM call WHERE sensor = ? AND who = ? ORDER BY id DESC"
            last = run(f"{query} LIMIT 1", (sensor, name)).fetchone()
            before, sent = (None, {}) if last is None else (last[0], json.loads(last[1]))
            # stores of older versions have no causes
            active = cast("Sequence[str]", content["causes"])
            new = before != content["state"] or not {*active} <= {*sent.get("causes", active)}
            if new and {before, content["state"]} & {*self.notify_states}:
                notification = {
                    "id": str(uuid4()),
                    "time": now(),
                    **address._asdict(),
                    "before": before,
                    **content,
                }
                run(
                    "INSERT INTO call (sensor, who, state, content, time) VALUES (?, ?, ?, ?, ?)",
                    (
                        sensor,
                        name,
                        content["state"],
                        json.dumps(notification),
                        notification["time"],
                    ),
                )

    def pending(self, sensor: int, recipient: str) -> list[PendingNotification]:
        """Return notifications that a recipient has not received yet, in order."""
        rows = self.store.read(
            "SELECT id, attempts, due, content FROM call WHERE sensor = ? AND who = ? "
            "AND answered IS NULL ORDER BY id",
            *(sensor, recipient),
        )
        return [PendingNotification(*row) for row in rows]

    def record_attempt(
        self, number: int, *, failure: str | None = None, due_s: float = 0.0
    ) -> None:
        """Store the outcome of an attempt: delivered, or the failure and the next attempt."""
        answered = None if failure is not None else now()
        with self.store.transaction() as run:
            run(
                "UPDATE call SET attempts = attempts + 1, failure = ?, due = ?, answered = ? "
                "WHERE id = ?",
                (failure, due_s, answered, number),
            )


def notification_content(judgement: Mapping[str, Any], recording: str) -> JsonObject:
    """Return the part of a judgement that is sent to recipients."""
    return {**judgement["alarm"], "verdict": judgement["verdict"], "recording": recording}
