"""How long a fit compiled or read programs, as JAX itself reports it, or waited for other fits: neither is solving."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import cache

from ..stored_programs import LOADED

Span = tuple[float, float]


@dataclass
class Compilation:
    """What a fit did beside its own work."""

    spans: list[Span] = field(default_factory=list)
    """When threads were tracing, lowering and compiling."""
    waits: list[Span] = field(default_factory=list)
    """When it waited for threads that were busy with other fits."""

    @property
    def seconds(self) -> float:
        """Time in which any thread compiled."""
        return _length(self.spans)

    @property
    def away(self) -> float:
        """Time in which any thread compiled, or it waited."""
        return _length([*self.spans, *self.waits])


def _length(spans: list[Span]) -> float:
    """Time in any of them."""
    total, until = 0.0, -math.inf
    for begin, end in sorted(spans):
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


def waited(begin: float, end: float) -> None:
    """From when to when, by the performance counter, the current fit waited for others."""
    current = _current.get()
    if current is not None and end > begin:
        current.waits.append((begin, end))


@contextmanager
def compilation() -> Iterator[Compilation]:
    """Adds up what is compiled inside the block, by this thread and by those that take over its context.

    A block within another counts for both.
    """
    _listen()
    outer, counted = _current.get(), Compilation()
    token = _current.set(counted)
    try:
        yield counted
    finally:
        _current.reset(token)
        if outer is not None:
            outer.spans += counted.spans
            outer.waits += counted.waits
