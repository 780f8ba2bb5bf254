"""How long compiling took, as JAX itself reports it, kept apart from solving."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache

_local = threading.local()


@dataclass
class Compilation:
    """Seconds of tracing, lowering and compiling."""

    seconds: float = 0.0


@cache
def _listen() -> None:
    import jax.monitoring

    def record(event: str, duration_secs: float, **kwargs: str | int) -> None:
        current: Compilation | None = getattr(_local, "current", None)
        if current is not None and event.startswith("/jax/core/compile"):
            current.seconds += duration_secs

    jax.monitoring.register_event_duration_secs_listener(record)


@contextmanager
def compilation() -> Iterator[Compilation]:
    """Adds up what this thread compiles inside the block."""
    _listen()
    outer = getattr(_local, "current", None)
    _local.current = Compilation()
    try:
        yield _local.current
    finally:
        _local.current = outer
