"""The cheapest settings that are predicted to keep a tolerance, or the best ones within a time budget.

What to expect of each rung was measured once on real materials (benchmarks/rungs.py wrote rungs.json): by how much its error
exceeds that of the best fit known, and how long it took. Times are scaled to the machine by a fixed calculation and to the
table by its cells.
"""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from .effort import DEFAULT, Effort

RUNGS: tuple[Effort, ...] = (
    Effort(path="compressed", shapes=0.25, starts=1, rtol=1e-4),
    Effort(path="compressed", shapes=0.5, starts=2, rtol=1e-6),
    Effort(path="compressed", starts=3, rtol=1e-9),
    DEFAULT,
)
"""From the cheapest to the settings that a fit takes by itself. All run the same compiled programs."""


@dataclass(frozen=True)
class Expected:
    """What one rung is expected to do."""

    excess: float
    """Error above that of the best fit, relative, which 19 of 20 materials stay below."""
    seconds: float
    """Preparing and fitting a table, nothing compiled."""


@dataclass(frozen=True)
class Plan:
    """What was asked for and what was predicted of the settings that were chosen."""

    tolerance: float | None
    """Largest error above that of the best fit, relative."""
    time_budget: float | None
    """Seconds of preparing and fitting."""
    rung: int
    """Place on the ladder, 0 the cheapest."""
    excess: float | None
    """Error above that of the best fit, relative, that is predicted; None where nothing is known of the model."""
    seconds: float | None
    """Predicted time of preparing and fitting; None likewise."""
    holds: bool
    """Whether the prediction keeps what was asked for."""


def plan(model: str, cells: int, tolerance: float | None, time_budget: float | None, lowest: int = 0) -> Plan:
    """The rung to fit ``model`` with to a table of so many cells, not below ``lowest``.

    With a tolerance the cheapest that keeps it; with a budget the best within it; with both the cheapest that keeps the
    tolerance, and ``holds`` says whether the budget allows it. Of a model without measurements nothing is predicted.

    Raises ValueError for a tolerance outside (0, 1) or a budget that is not positive.
    """
    if tolerance is not None and not (isinstance(tolerance, float | int | np.number) and 0 < tolerance < 1):
        raise ValueError(f"a tolerance is a share of the error in (0, 1), not {tolerance!r}")
    if time_budget is not None and not 0 < time_budget < float("inf"):
        raise ValueError(f"a time budget is a positive number of seconds, not {time_budget:g}")
    known = expected(model, cells)
    last = len(RUNGS) - 1
    if not known:
        return Plan(tolerance, time_budget, last, None, None, holds=False)
    if tolerance is not None:
        rung = next((i for i in range(lowest, last) if known[i].excess <= tolerance), last)
    else:
        rung = max((i for i in range(lowest, last + 1) if known[i].seconds <= (time_budget or 0.0)), default=lowest)
    e = known[rung]
    holds = (tolerance is None or e.excess <= tolerance) and (time_budget is None or e.seconds <= time_budget)
    return Plan(tolerance, time_budget, rung, e.excess, e.seconds, holds)


def expected(model: str, cells: int) -> list[Expected]:
    """What each rung is expected to do with a table of so many cells on this machine; empty if nothing is known."""
    measured = _measured()
    scale = yardstick() / measured["yardstick"] * cells / measured["cells"]
    return [Expected(e["excess"], e["seconds"] * scale) for e in measured["models"].get(model, [])]


@cache
def _measured() -> dict[str, Any]:
    found: dict[str, Any] = json.loads((Path(__file__).parent / "rungs.json").read_text(encoding="utf-8"))
    return found


@cache
def yardstick() -> float:
    """Seconds that a fixed calculation takes on this machine, at best."""
    x = np.linspace(0.0, 10.0, 500_000)
    best = float("inf")
    for _ in range(5):
        begin = time.perf_counter()
        np.log1p(x)
        best = min(best, time.perf_counter() - begin)
    return best


__all__ = ["RUNGS", "Expected", "Plan", "expected", "plan", "yardstick"]
