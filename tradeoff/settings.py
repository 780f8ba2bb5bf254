"""What each setting of a fit costs in time and in accuracy, against the optimum of all cells and against the data."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from ..fitting import Effort, Fit, fit
from ..tables import Table
from .timing import Timing

ROUNDS = 8
LEAST = 2
"""Rounds that are made whatever they take. If there are more, the first, in which programs are loaded, does not count."""

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
    *(Choice("starts", f"{n} start{'s' * (n > 1)}", Effort(starts=n)) for n in (1, 3)),
    *(Choice("tolerance", f"tolerance {t:.0e}".replace("e-0", "e-"), Effort(rtol=t)) for t in (1e-3, 1e-6)),
    *(Choice("nodes", f"{n} nodes", Effort(path="compressed", nodes=n)) for n in (3, 4, 6, 14)),
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
    """Both."""
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

    The choices take turns, round after round, until ``budget`` seconds are over. The optimum is where an exact search over
    every cell to the last digit ends that starts from the best fit that any choice found.
    """
    begin = time.perf_counter()
    order = sorted(choices, key=lambda c: c.preparation)
    prepare: dict[Key, list[float]] = {c.preparation: [] for c in order}
    solve: dict[str, list[float]] = {c.label: [] for c in order}
    fits: dict[str, Fit] = {}
    for k in range(ROUNDS):
        if k >= LEAST and time.perf_counter() - begin > budget:
            break
        for key, members in groupby(order, key=lambda c: c.preparation):
            fresh = replace(table)  # what is prepared for a table is kept with it
            for n, c in enumerate(members):
                f = _fit(fresh, best, c.effort)
                fits[c.label] = f
                solve[c.label].append(f.seconds["solve"])
                if n == 0:
                    prepare[key].append(f.seconds["prepare"])
    least = min((best, *fits.values()), key=lambda f: f.errors[best.loss])
    optimum = _fit(table, replace(best, model=least.model), Effort(path="exact", starts=3, rtol=1e-13))
    first = int(len(solve[choices[0].label]) > LEAST)
    out = []
    for c in choices:
        prepared, solved = prepare[c.preparation][first:], solve[c.label][first:]
        f = fits[c.label]
        relative, standard, spread = _distance(f, optimum)
        excess = (f.errors[f.loss] / optimum.errors[f.loss]) ** 2 - 1 if optimum.errors[f.loss] > 0 else float("nan")
        out.append(
            Setting(
                family=c.family,
                label=c.label,
                effort=c.effort,
                prepare=Timing.of(prepared),
                solve=Timing.of(solved),
                seconds=Timing.of([a + b for a, b in zip(prepared, solved, strict=True)]),
                path=f.path,
                relative=relative,
                standard_errors=standard,
                spreads=spread,
                excess=excess,
                errors=dict(f.errors),
            )
        )
    return optimum, out


def _fit(table: Table, like: Fit, effort: Effort) -> Fit:
    """The same fit with other settings. An instance of the model is a start; the optimum is polished from there."""
    model = like.model if effort.rtol < 1e-12 else type(like.model)
    return fit(table, model, loss=like.loss, measure=like.measure, max_angle=like.max_angle, effort=effort)  # type: ignore[arg-type]


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
