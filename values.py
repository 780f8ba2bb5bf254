"""Evaluating a fitted model on many directions, in float64 and with one compilation."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .models import BRDF

Reals = NDArray[np.float64]

BLOCK = 4096
"""Directions that a model sees at once."""


def values_of(model: BRDF | None, wi: Reals, wo: Reals, count: int) -> Reals:
    """Values ``[n, C]`` of a fitted model in float64; NaN without a model."""
    if model is None:
        return np.full((len(wi), count), np.nan)
    import jax

    n = -(-len(wi) // BLOCK)
    pad = np.zeros((n * BLOCK, 3))
    pad[:, 2] = 1.0
    blocks = []
    for w in (wi, wo):
        full = pad.copy()
        full[: len(w)] = w
        blocks.append(full.reshape(n, BLOCK, 3))
    with jax.enable_x64(True):
        out = np.concatenate([_program()(model, *pair) for pair in zip(*blocks, strict=True)])
    return np.broadcast_to(out[: len(wi)], (len(wi), count))


@cache
def _program() -> Any:
    """The one compiled function, made on first use so that rebuilding a report does not import JAX for it."""
    from .programs import program

    return program(lambda model, wi, wo: model(wi, wo))
