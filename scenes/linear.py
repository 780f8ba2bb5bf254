"""Residual and slopes of a model over what a scene shows, reduced to a few rows by one program."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..fitting.coordinates import Chart, charts
from ..models import BRDF
from ..programs import program
from .fitted_pixels import Shown
from .scene import Reals

BEYOND = 1e3
"""Residual, ΔE ITP times the root of a weight, of a model beyond what numbers hold: as bad as can be."""

ROUNDING = 1e-12
"""Squared length of a column of length 1 that is left of it beside others when it counts as made of them."""


class Linear:
    """Residual and slopes of a model class at any coordinates of its plain chart, by one program.

    Both by their products r.r, J^T J and J^T r (as in :mod:`brdfit.fitting.gram`): nothing else of them is used, and a
    factor of those has some dozens of rows in place of thousands.
    """

    def __init__(self, cls: type[BRDF], data: Shown, held: tuple[str, ...] = ()) -> None:
        self.data, self.channels = data, data.arriving.shape[1]
        chart = charts(cls, plain=True)[0]
        first = tuple(c for c in chart.coordinates if c.parameter not in held)
        self.chart = replace(chart, coordinates=(*first, *(c for c in chart.coordinates if c.parameter in held)))
        self.own, self.shared = ([c.name for c in part] for part in (self.chart.channel, self.chart.shared))
        self.moving = len(self.shared) - len(held)
        self.merge = self._merge()

    def _merge(self) -> Reals:
        """From slopes by coordinates of each channel, and the residual, to those by the vector: what is shared is summed."""
        k, c, n = len(self.own), self.channels, len(self.own) + self.moving
        merge = np.zeros((c * n + 1, c * k + self.moving + 1))
        for i in range(c):
            merge[i * n + np.arange(n), np.r_[i * k + np.arange(k), c * k + np.arange(self.moving)]] = 1
        merge[-1, -1] = 1
        return merge

    def __call__(self, x: Reals) -> Reals:
        """Products of [J r] with itself, ``[n + 1, n + 1]``, at coordinates; of those held there are no slopes."""
        k, c = len(self.own), self.channels
        own, shared, held = np.split(x, [c * k, c * k + self.moving])
        with jax.enable_x64(True):
            parts = _linearise(self.data, own.reshape(c, k), shared, held, self.chart)
        products, slopes, cost = (np.asarray(a) for a in parts)
        n = c * (k + self.moving)
        whole = np.block([[products.reshape(n, n), slopes.reshape(n, 1)], [slopes.reshape(1, n), cost]])
        return np.asarray(self.merge.T @ whole @ self.merge)


def factor(products: Reals) -> Reals:
    """A with A^T A the given products, of columns scaled to one length.

    By Cholesky, which takes microseconds: LAPACK's eigenvalues of thirty columns wait for threads a thousand times as long.
    With pivots, for columns may be alike or, to rounding, without any slope (tests/test_scenes_screen.py::test_factors).
    """
    from scipy.linalg.lapack import dpstrf

    size = np.sqrt(np.maximum(np.diagonal(products), 1e-300))
    lengths, order, rank, _ = dpstrf(products / (size[:, None] * size), tol=ROUNDING)
    upper = np.zeros_like(products)
    upper[:, order - 1] = np.triu(lengths)
    upper[rank:] = 0
    return np.asarray(upper * size)


@program
def _linearise(data: Shown, own: Any, shared: Any, held: Any, chart: Chart) -> tuple[Array, Array, Array]:
    """J^T J ``[C n C n]``, J^T r ``[C n]`` and r.r, by n coordinates of each channel: its own, and the shared as its own."""
    k = own.shape[1]

    def channel(own: Array) -> tuple[Array, Array]:
        def values(x: Array) -> tuple[Array, Array]:
            m = chart.model(x[:k], jnp.concatenate([x[k:], held]))
            f = jnp.broadcast_to(m.evaluate(data.geometry), data.geometry.shape)
            return f, f

        slopes, f = jax.jacfwd(values, has_aux=True)(jnp.concatenate([own, shared]))
        return slopes, f

    slopes, f = jax.vmap(channel, out_axes=(1, 1))(own)  # [directions C n], [directions C]
    values = data.values(f)
    moved = _finite(jax.vmap(data.values, -1, -1)(slopes))  # [rows C n]
    r, push = jax.linearize(data.residual, values)
    # a residual depends on the channels of its own pixel: slopes by each of them [rows C 3], and their products [rows C C]
    seen = _finite(jax.vmap(lambda one: push(jnp.broadcast_to(one, values.shape)), 0, 1)(jnp.eye(values.shape[1])))
    both = (seen[:, :, None] * seen[:, None]).sum(-1)
    r = jnp.where(jnp.isfinite(r), r, BEYOND)
    products = jnp.einsum("pck,pcdl->ckdl", moved, both[..., None] * moved[:, None])
    return products, ((seen * r[:, None]).sum(-1)[..., None] * moved).sum(0), (r * r).sum()


def _finite(slopes: Array) -> Array:
    """Where a model is beyond what numbers hold it has no slope."""
    return jnp.where(jnp.isfinite(slopes), slopes, 0.0)


__all__ = ["Linear", "factor"]
