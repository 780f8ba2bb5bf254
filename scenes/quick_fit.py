"""A fit to what a picture shows, fast enough for a search over models: a few thousand pairs of directions, no error bars.

The residual of a pair is the difference of the PQ signal of its pixel, PQ(L f/m) - PQ(L), for each channel: what the pixel
would look like if all of its light came that way. Where one light makes a pixel, that is the difference that is seen.

Under ambient light a spike narrower than the steps between the pairs is seen by none of them and still brightens every
pixel. There the pixels themselves are fitted, too, by the albedo of the model at a few polar angles.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..fitting.coordinates import Chart, charts
from ..fitting.result import Named
from ..fitting.starts import Summary, starts
from ..geometry import Geometry, from_directions
from ..models import BRDF, parameter_values, parameters_of
from ..polar import PolarStencil
from ..programs import program
from ..reports.physics import COARSE, hemisphere
from ..tradeoff.sample import Sample, draw
from .appearance import Look
from .interpolated import measured
from .rendering import cast
from .scene import Reals
from .seen import pq

PAIRS = 2048
ELSEWHERE, SHARE = 512, 0.02
"""Cells of the whole table, and their share of the weight."""
OUTERMOST = 80.0
"""Largest polar angle of such cells, degrees."""
PIXELS = 6
"""Pixels whose integrals are fitted under ambient light."""
STARTS = 4
NEARBY = 2
"""Starts that are polished where a model with one effect less or more says where to look."""
STEPS = 40
RTOL = 1e-6
"""Relative decrease of the cost in a step below which a search ends: the pictures then differ by far less than is seen."""
LIMIT = np.pi / 2


class Ambient(eqx.Module):
    """Pixels under even light, whose integrals take ``nodes`` directions each."""

    weight: Float[Array, "K nodes"]
    """The albedo is the sum over nodes of weight times BRDF."""
    scale: Float[Array, " C"]
    """Shown value for each unit of albedo."""
    rest: Float[Array, "K C"]
    """Shown value that other light makes."""
    signal: Float[Array, "K C"]
    root_weight: Float[Array, " K"]


class Shown(eqx.Module):
    """Pairs of directions, and what their pixels look like."""

    geometry: Geometry
    """Of the n pairs, then of the K x nodes of :class:`Ambient`."""
    scale: Float[Array, "n C"]
    """Shown value of the pixel for each unit of BRDF."""
    signal: Float[Array, "n C"]
    """PQ signal of the measured pixel."""
    root_weight: Float[Array, " n"]
    ambient: Ambient | None

    def residual(self, f: Float[Array, "all C"]) -> Float[Array, "rows C"]:
        """Weighted difference of the PQ signal of BRDF values at :attr:`geometry`, of the pairs and then of the pixels."""
        n = len(self.scale)
        r = self.root_weight[:, None] * (pq(jnp.maximum(f[:n] * self.scale, 0)) - self.signal)
        if self.ambient is None:
            return jnp.asarray(r)
        a = self.ambient
        albedo = (a.weight[..., None] * f[n:].reshape(*a.weight.shape, -1)).sum(1)
        values = pq(jnp.maximum(a.rest + albedo * a.scale, 0))
        rows: Array = jnp.concatenate([r, a.root_weight[:, None] * (values - a.signal)])
        return rows


@dataclass(frozen=True, eq=False)
class Quick:
    """An optimum."""

    model: BRDF
    error: float
    """RMS difference of the PQ signal over weighted pairs and channels, times 720: comparable to ΔE ITP."""


def shown(here: Look) -> Shown:
    """What a scene shows ready to be fitted, in float64: :data:`PAIRS` pairs, whatever the scene.

    Together with :data:`ELSEWHERE` cells of the whole table, which keep a model from doing anything at all where pairs of
    the scene do not happen to lie: as if lit so that a white Lambertian surface that faces the light shows 0.8. And with
    :data:`PIXELS` pixels where there is ambient light.
    """
    few = here.seen.draw(PAIRS)
    rest = draw(here.table, OUTERMOST, "cells")  # every theta_h alike: narrow spikes are seen, too
    rest = Sample(rest.wi[:ELSEWHERE], rest.wo[:ELSEWHERE], rest.measured[:ELSEWHERE], OUTERMOST)
    wi, wo = np.concatenate([few.wi, rest.wi]), np.concatenate([few.wo, rest.wo])
    elsewhere = 0.8 * np.pi * rest.measured * rest.wi[:, 2:]
    scale = np.concatenate(
        [few.pixel / np.maximum(few.measured, 1e-9), np.broadcast_to(0.8 * np.pi * rest.wi[:, 2:], elsewhere.shape)]
    )
    weight = np.concatenate([np.full(PAIRS, (1 - SHARE) / PAIRS), np.full(ELSEWHERE, SHARE / ELSEWHERE)])
    ambient = None
    with jax.enable_x64(True):
        if here.light.everywhere is not None:
            ambient, at, to = _ambient(here, np.asarray(here.light.everywhere.radiance))
            weight *= 0.5
            wi, wo = np.concatenate([wi, at]), np.concatenate([wo, to])
        g: Any = from_directions(jnp.asarray(wi), jnp.asarray(wo))
        stencils = tuple(jax.tree.map(jnp.asarray, PolarStencil.of(w[:, 2], LIMIT)) for w in (wi, wo))
        g = replace(g, stencil_i=stencils[0], stencil_o=stencils[1])
        signal = pq(jnp.concatenate([jnp.asarray(few.pixel), jnp.asarray(elsewhere)]))
        return Shown(g, jnp.asarray(scale), signal, jnp.sqrt(jnp.asarray(weight)), ambient)


def _ambient(here: Look, radiance: Reals) -> tuple[Ambient, Reals, Reals]:
    """Pixels that stand for equal numbers of them in the order of cos_o, with half of the weight, and their directions."""
    order = np.argsort(here.view.wo[:, 2], kind="stable")
    chosen = order[((np.arange(PIXELS) + 0.5) / PIXELS * len(order)).astype(int)]
    rules = [hemisphere(float(np.arccos(c)), COARSE) for c in here.view.wo[chosen, 2]]
    wi, weight = np.stack([r[1] for r in rules]), np.stack([r[2] for r in rules])
    wo = np.broadcast_to(np.stack([r[0] for r in rules])[:, None], wi.shape)
    # Guard: directions of no weight may lie below the horizon, where models are not defined; the normal stands for them.
    wi = np.where(weight[..., None] > 0, wi, [0.0, 0.0, 1.0])
    pixel = here.reference.values[chosen] * here.exposure
    table = np.asarray(jax.jit(lambda m, i, o: m(i, o))(*cast((measured(here.table)[0], wi, wo), "float64")))
    scale = radiance * here.exposure
    rest = np.maximum(pixel - (weight[..., None] * table).sum(1) * scale, 0)
    parts = (weight, scale, rest, pq(pixel), np.full(PIXELS, np.sqrt(0.5 / PIXELS)))
    return Ambient(*(jnp.asarray(p) for p in parts)), wi.reshape(-1, 3), wo.reshape(-1, 3)


def quick_fit(cls: type[BRDF], data: Shown, summary: Summary, near: BRDF | None = None) -> Quick:
    """Fit a model class. Starts are those of :func:`brdfit.fit`, and ``near``, a model with some of its parameters."""
    from scipy.optimize import least_squares

    chart = charts(cls)[0]
    channels = data.scale.shape[1]
    proposals = list(starts(cls, summary, 0))
    if near is not None:
        known = parameter_values(near)
        proposals = [_moved(p, known) for p in proposals[:NEARBY]] + proposals
    with jax.enable_x64(True):
        at = _Linearised(data, chart)
        begin = [chart.coordinates_of(p, channels) for p in proposals]
        costs = [float((at.residual(x) ** 2).sum()) for x in begin]
        order = [i for i in np.argsort(costs, kind="stable") if np.isfinite(costs[i])]
        box = chart.box(channels)
        ends = [
            least_squares(
                at.residual, begin[i], at.jacobian, box, x_scale="jac", ftol=RTOL, xtol=RTOL, gtol=None, max_nfev=STEPS
            )
            for i in order[: STARTS if near is None else NEARBY]
        ]
        best = min(ends, key=lambda end: end.cost)
        own, shared = chart.split(jnp.asarray(best.x), channels)
        values = [chart.parameters(list(o), list(shared)) for o in own]
        parameters = {
            p.name: np.array([float(v[p.name]) for v in values]) if p.per_channel else np.asarray(float(values[0][p.name]))
            for p in parameters_of(cls)
        }
    return Quick(cls(**parameters), 720 * float(np.sqrt(2 * best.cost / channels)))


def _moved(start: Named, known: Named) -> Named:
    """A start with the parameters that are known, in the shapes that it has them."""
    out = {}
    for name, value in start.items():
        given = known.get(name, value)
        out[name] = np.broadcast_to(given if np.ndim(given) <= np.ndim(value) else given.mean(), np.shape(value))
    return out


class _Linearised:
    """Residual and Jacobian by one program, evaluated once for each point.

    Both by the triangular factor of [J r], a dozen rows in place of thousands: r.r, J^T J and J^T r are the same (as in
    :mod:`brdfit.fitting.gram`), and nothing else of them is used.
    """

    def __init__(self, data: Shown, chart: Chart) -> None:
        self.data, self.chart, self.last = data, chart, np.zeros(0)

    def _at(self, x: Reals) -> Reals:
        if not np.array_equal(x, self.last):
            self.last, self.factor = x.copy(), np.asarray(_linearise(self.data, jnp.asarray(x), self.chart))
        return self.factor

    def residual(self, x: Reals) -> Reals:
        return self._at(x)[:, -1]

    def jacobian(self, x: Reals) -> Reals:
        return self._at(x)[:, :-1]


@program
def _linearise(data: Shown, x: Array, chart: Chart) -> Array:
    def residual(x: Array) -> tuple[Array, Array]:
        own, shared = chart.split(x, data.scale.shape[1])
        f = jax.vmap(
            lambda o: jnp.broadcast_to(chart.model(o, shared).evaluate(data.geometry), data.geometry.shape), out_axes=-1
        )(own)
        r = data.residual(f).ravel()
        return r, r

    jacobian, r = jax.jacfwd(residual, has_aux=True)(x)
    both = jnp.concatenate([jacobian, r[:, None]], 1)
    # a model beyond what numbers hold is as bad as can be, and has no slope
    worst = jnp.where(jnp.arange(both.shape[1]) < len(x), 0.0, 1e3)
    return jnp.linalg.qr(jnp.where(jnp.isfinite(both), both, worst), mode="r")


__all__ = ["Ambient", "Quick", "Shown", "quick_fit", "shown"]
