"""One bounded event queue per device: filled by its one source, read independently by the robot and by a recorder."""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")


class Subscription(Generic[T]):
    """One reader's view of a queue, oldest first."""

    def __init__(self, capacity: int) -> None:
        self._pending: deque[T] = deque()
        self._capacity = capacity
        self.dropped = 0

    def put(self, event: T) -> None:
        """Append one event; the oldest one goes when the queue is full, and is counted."""
        if len(self._pending) >= self._capacity:
            self._pending.popleft()
            self.dropped += 1
        self._pending.append(event)

    def take(self) -> list[T]:
        """Remove and return everything pending."""
        taken: list[T] = []
        while self._pending:  # popleft one by one: a device thread may be appending
            taken.append(self._pending.popleft())
        return taken


class EventQueue(Generic[T]):
    """Events of one device. Every subscriber gets every event from its subscription on; `latest` is a view of the newest."""

    def __init__(self, capacity: int = 4096) -> None:
        self._capacity = capacity
        self._subscribers: list[Subscription[T]] = []
        self.latest: T | None = None

    def subscribe(self) -> Subscription[T]:
        """Start a new reader."""
        subscription = Subscription[T](self._capacity)
        self._subscribers.append(subscription)
        return subscription

    def unsubscribe(self, subscription: Subscription[T]) -> None:
        """End a reader; one that is unknown is left alone."""
        if subscription in self._subscribers:
            self._subscribers.remove(subscription)

    def put(self, event: T) -> None:
        """Deliver one event to all readers."""
        self.latest = event
        for subscription in self._subscribers:
            subscription.put(event)
