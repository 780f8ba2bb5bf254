"""How long compiling and reading of programs took, as JAX itself reports it, kept apart from solving."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import cache

from ..stored_programs import LOADED


@dataclass
class Compilation:
    """When threads were tracing, lowering and compiling."""

    spans: list[tuple[float, float]] = field(default_factory=list)

    @property
    def seconds(self) -> float:
        """Time in which any of them was."""
        total, until = 0.0, -math.inf
        for begin, end in sorted(self.spans):
            total += max(0.0, end - max(begin, until))
            until = max(until, end)
        return total


_current: ContextVar[Compilation | None] = ContextVar("compilation", default=None)


@cache
def _listen() -> None:
    import jax.monitoring

    def record(event: str, duration_secs: float, **kwargs: str | int) -> None:
        current = _current.get()
        if current is not None and event.startswith(("/jax/core/compile", LOADED)):
            now = time.perf_counter()
            current.spans.append((now - duration_secs, now))

    jax.monitoring.register_event_duration_secs_listener(record)


@contextmanager
def compilation() -> Iterator[Compilation]:
    """Adds up what is compiled inside the block, by this thread and by those that take over its context."""
    _listen()
    counted = Compilation()
    token = _current.set(counted)
    try:
        yield counted
    finally:
        _current.reset(token)
