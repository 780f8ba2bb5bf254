"""Evaluating fitted models on many directions, in float64 and with one compilation for each model."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ..models import BRDF

Reals = NDArray[np.float64]

BLOCK = 4096
"""Directions that a model sees at once."""


def evaluate_each(
    models: Sequence[BRDF | None], wi: Reals, wo: Reals, count: int, meanwhile: Callable[[], object] = lambda: None
) -> Reals:
    """Values ``[M, n, C]`` of each model. They compile side by side, outside Python's lock, while ``meanwhile`` runs."""
    if any(m is not None for m in models):
        _program()  # one for all threads
    with ThreadPoolExecutor(min(os.cpu_count() or 1, len(models) or 1)) as pool:
        values = [pool.submit(evaluate, m, wi, wo, count) for m in models]
        meanwhile()
        return np.stack([v.result() for v in values]) if values else np.zeros((0, len(wi), count))


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
    import equinox as eqx
    import jax

    def run(model: BRDF, wi: Any, wo: Any) -> Any:
        return jax.lax.map(lambda pair: model(*pair), (wi, wo))

    return eqx.filter_jit(run)
