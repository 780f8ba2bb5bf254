"""From many starts to the best optimum: colours first, then everything on a coarse table, then the whole one."""

from __future__ import annotations

from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array
from numpy.typing import NDArray

from .gram import Problem, Span, gram_residual
from .result import Optimum
from .solver import Box, Minimum, minimise

COLOUR_BLOCKS = (2, 1)
"""Blocks of cells, and compressed blocks, for refitting the linear coordinates alone."""
COARSE_BLOCKS = (6, 3)
"""Blocks of cells, and compressed blocks, for polishing the best shapes."""
POLISHED = 7
"""Starts that are polished on the coarse table, besides the best one of each further chart."""
FINISHED = 3
"""Distinct optima of the coarse table that are carried to the whole one, at most."""
SAME = 1e-3
"""Relative difference of cost below which two starts count as having reached the same optimum."""
WORTH = 1.3
"""An optimum of the coarse table is carried on if its cost is below this multiple of the best one's."""
MAX_STEPS = 300


class Stage(eqx.Module):
    """How much of the table a search looks at, when it stops, and how careful its first step is."""

    span: Span
    rtol: Array
    damping: Array

    @staticmethod
    def of(span: Span, rtol: float, damping: float) -> Stage:
        """A stage, its numbers as arguments of the compiled program."""
        return Stage(span, jnp.asarray(rtol), jnp.asarray(damping))


@eqx.filter_jit
def solve(problem: Problem, x: Array, box: Box, stage: Stage) -> Minimum:
    """Minimise from x. One program for coarse and whole tables and for any bounds."""
    return minimise(gram_residual(problem, stage.span), x, box, stage.rtol, stage.damping, MAX_STEPS)


@dataclass(frozen=True)
class Found:
    """The best optimum and what else there was."""

    problem: Problem
    box: Box
    minimum: Minimum
    starts: int
    optima: tuple[Optimum, ...]
    passes: int
    """Passes over the whole table."""
    exact: bool
    """Whether the minimum is one of the cells themselves, not of the compressed table."""


def _varied(ranked: list[tuple[float, Problem, Box, Minimum]]) -> list[tuple[float, Problem, Box, Minimum]]:
    """The best starts, without those that are a better one's double, and the best of every chart."""
    kept: list[tuple[float, Problem, Box, Minimum]] = []
    for r in ranked:
        double = kept and r[1] is kept[-1][1] and r[0] <= kept[-1][0] * (1 + 1e-9)
        new_chart = all(r[1] is not k[1] for k in kept)
        if not double and (len(kept) < POLISHED or new_chart):
            kept.append(r)
    return kept


def _finite(cost: float) -> float:
    return cost if np.isfinite(cost) and cost < 1e290 else np.inf


def search(problems: list[tuple[Problem, Box, list[NDArray[np.float64]]]]) -> Found:
    """Best optimum over problems that differ in their chart only, each with a box and starts in its coordinates.

    Every start gets its linear coordinates refitted on a coarse table; the best shapes are then polished there, all
    coordinates free, and the distinct optima among them on the whole table.
    """
    samples = problems[0][0].samples
    fast = samples.compressed > 0
    part = Span.nodes if fast else Span.cells
    colour = Stage.of(part(samples, COLOUR_BLOCKS[fast]), 1e-2, 1e-2)
    coarse = Stage.of(part(samples, COARSE_BLOCKS[fast]), 1e-6, 1.0)
    whole = Stage.of(part(samples), 1e-9, 1e-6)
    ranked: list[tuple[float, Problem, Box, Minimum]] = []
    for problem, box, starts in problems:
        linear = jnp.asarray([c.linear for c, _ in problem.chart.vector(problem.channels)])
        colours = Box(box.lower, box.upper, box.free & linear)
        for x in starts:
            m = solve(problem, jnp.asarray(x), colours, colour)
            ranked.append((_finite(float(m.cost)), problem, box, m))
    ranked.sort(key=lambda r: r[0])
    polished = []
    for _, problem, box, m in _varied(ranked):
        m = solve(problem, m.x, box, coarse)
        polished.append((_finite(float(m.cost)), problem, box, m))
    polished.sort(key=lambda p: p[0])
    distinct: list[tuple[float, Problem, Box, Minimum]] = []
    counts: list[int] = []
    for candidate in polished:
        cost = candidate[0]
        if distinct and cost <= distinct[-1][0] * (1 + SAME):
            counts[-1] += 1
        else:
            distinct.append(candidate)
            counts.append(1)
    finished: list[tuple[float, int, Problem, Box, Minimum]] = []
    passes = 0
    for (cost, problem, box, m), count in zip(distinct[:FINISHED], counts, strict=False):
        if finished and not cost <= WORTH * distinct[0][0]:
            continue
        end = solve(problem, m.x, box, whole)
        passes += 0 if fast else int(end.steps)
        finished.append((_finite(float(end.cost)), count, problem, box, end))
    finished.sort(key=lambda f: f[0])
    optima = [Optimum(float(np.sqrt(cost)), count) for cost, count, *_ in finished]
    optima += [Optimum(float(np.sqrt(d[0])), n) for d, n in list(zip(distinct, counts, strict=True))[len(finished) :]]
    _, _, problem, box, best = finished[0]
    return Found(problem, box, best, sum(len(s) for _, _, s in problems), _merged(optima), passes, not fast)


def _merged(optima: list[Optimum]) -> tuple[Optimum, ...]:
    """Optima of one error counted together, best first."""
    merged: list[Optimum] = []
    for o in sorted(optima, key=lambda o: o.error):
        if merged and o.error <= merged[-1].error * (1 + SAME / 2):
            merged[-1] = Optimum(merged[-1].error, merged[-1].starts + o.starts)
        else:
            merged.append(o)
    return tuple(merged)
