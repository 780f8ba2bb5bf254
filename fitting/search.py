"""From many starts to the best optimum: colours first, then everything on a coarse table, then the whole one."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import Any, NamedTuple

import equinox as eqx
import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from ..programs import program
from .effort import DEFAULT, Effort
from .gram import Problem, Span, gram_residual
from .result import Optimum
from .solver import Box, Minimum, minimise
from .threads import in_threads

COLOUR_BLOCKS = (2, 1)
"""Blocks of cells, and compressed blocks, for refitting the linear coordinates alone."""
COARSE_BLOCKS = (6, 3)
"""Blocks of cells, and compressed blocks, for polishing the best shapes."""
COARSE = 1e-6
"""Relative decrease of the cost at which that polish ends, or where the whole table's does if that is earlier."""
FINISHED = 3
"""Distinct optima of the coarse table that are carried to the whole one, at most."""
ROUGH = 1e-4
"""Relative decrease of the cost at which the first polish ends, on as few blocks as the colours were fitted on: what has
come together by then goes on as one."""
SAME = 1e-3
"""Relative difference of cost below which two starts count as having reached the same optimum."""
WORTH = 1.3
"""An optimum of the coarse table is carried on if its cost is below this multiple of the best one's."""
MAX_STEPS = 300
COLOUR_STEPS = 10
"""Steps of a refit of colours, at most: nearly all take 3 to 9, and of a lobe too narrow to matter 50 and more."""
RUN = 8
"""Starts, neighbours in shape, whose colours are fitted one after another; runs go side by side."""


class Stage(eqx.Module):
    """How much of the table a search looks at, when it stops, how careful its first step is, and how many it may take."""

    span: Span
    rtol: Float[Any, ""]
    damping: Float[Any, ""]
    steps: Int[Any, ""]

    @staticmethod
    def of(span: Span, rtol: float, damping: float, steps: int = MAX_STEPS) -> Stage:
        """A stage, its numbers as arguments of the compiled program."""
        return Stage(span, np.asarray(rtol), np.asarray(damping), np.asarray(steps))


@program
def solve(problem: Problem, x: Float[Any, " n"], box: Box, stage: Stage) -> Minimum:
    """Minimise from x. One program for coarse and whole tables and for any bounds."""
    return minimise(gram_residual(problem, stage.span), x, box, stage.rtol, stage.damping, stage.steps)


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


class Candidate(NamedTuple):
    """A minimum of some problem, and its cost (infinite where there is none)."""

    cost: float
    problem: Problem
    box: Box
    minimum: Minimum
    starts: int = 1
    """How many starts ended here."""


def search(problems: list[tuple[Problem, Box, list[NDArray[np.float64]]]], effort: Effort = DEFAULT) -> Found:
    """Best optimum over problems that differ in their chart only, each with a box and starts in its coordinates.

    Every start gets its linear coordinates refitted on a coarse table; the best shapes are then polished there, all
    coordinates free, and the distinct optima among them on the whole table. A further chart is searched only if the best
    optimum so far lies where it takes over.
    """
    samples = problems[0][0].samples
    fast = samples.compressed > 0
    part = Span.nodes if fast else Span.cells
    blocks = samples.compressed if fast else max(1, round(effort.cells * samples.blocks))
    coarse = (
        Stage.of(part(samples, min(COLOUR_BLOCKS[fast], blocks)), 1e-2, 1e-2, COLOUR_STEPS),
        Stage.of(part(samples, min(COARSE_BLOCKS[fast], blocks)), max(COARSE, effort.rtol), 1.0),
    )
    whole = Stage.of(part(samples, blocks), effort.rtol, 1e-6)
    polished: list[Candidate] = []
    tried = 0
    for problem, box, starts in problems:
        tried += len(starts)
        polished = sorted([*polished, *_polished(problem, box, starts, *coarse, effort.starts)], key=_cost)
        best = polished[0]
        if not best.problem.chart.continues(np.asarray(best.minimum.x), problem.channels):
            break
    distinct = _distinct(polished)
    finished = _polish([d for d in distinct[:FINISHED] if d.cost <= WORTH * distinct[0].cost] or distinct[:1], whole)
    optima = [Optimum(float(np.sqrt(c.cost)), c.starts) for c in (*finished, *distinct[len(finished) :])]
    best = min(finished, key=_cost)
    passes = 0 if fast else sum(int(c.minimum.steps) for c in finished)
    return Found(best.problem, best.box, best.minimum, tried, _merged(optima), passes, not fast)


def _polished(
    problem: Problem, box: Box, starts: list[NDArray[np.float64]], colour: Stage, coarse: Stage, count: int
) -> list[Candidate]:
    """The best starts after a refit of the linear coordinates, polished, roughly first; of doubles only one."""
    linear = np.asarray([c.linear for c, _ in problem.chart.vector(problem.channels)])
    colours = Box(box.lower, box.upper, box.free & linear)

    def coloured(run: list[NDArray[np.float64]]) -> list[Candidate]:
        """Starts whose shapes are alike: each begins with the colours of the one before, which are close to its own."""
        found: list[Candidate] = []
        for x in run:
            begin = np.where(colours.free, found[-1].minimum.x, x) if found else x
            end = _candidate(problem, box, solve(problem, begin, colours, colour))
            if found and not end.cost < np.inf:  # with those colours this shape has a value that the loss cannot take
                end = _candidate(problem, box, solve(problem, x, colours, colour))
            found.append(end)
        return found

    runs = [starts[i : i + RUN] for i in range(0, len(starts), RUN)]
    ranked = sorted(chain.from_iterable(in_threads(coloured, runs)), key=_cost)
    kept: list[Candidate] = []
    for c in ranked:
        if len(kept) < count and not (kept and c.cost <= kept[-1].cost * (1 + 1e-9)):
            kept.append(c)
    kept = kept or ranked[:1]
    rough = Stage.of(colour.span, ROUGH, 1.0)
    return _polish(_distinct(_polish(kept, rough)), coarse)


def _polish(candidates: list[Candidate], stage: Stage) -> list[Candidate]:
    """All coordinates free, from where each candidate is."""

    def polished(c: Candidate) -> Candidate:
        return _candidate(c.problem, c.box, solve(c.problem, c.minimum.x, c.box, stage), c.starts)

    return list(in_threads(polished, candidates))


def _distinct(candidates: list[Candidate]) -> list[Candidate]:
    """Candidates by cost, those of nearly one cost as one."""
    distinct: list[Candidate] = []
    for c in sorted(candidates, key=_cost):
        if distinct and c.cost <= distinct[-1].cost * (1 + SAME):
            distinct[-1] = distinct[-1]._replace(starts=distinct[-1].starts + c.starts)
        else:
            distinct.append(c)
    return distinct


def _candidate(problem: Problem, box: Box, minimum: Minimum, starts: int = 1) -> Candidate:
    cost = float(minimum.cost)
    return Candidate(cost if np.isfinite(cost) and cost < 1e290 else np.inf, problem, box, minimum, starts)


def _cost(candidate: Candidate) -> float:
    return candidate.cost


def _merged(optima: list[Optimum]) -> tuple[Optimum, ...]:
    """Optima of one error counted together, best first."""
    merged: list[Optimum] = []
    for o in sorted(optima, key=lambda o: o.error):
        if merged and o.error <= merged[-1].error * (1 + SAME / 2):
            merged[-1] = Optimum(merged[-1].error, merged[-1].starts + o.starts)
        else:
            merged.append(o)
    return tuple(merged)
