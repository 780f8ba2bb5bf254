"""Parameters and their uncertainties from a minimum in a chart's coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array
from numpy.typing import NDArray

from ..models import BRDF, parameters_of
from .coordinates import Chart
from .gram import Problem, statistics
from .result import Named
from .solver import Box, Minimum
from .uncertainty import uncertainty

Reals = NDArray[np.float64]

_statistics = eqx.filter_jit(statistics)


@eqx.filter_jit
def _parameters(chart: Chart, x: Array, channels: int) -> tuple[dict[str, Array], dict[str, Array]]:
    """Parameters ``[C]`` of a vector of coordinates, and their derivatives ``[C, n]``."""

    def values(y: Array) -> dict[str, Array]:
        own, shared = chart.split(y, channels)
        return jax.vmap(lambda o: chart.parameters(o, shared))(own)

    return values(x), jax.jacfwd(values)(x)


@dataclass(frozen=True)
class Part:
    """One solved problem: all channels, or a single one. Matrices run over ``rows``, the parameter and its channel."""

    channels: int
    values: Named
    rows: list[tuple[str, int | None]]
    statistical: Reals
    jackknife: Reals
    unknown: NDArray[np.bool_]
    """Rows of parameters that the data do not determine."""
    bounded: list[tuple[str, int | None]]
    shift: float
    """Standard errors by which one exact Gauss-Newton step over all cells would move the parameter it moves most."""


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


def estimate_of(problem: Problem, minimum: Minimum, box: Box) -> Part:
    """Parameters and covariances of one problem at its minimum (one more pass over the table)."""
    chart, channels, x = problem.chart, problem.channels, minimum.x
    bands, middle = _statistics(problem, x)
    at_lower, at_upper = np.asarray(x <= box.lower), np.asarray(x >= box.upper)
    free = np.asarray(box.free)
    n = problem.size
    u = uncertainty(np.asarray(bands).reshape(-1, n + 1, n + 1), np.asarray(middle), free & ~at_lower & ~at_upper)
    values, slopes = _parameters(chart, x, channels)
    specs = parameters_of(chart.cls)
    rows = [(p.name, k) for p in specs for k in (range(channels) if p.per_channel else (None,))]
    jacobian = np.stack([np.asarray(slopes[name])[k or 0] for name, k in rows])
    per_channel = {p.name: p.per_channel for p in specs}
    order = chart.vector(channels)
    return Part(
        channels,
        {name: np.asarray(v) if per_channel[name] else np.asarray(np.asarray(v)[0]) for name, v in values.items()},
        rows,
        jacobian @ u.statistical @ jacobian.T,
        jacobian @ u.jackknife @ jacobian.T,
        (np.abs(jacobian) * u.undetermined).sum(1) > 0,
        [(c.parameter, k) for i, (c, k) in enumerate(order) if free[i] and (at_lower[i] or at_upper[i])],
        u.shift,
    )


def combine(cls: type[BRDF], parts: list[Part]) -> Estimate:
    """One estimate from problems that were solved channel by channel (or from a single one)."""
    rows: list[tuple[str, int | None]] = []
    bounded: list[tuple[str, int | None]] = []
    for first, part in zip(np.cumsum([0, *(p.channels for p in parts)]), parts, strict=False):
        rows += [(name, None if k is None else int(first) + k) for name, k in part.rows]
        bounded += [(name, None if k is None else int(first) + k) for name, k in part.bounded]
    specs = parameters_of(cls)
    position = {p.name: i for i, p in enumerate(specs)}
    order = sorted(range(len(rows)), key=lambda i: (position[rows[i][0]], rows[i][1] or 0))
    rows = [rows[i] for i in order]
    statistical = _diagonal_blocks([p.statistical for p in parts])[np.ix_(order, order)]
    jackknife = _diagonal_blocks([p.jackknife for p in parts])[np.ix_(order, order)]
    unknown = np.concatenate([p.unknown for p in parts])[order]
    values = {
        p.name: np.concatenate([part.values[p.name] for part in parts]) if p.per_channel else parts[0].values[p.name]
        for p in specs
    }

    def deviation(matrix: Reals) -> Named:
        variance = np.where(unknown, np.nan, np.diag(matrix))
        # a parameter that nothing moves, held or at a bound, has no standard error: not 0, which would claim certainty
        size = np.sqrt(np.where(variance > 0, variance, np.nan))
        return {p.name: _of(size, rows, p.name, p.per_channel) for p in specs}

    at = {p.name: [i for i, r in enumerate(rows) if r[0] == p.name] for p in specs}
    covariance = {
        a.name: {
            b.name: statistical[np.ix_(at[a.name], at[b.name])].reshape(values[a.name].shape + values[b.name].shape)
            for b in specs
        }
        for a in specs
    }
    scale = np.sqrt(np.diag(statistical))
    scale = np.where((scale > 0) & ~unknown, scale, np.nan)
    labels = tuple(_label(r) for r in rows)
    return Estimate(
        values,
        deviation(statistical),
        deviation(jackknife),
        covariance,
        tuple(f"{_label(b)} = {float(values[b[0]] if b[1] is None else values[b[0]][b[1]]):.6g}" for b in bounded),
        labels,
        statistical / scale[:, None] / scale,
        tuple(label for label, u in zip(labels, unknown, strict=True) if u),
    )


def _of(sizes: Reals, rows: list[tuple[str, int | None]], name: str, per_channel: bool) -> Reals:
    own = sizes[[i for i, r in enumerate(rows) if r[0] == name]]
    return own if per_channel else np.asarray(own[0])


def _diagonal_blocks(matrices: list[Reals]) -> Reals:
    out = np.zeros((sum(len(m) for m in matrices),) * 2)
    first = 0
    for m in matrices:
        out[first : first + len(m), first : first + len(m)] = m
        first += len(m)
    return out


def _label(row: tuple[str, int | None]) -> str:
    return row[0] if row[1] is None else f"{row[0]}[{row[1]}]"


__all__ = ["Estimate", "Part", "combine", "estimate_of"]
