"""How long compiling took, as JAX itself reports it, kept apart from solving."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache


@dataclass
class Compilation:
    """Seconds of tracing, lowering and compiling."""

    seconds: float = 0.0


_current: ContextVar[Compilation | None] = ContextVar("compilation", default=None)


@cache
def _listen() -> None:
    import jax.monitoring

    def record(event: str, duration_secs: float, **kwargs: str | int) -> None:
        current = _current.get()
        if current is not None and event.startswith("/jax/core/compile"):
            current.seconds += duration_secs

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
