"""Independent pieces of one fit side by side: compiled programs and NumPy run outside Python's lock."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from functools import cache
from typing import TypeVar

import jax

from .timing import waited

T = TypeVar("T")
R = TypeVar("R")


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(os.cpu_count() or 1, thread_name_prefix="brdfit")


def in_threads(function: Callable[[T], R], items: Sequence[T]) -> Iterator[R]:
    """``function`` of each item, in order, in float64. A piece must not ask for pieces of its own: it may wait for ever."""
    begun: list[float] = []

    def double(item: T) -> R:
        begun.append(time.perf_counter())
        with jax.enable_x64(True):  # JAX keeps this setting thread by thread
            return function(item)

    contexts = [copy_context() for _ in items]
    return _timed(_pool().map(lambda context, item: context.run(double, item), contexts, items), begun)


def _timed(results: Iterator[R], begun: list[float]) -> Iterator[R]:
    """The results; what was waited for before any piece began is waiting for the pieces of other fits."""
    asked = time.perf_counter()
    for result in results:
        waited(asked, begun[0])
        asked = math.inf
        yield result
