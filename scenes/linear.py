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
from .pairs import Shown
from .scene import Reals


class Linear:
    """Residual and slopes of a model class at any coordinates of its plain chart, by one program.

    Both by factors of their products, some dozens of rows in place of thousands: r.r, J^T J and J^T r are the same (as in
    :mod:`brdfit.fitting.gram`), and nothing else of them is used.
    """

    def __init__(self, cls: type[BRDF], data: Shown, held: tuple[str, ...] = ()) -> None:
        self.data, self.channels = data, data.scale.shape[1]
        chart = charts(cls, plain=True)[0]
        first = tuple(c for c in chart.coordinates if c.parameter not in held)
        self.chart = replace(chart, coordinates=(*first, *(c for c in chart.coordinates if c.parameter in held)))
        self.own, self.shared = ([c.name for c in part] for part in (self.chart.channel, self.chart.shared))
        self.moving = len(self.shared) - len(held)

    def __call__(self, x: Reals) -> Reals:
        """Factor of the products of [J r], ``[rows, n + 1]``, at coordinates; of those held there are no slopes."""
        k, c = len(self.own), self.channels
        n = k + self.moving
        own, shared, held = np.split(x, [c * k, c * k + self.moving])
        with jax.enable_x64(True):
            products = np.asarray(_linearise(self.data, own.reshape(c, k), shared, held, self.chart))
        out = np.zeros((c, n + 1, c * k + self.moving + 1))
        for i, factor in enumerate(_factors(products)):
            out[i, :, i * k : (i + 1) * k] = factor[:, :k]
            out[i, :, c * k :] = factor[:, k:]
        return out.reshape(-1, out.shape[2])


def _factors(products: Reals) -> Reals:
    """A with A^T A the given products, of columns scaled to one length."""
    size = np.sqrt(np.maximum(np.diagonal(products, axis1=1, axis2=2), 1e-300))
    values, vectors = np.linalg.eigh(products / (size[:, :, None] * size[:, None]))
    factors: Reals = np.sqrt(np.maximum(values, 0))[:, :, None] * vectors.swapaxes(1, 2) * size[:, None]
    return factors


@program
def _linearise(data: Shown, own: Any, shared: Any, held: Any, chart: Chart) -> Array:
    k = own.shape[1]

    def channel(own: Array) -> tuple[Array, Array]:
        def values(x: Array) -> tuple[Array, Array]:
            m = chart.model(x[:k], jnp.concatenate([x[k:], held]))
            f = jnp.broadcast_to(m.evaluate(data.geometry), data.geometry.shape)
            return f, f

        slopes, f = jax.jacfwd(values, has_aux=True)(jnp.concatenate([own, shared]))
        return slopes, f

    slopes, f = jax.vmap(channel, out_axes=(1, 1))(own)  # [n C coordinates], [n C]
    r, push = jax.linearize(data.residual, f)
    jacobian = jax.vmap(push, -1, -1)(slopes)
    both = jnp.concatenate([jacobian, r[..., None]], -1).swapaxes(0, 1)
    # a model beyond what numbers hold is as bad as can be, and has no slope
    worst = jnp.where(jnp.arange(both.shape[2]) < slopes.shape[2], 0.0, 1e3)
    both = jnp.where(jnp.isfinite(both), both, worst)
    return both.swapaxes(1, 2) @ both


__all__ = ["Linear"]
