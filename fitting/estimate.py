"""Parameters and their uncertainties from a minimum in a chart's coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jaxtyping import Array, Float
from numpy.typing import NDArray

from ..models import parameters_of
from ..programs import program
from .coordinates import Chart
from .gram import Problem, Span, loss_errors, statistics
from .losses import Loss
from .result import Named
from .solver import Box
from .threads import in_threads
from .uncertainty import Uncertainty, uncertainty, unknown

Reals = NDArray[np.float64]

_statistics = program(statistics)
errors_of = program(loss_errors)


@program
def _parameters(chart: Chart, x: Float[Any, " n"], channels: int) -> tuple[dict[str, Array], dict[str, Array]]:
    """Parameters ``[C]`` of a vector of coordinates, and their derivatives ``[C, n]``."""

    def values(y: Array) -> dict[str, Array]:
        own, shared = chart.split(y, channels)
        return jax.vmap(lambda o: chart.parameters(o, shared))(own)

    return values(x), jax.jacfwd(values)(x)


@dataclass(frozen=True)
class Estimate:
    """The fields of a :class:`~brdfit.fitting.result.Fit` that say what was found and how sure it is."""

    parameters: Named
    stderr: Named
    spread: Named
    covariance: dict[str, dict[str, Reals]]
    at_bound: tuple[str, ...]
    labels: tuple[str, ...]
    correlation: Reals
    undetermined: tuple[str, ...]


@dataclass(frozen=True)
class Judgement:
    """What all cells say of an optimum."""

    estimate: Estimate
    errors: Reals
    """Error under each loss asked for."""
    shift: Reals
    """Standard errors by which one exact Gauss-Newton step over all cells would move each coordinate."""
    gain: float
    """Share of the error that this step would take off."""


def judge(
    problem: Problem, x: Reals, box: Box, losses: tuple[Loss, ...], error_bars: bool = True, cost: float | None = None
) -> Judgement:
    """Parameters, their covariances and the errors at an optimum (one pass over all cells); or, without error bars, the one
    error that ``cost``, of the compressed table, amounts to.
    """
    n = problem.size
    if not error_bars:
        u = unknown(n)
        estimate = _estimate(problem, x, box, u)
        model = problem.chart.cls(**estimate.parameters)
        errors = errors_of(model, problem.samples, losses) if cost is None else _error_of_rows(problem, losses, cost)
        return Judgement(estimate, np.asarray(errors), u.shift, u.gain)
    halves = in_threads(lambda span: _statistics(problem, x, losses, span), Span.halves(problem.samples))
    found = jax.tree.map(lambda *parts: np.sum(parts, 0), *halves)
    bands = found.bands.reshape(-1, n + 1, n + 1)
    u = uncertainty(bands, found.middle, np.asarray(box.free) & (x > box.lower) & (x < box.upper))
    return Judgement(_estimate(problem, x, box, u), np.sqrt(found.sums[:, 0] / found.sums[:, 1]), u.shift, u.gain)


def _error_of_rows(problem: Problem, losses: tuple[Loss, ...], cost: float) -> Reals:
    """sqrt(cost / sum w) under the loss that was fitted, NaN under the others."""
    nodes = problem.samples.nodes
    assert nodes is not None
    relative = problem.loss.weight(nodes.geometry)
    total = problem.channels * float(np.sum(nodes.weight if relative is None else nodes.weight * relative))
    return np.array([np.sqrt(cost / total) if loss.name == problem.loss.name else np.nan for loss in losses])


def _estimate(problem: Problem, x: Reals, box: Box, u: Uncertainty) -> Estimate:
    """Parameters at coordinates x, and their covariances from those of the coordinates."""
    chart, channels = problem.chart, problem.channels
    values, slopes = _parameters(chart, x, channels)
    specs = parameters_of(chart.cls)
    parameters = {p.name: np.asarray(values[p.name]) if p.per_channel else np.asarray(values[p.name])[0] for p in specs}
    rows = [(p.name, k) for p in specs for k in (range(channels) if p.per_channel else (None,))]
    jacobian = np.stack([np.asarray(slopes[name])[k or 0] for name, k in rows])
    roots = [jacobian @ a for a in (u.statistical, u.jackknife)]
    statistical, jackknife = (a @ a.T for a in roots)
    undetermined = (np.abs(jacobian) * u.undetermined).sum(1) > 0
    at = {p.name: [i for i, r in enumerate(rows) if r[0] == p.name] for p in specs}

    def deviation(matrix: Reals) -> Reals:
        # a parameter that nothing moves, held or at a bound, has no standard error: not 0, which would claim certainty
        variance = np.diag(matrix)
        return np.asarray(np.sqrt(np.where((variance > 0) & ~undetermined, variance, np.nan)))

    def named(sizes: Reals) -> Named:
        return {name: sizes[i].reshape(parameters[name].shape) for name, i in at.items()}

    def between(a: str, b: str) -> Reals:
        block: Reals = statistical[np.ix_(at[a], at[b])].reshape(parameters[a].shape + parameters[b].shape)
        return block

    scale = deviation(statistical)
    labels = tuple(_label(r) for r in rows)
    ends = np.asarray(box.free) & ((x <= box.lower) | (x >= box.upper))
    bounded = [(c.parameter, k) for (c, k), end in zip(chart.vector(channels), ends, strict=True) if end]
    return Estimate(
        parameters,
        named(scale),
        named(deviation(jackknife)),
        {a: {b: between(a, b) for b in at} for a in at},
        tuple(f"{_label(b)} = {float(parameters[b[0]][() if b[1] is None else b[1]]):.6g}" for b in bounded),
        labels,
        statistical / scale[:, None] / scale,
        tuple(label for label, u in zip(labels, undetermined, strict=True) if u),
    )


def make_ready(problem: Problem, losses: tuple[Loss, ...]) -> None:
    """Compile what :func:`judge` will run, by a pass over no blocks."""
    _statistics(problem, np.zeros(problem.size), losses, Span(np.asarray(0), np.asarray(0)))


def _label(row: tuple[str, int | None]) -> str:
    return row[0] if row[1] is None else f"{row[0]}[{row[1]}]"


__all__ = ["Estimate", "Judgement", "errors_of", "judge", "make_ready"]
