"""Times that can be compared: side by side in one run, interleaved, with medians and spread."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

Key = TypeVar("Key")

SHORTEST = 2e-3
"""Seconds that one measurement takes at least: quicker calls are made several times in a row."""


@dataclass(frozen=True)
class Timing:
    """Seconds of repeated measurements."""

    median: float
    low: float
    """Lower quartile."""
    high: float
    """Upper quartile."""
    repeats: int

    @staticmethod
    def of(seconds: Sequence[float]) -> Timing:
        """Of single measurements, at least one."""
        low, median, high = (float(v) for v in np.percentile(seconds, [25, 50, 75]))
        return Timing(median, low, high, len(seconds))

    def per(self, count: int) -> Timing:
        """The time of one of ``count`` equal parts."""
        return Timing(self.median / count, self.low / count, self.high / count, self.repeats)

    def after(self, seconds: float) -> Timing:
        """The time together with what comes before it."""
        return Timing(self.median + seconds, self.low + seconds, self.high + seconds, self.repeats)


def interleaved(calls: Mapping[Key, Callable[[], object]], repeats: int, budget: float) -> dict[Key, Timing]:
    """Time every call ``repeats`` times, one after the other in rounds, so that a busy moment hits all of them alike.

    Each call is made once before, unmeasured. After three rounds no further one begins beyond ``budget`` seconds.
    """
    clock = time.perf_counter
    often, seconds = {}, {key: list[float]() for key in calls}
    begin = clock()
    for key, call in calls.items():
        call()
        before = clock()
        call()
        often[key] = max(1, int(np.ceil(SHORTEST / max(clock() - before, 1e-7))))
    for k in range(repeats):
        if k >= 3 and clock() - begin > budget:
            break
        for key, call in calls.items():
            before = clock()
            for _ in range(often[key]):
                call()
            seconds[key].append((clock() - before) / often[key])
    return {key: Timing.of(s) for key, s in seconds.items()}


__all__ = ["Timing", "interleaved"]
