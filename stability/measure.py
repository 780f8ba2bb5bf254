"""How far programs are from their references, and whether anything they give is not finite."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from . import oracle
from .parts import DIRECTIONS, Part

Reals = NDArray[np.float64]
BATCH = 512
"""Points that one program takes; every number of points is padded to it, since to compile costs more than to evaluate."""

SMALLEST_SINGLE = (1e-22, 1e-16)
"""As ``Part.smallest``, in float32, where exp(-87) = 1e-38 is the smallest number, and heights of lobes and their slopes
are factors on it."""
HELD = 3e-6
"""float32 can hold a value or slope that one rounding of its arguments moves by less: a formula of a dozen operations
rounds a dozen times, which adds to three times that, as random signs do, and 1e-5 is promised."""
LARGEST_SLOPE = 1e36
"""Slopes beyond are held finite in float32 (see ``special.hold_slopes``) and have no digits to count."""


QUICKLY = {"xla_backend_optimization_level": 0, "xla_cpu_use_fusion_emitters": False}
"""Programs compile in a seventh of the time so (values and slopes of ``gtr``: 0.4 s of processor, not 2.7), and most of the
time is that."""


@cache
def _compiled(part: Part) -> Callable[[Any], Any]:
    """Values and slopes: backwards for models, as a fit takes them, and forwards for parts."""
    if part.group == "models":
        return jax.jit(jax.vmap(jax.value_and_grad(part.program)), compiler_options=QUICKLY)
    return jax.jit(jax.vmap(lambda x: (part.program(x), jax.jacfwd(part.program)(x))), compiler_options=QUICKLY)


def evaluate(part: Part, points: Reals, dtype: Any = np.float64) -> tuple[Reals, Reals]:
    """Values ``[n]`` and slopes ``[n, arguments]`` in the given precision, as float64, at ``points [n, arguments]``."""
    count, size = len(points), BATCH
    values, slopes = np.empty(count), np.empty(points.shape)
    with jax.enable_x64(dtype is np.float64):
        f = _compiled(part)
        for k in range(0, count, size):
            batch = points[k : k + size]
            padded = np.concatenate([batch, np.repeat(batch[-1:], size - len(batch), 0)]).astype(dtype)
            v, s = f(jnp.asarray(padded))
            values[k : k + size], slopes[k : k + size] = np.asarray(v)[: len(batch)], np.asarray(s)[: len(batch)]
    return values, slopes


def tangential(part: Part, points: Reals, slopes: Reals) -> Reals:
    """Slopes ``[n, arguments]`` with those by directions projected onto the tangent planes, where the reference
    is another function than the program off the sphere.
    """
    if part.extra != DIRECTIONS or part.name in oracle.MODELS:
        return slopes
    out = slopes.copy()
    for end in (slice(-6, -3), slice(-3, None)):
        w = points[:, end] / np.linalg.norm(points[:, end], axis=1, keepdims=True)
        out[:, end] -= w * (w * slopes[:, end]).sum(1, keepdims=True)
    return out


def errors(
    part: Part, points: Reals, got: tuple[Reals, Reals], want: tuple[Reals, Reals], dtype: Any
) -> tuple[Reals, Reals]:
    """Relative errors of the value ``[n]`` and of every slope ``[n, arguments]``; NaN where a slope does not exist.

    Slopes are relative to the larger of the slope and value/argument (value/1 for cosines, directions and
    arguments of zero).
    """
    smallest = SMALLEST_SINGLE if dtype is np.float32 else part.smallest
    value = np.abs(got[0] - want[0]) / (np.abs(want[0]) + smallest[0])
    got_slope, want_slope = got[1], want[1]
    if dtype is not np.float32:  # whose reference is the same formula
        got_slope, want_slope = (tangential(part, points, s) for s in (got_slope, want_slope))
    size = np.where(np.abs(points) < 1e-100, 1, np.abs(points))
    size[:, np.asarray(part.cosines, int)] = 1
    natural = np.abs(want[0])[:, None] / size
    slope = np.abs(got_slope - want_slope) / (np.maximum(np.abs(want_slope), natural) + smallest[1])
    if part.kink is not None:
        slope[np.ix_(part.kink(points), np.arange(len(part.ranges), len(part.arguments)))] = np.nan
    if dtype is np.float32:
        slope[(np.abs(want[1]) > LARGEST_SLOPE).any(1)] = np.nan
    return value, slope


ROUNDINGS = 8
"""Random roundings of the arguments that ``moved`` tries."""


@cache
def _lifted(part: Part) -> Callable[[Any], Any]:
    return jax.jit(jax.vmap(lambda y: (part.formula(y), jax.jacfwd(part.formula)(y))), compiler_options=QUICKLY)


@cache
def _lift(part: Part) -> Callable[[Any], Any]:
    return jax.jit(jax.vmap(lambda x: (part.lifted(x), jax.jacfwd(part.lifted)(x))), compiler_options=QUICKLY)


def moved(part: Part, points: Reals) -> tuple[Reals, Reals]:
    """How far one rounding of float32 moves the value ``[n]`` and the slopes ``[n, arguments]``, absolute.

    Parameters, n.l, n.v and the components of l + v and l - v (or sine and cosine, of an angle) are rounded up or down by
    half an ulp each, at random, and so is each term of the chain rule; the largest of ``ROUNDINGS`` changes counts. What
    is exact in float32, as l + v next to the mirror direction is, is taken as exact: rounding it is what a formula does.
    """
    rng = np.random.default_rng(0)
    half_ulp = 2.0**-24
    count, size = len(points), BATCH
    by_value, by_slope = np.zeros(count), np.zeros(points.shape)
    with jax.enable_x64(True):
        for k in range(0, count, size):
            batch = points[k : k + size]
            n = len(batch)
            lifted, chain = _lift(part)(jnp.asarray(np.concatenate([batch, np.repeat(batch[-1:], size - n, 0)])))
            lifted, chain = np.asarray(lifted), np.asarray(chain)[:n]
            value, gradient = (np.asarray(a)[:n] for a in _lifted(part)(jnp.asarray(lifted)))
            for _ in range(ROUNDINGS):
                other = lifted * (1 + half_ulp * rng.choice([-1, 1], lifted.shape))
                v, g = (np.asarray(a)[:n] for a in _lifted(part)(jnp.asarray(other)))
                g = g * (1 + half_ulp * rng.choice([-1, 1], g.shape)) - gradient
                by_value[k : k + n] = np.maximum(by_value[k : k + n], np.abs(v - value))
                by_slope[k : k + n] = np.maximum(by_slope[k : k + n], np.abs(np.einsum("nk,nkj->nj", g, chain)))
    return by_value, by_slope


def not_finite(part: Part, draws: int, dtype: Any, seed: int = 0) -> tuple[int, int]:
    """How many of ``draws`` random points give a value, and how many a slope, that is not finite."""
    values = slopes = 0
    size = 64 * BATCH
    for k, first in enumerate(range(0, draws, size)):
        v, s = evaluate(part, part.drawn(min(size, draws - first), seed + k), dtype)
        values += int((~np.isfinite(v)).sum())
        slopes += int((~np.isfinite(s).all(1)).sum())
    return values, slopes


__all__ = ["HELD", "LARGEST_SLOPE", "SMALLEST_SINGLE", "errors", "evaluate", "moved", "not_finite"]
