"""Evaluating a fitted model on many directions, in float64 and with one compilation."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ..models import BRDF

Reals = NDArray[np.float64]

BLOCK = 4096
"""Directions that a model sees at once."""


def evaluate(model: BRDF | None, wi: Reals, wo: Reals, count: int) -> Reals:
    """Values ``[n, C]`` of a fitted model in float64; NaN without a model."""
    if model is None:
        return np.full((len(wi), count), np.nan)
    import jax

    n = -(-len(wi) // BLOCK) * BLOCK
    pad = np.zeros((n, 3))
    pad[:, 2] = 1.0
    blocks = []
    for w in (wi, wo):
        full = pad.copy()
        full[: len(w)] = w
        blocks.append(full.reshape(-1, BLOCK, 3))
    with jax.enable_x64(True):
        out = np.asarray(_program()(model, *blocks))
    return np.broadcast_to(out.reshape(n, -1)[: len(wi)], (len(wi), count))


@cache
def _program() -> Any:
    """The one compiled function, made on first use so that rebuilding a report does not import JAX for it."""
    import jax

    from ..programs import program

    def run(model: BRDF, wi: Any, wo: Any) -> Any:
        return jax.lax.map(lambda pair: model(*pair), (wi, wo))

    return program(run)
