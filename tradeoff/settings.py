"""What each setting of a fit costs in time and in accuracy, against the optimum of all cells and against the data."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

import numpy as np

from ..fitting import Effort, Fit, fit
from ..tables import Table
from .timing import Timing

ROUNDS = 8
LEAST = 12.0
"""Seconds that there are for repeats in any case."""

Key = tuple[bool, int]


@dataclass(frozen=True)
class Choice:
    """A setting to measure: what is unlike the default, in words, and all of it."""

    family: str
    label: str
    effort: Effort

    @property
    def preparation(self) -> Key:
        """What a table is prepared for; settings that agree in it share the work."""
        return self.effort.path == "exact", self.effort.nodes


CHOICES: tuple[Choice, ...] = (
    Choice("default", "default", Effort()),
    Choice("starts", "1 start", Effort(starts=1)),
    Choice("tolerance", "tolerance 1e-3", Effort(rtol=1e-3)),
    *(Choice("nodes", f"{n} nodes", Effort(path="compressed", nodes=n)) for n in (3, 6, 14)),
    Choice("several", "6 nodes, 1 start, 1e-4", Effort(path="compressed", nodes=6, starts=1, rtol=1e-4)),
    *(Choice("cells", f"{s:.0%} of the cells", Effort(path="exact", cells=s)) for s in (0.01, 0.1)),
    Choice("cells", "every cell", Effort(path="exact")),
)


@dataclass(frozen=True)
class Setting:
    """What came of one choice. Errors against the optimum count the parameters that the data determine."""

    family: str
    label: str
    effort: Effort
    prepare: Timing
    """Seconds of making the table ready; compiling and reading the file are left out."""
    solve: Timing
    """Seconds of the search, the pass over all cells that judges it, and the error bars."""
    seconds: Timing
    """Both: the median of preparing and the solve."""
    path: str
    """Which residuals the optimum is one of, ``exact`` or ``compressed``."""
    relative: float
    """Largest relative error of a parameter (relative to its standard error where that is larger)."""
    standard_errors: float
    """Largest error of a parameter in standard errors."""
    spreads: float
    """Largest error of a parameter in spreads, the error bars of the jackknife over angular bands."""
    excess: float
    """Cost (sum of squares) over that of the optimum, minus 1."""
    errors: dict[str, float]
    """Against the data, over all fitted cells, by loss."""


def settings(table: Table, best: Fit, budget: float, choices: Sequence[Choice] = CHOICES) -> tuple[Fit, list[Setting]]:
    """The optimum of all cells for one fitted model, and what every choice makes of it.

    The choices take turns, round after round. One begins while what it took last time is left of ``budget`` seconds, or of
    :data:`LEAST` after the first round; a choice for which there is no time at all is left out, the default never. The
    optimum is where an exact search over every cell to the last digit ends that starts from the best fit found.
    """
    end = time.perf_counter() + budget
    order = sorted(choices, key=lambda c: (c.preparation != choices[0].preparation, c.preparation))
    prepare: dict[Key, list[float]] = {c.preparation: [] for c in order}
    solve: dict[str, list[float]] = {c.label: [] for c in order}
    fits: dict[str, Fit] = {}
    for k in range(ROUNDS):
        if k == 1:
            end = max(end, time.perf_counter() + LEAST)
        for key, members in groupby(order, key=lambda c: c.preparation):
            fresh = replace(table)  # what is prepared for a table is kept with it
            ready = False
            for c in members:
                last = solve[c.label][-1] if solve[c.label] else 0.0
                late = time.perf_counter() + last > end or (k > 0 and not last)
                if late and (last or c.family != "default"):
                    continue
                fits[c.label] = f = _fit(fresh, type(best.model), best, c.effort)
                solve[c.label].append(f.seconds["solve"])
                if not ready:
                    prepare[key].append(f.seconds["prepare"])
                ready = True
    optimum = _optimum(table, min((best, *fits.values()), key=lambda f: f.errors[best.loss]))
    out = []
    for c in (c for c in choices if c.label in fits):
        prepared, solved = Timing.of(_settled(prepare[c.preparation])), Timing.of(_settled(solve[c.label]))
        f = fits[c.label]
        relative, standard, spread = _distance(f, optimum)
        excess = (f.errors[f.loss] / optimum.errors[f.loss]) ** 2 - 1 if optimum.errors[f.loss] > 0 else float("nan")
        out.append(
            Setting(
                family=c.family,
                label=c.label,
                effort=c.effort,
                prepare=prepared,
                solve=solved,
                seconds=solved.after(prepared.median),
                path=f.path,
                relative=relative,
                standard_errors=standard,
                spreads=spread,
                excess=excess,
                errors=dict(f.errors),
            )
        )
    return optimum, out


def _settled(seconds: list[float]) -> list[float]:
    """Without the first measurement, in which programs are loaded, where enough others are left."""
    return seconds[1:] if len(seconds) > 2 else seconds


def _optimum(table: Table, least: Fit) -> Fit:
    """Where an exact search from there ends; the fit itself if that is not better."""
    end = _fit(table, least.model, least, Effort(path="exact", starts=1, rtol=1e-13))
    return end if end.errors[end.loss] <= least.errors[least.loss] * (1 + 1e-9) else least


def _fit(table: Table, model: Any, like: Fit, effort: Effort) -> Fit:
    """A model fitted as another fit was, but for the effort."""
    return fit(table, model, loss=like.loss, measure=like.measure, max_angle=like.max_angle, effort=effort)


def _distance(f: Fit, optimum: Fit) -> tuple[float, float, float]:
    """Largest error of a parameter: relative, in standard errors and in spreads; NaN if no parameter is determined."""
    if f.model is None:
        return float("inf"), float("inf"), float("inf")

    def largest(scale: Callable[[str], np.ndarray]) -> float:
        off = [np.abs(v - optimum.parameters[n]) / scale(n) for n, v in f.parameters.items()]
        known = [x for o in off for x in np.ravel(o) if not np.isnan(x)]
        return float(max(known, default=np.nan))

    return (
        largest(lambda n: np.maximum(np.abs(optimum.parameters[n]), optimum.stderr[n])),
        largest(lambda n: optimum.stderr[n]),
        largest(lambda n: optimum.spread[n]),
    )


__all__ = ["CHOICES", "Choice", "Setting", "settings"]
