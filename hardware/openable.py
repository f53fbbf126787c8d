"""What is open inside a `with` block."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Self


class Openable(ABC):
    """Opened at the begin of a `with` block, closed at its end."""

    @abstractmethod
    def open(self) -> None:
        """Take hold of what is needed, or raise and hold nothing."""

    @abstractmethod
    def close(self) -> None:
        """Let go of it. May be called twice."""

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()
