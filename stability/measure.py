"""How far programs are from their references, and whether anything they give is not finite."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from .parts import Part

Reals = NDArray[np.float64]
BATCH = 2048

SMALLEST_SINGLE = (1e-12, 1e-9)
"""As ``Part.smallest``, in float32, where exp(-30) holds 30 roundings of 6e-8, each counted several times."""
LARGEST_SLOPE = 1e36
"""Slopes beyond are held finite in float32 (see ``special.hold_slopes``) and have no digits to count."""


@cache
def _compiled(part: Part) -> Callable[[Any], Any]:
    """Values and slopes: backwards for models, as a fit takes them, and forwards for parts."""
    if part.group == "models":
        return jax.jit(jax.vmap(jax.value_and_grad(part.program)))
    return jax.jit(jax.vmap(lambda x: (part.program(x), jax.jacfwd(part.program)(x))))


def evaluate(part: Part, points: Reals, dtype: Any = np.float64) -> tuple[Reals, Reals]:
    """Values ``[n]`` and slopes ``[n, arguments]`` in the given precision, as float64, at ``points [n, arguments]``."""
    count = len(points)
    size = min(BATCH, 1 << max(count - 1, 1).bit_length())
    values, slopes = np.empty(count), np.empty(points.shape)
    with jax.enable_x64(dtype is np.float64):
        f = _compiled(part)
        for k in range(0, count, size):
            batch = points[k : k + size]
            padded = np.concatenate([batch, np.repeat(batch[-1:], size - len(batch), 0)]).astype(dtype)
            v, s = f(jnp.asarray(padded))
            values[k : k + size], slopes[k : k + size] = np.asarray(v)[: len(batch)], np.asarray(s)[: len(batch)]
    return values, slopes


def errors(
    part: Part, points: Reals, got: tuple[Reals, Reals], want: tuple[Reals, Reals], dtype: Any
) -> tuple[Reals, Reals]:
    """Relative errors of the value ``[n]`` and of every slope ``[n, arguments]``; NaN where a slope does not exist.

    Slopes are relative to the larger of the slope and value/argument (value/1 for cosines, directions and
    arguments of zero).
    """
    smallest = SMALLEST_SINGLE if dtype is np.float32 else part.smallest
    value = np.abs(got[0] - want[0]) / (np.abs(want[0]) + smallest[0])
    size = np.where(np.abs(points) < 1e-100, 1, np.abs(points))
    size[:, np.asarray(part.cosines, int)] = 1
    natural = np.abs(want[0])[:, None] / size
    slope = np.abs(got[1] - want[1]) / (np.maximum(np.abs(want[1]), natural) + smallest[1])
    if part.kinked:
        level = np.abs(points[:, part.arguments.index("wi_z")] - points[:, part.arguments.index("wo_z")]) < 1e-6
        slope[np.ix_(level, np.asarray(part.cosines, int))] = np.nan
    if dtype is np.float32:
        slope[(np.abs(want[1]) > LARGEST_SLOPE).any(1)] = np.nan
    return value, slope


def not_finite(part: Part, draws: int, dtype: Any, seed: int = 0) -> tuple[int, int]:
    """How many of ``draws`` random points give a value, and how many a slope, that is not finite."""
    values = slopes = 0
    size = 16 * BATCH
    for k, first in enumerate(range(0, draws, size)):
        v, s = evaluate(part, part.drawn(min(size, draws - first), seed + k), dtype)
        values += int((~np.isfinite(v)).sum())
        slopes += int((~np.isfinite(s).all(1)).sum())
    return values, slopes


__all__ = ["LARGEST_SLOPE", "errors", "evaluate", "not_finite"]
