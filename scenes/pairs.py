"""What a picture shows, ready to be fitted: a few thousand pairs of directions, few enough for a search over models.

The residual of a pair is the difference of the PQ signal of its pixel, PQ(L f/m) - PQ(L), for each channel: what the pixel
would look like if all of its light came that way. Where one light makes a pixel, that is the difference that is seen.

Under ambient light a spike narrower than the steps between the pairs is seen by none of them and still brightens every
pixel. There the pixels themselves are fitted, too, by the albedo of the model at a few polar angles.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..angles import directions
from ..errors import InputError
from ..geometry import Geometry, from_directions
from ..polar import PolarStencil
from ..programs import program
from ..reports.physics import hemisphere
from ..tables import HalfDifferenceGrid, Table
from .appearance import Look
from .interpolated import evaluated, measured
from .rendering import cast
from .scene import Reals
from .seen import pq

PAIRS = 1024
ELSEWHERE, SHARE = 256, 0.002
"""Cells of the whole table, and their share of the weight."""
OUTERMOST = 80.0
"""Largest polar angle of such cells, degrees."""
PIXELS, RULE = 6, (24, 8)
"""Pixels whose integrals are fitted under ambient light, and nodes in theta_h and phi_h of each."""
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


def shown(here: Look) -> Shown:
    """What a scene shows ready to be fitted, in float64: :data:`PAIRS` pairs, whatever the scene.

    Together with :data:`ELSEWHERE` cells of the whole table, which keep a model from doing anything at all where pairs of
    the scene do not happen to lie: as if lit so that a white Lambertian surface that faces the light shows 0.8. And with
    :data:`PIXELS` pixels where there is ambient light.
    """
    few = here.seen.draw(PAIRS)
    there, back, values = _cells(here.table)
    wi, wo = np.concatenate([few.wi, there]), np.concatenate([few.wo, back])
    elsewhere = 0.8 * np.pi * values * there[:, 2:]
    scale = np.concatenate(
        [few.pixel / np.maximum(few.measured, 1e-9), np.broadcast_to(0.8 * np.pi * there[:, 2:], elsewhere.shape)]
    )
    weight = np.concatenate([np.full(PAIRS, (1 - SHARE) / PAIRS), np.full(ELSEWHERE, SHARE / ELSEWHERE)])
    ambient = None
    if here.light.everywhere is not None:
        ambient, at, to = _ambient(here, np.asarray(here.light.everywhere.radiance))
        weight *= 0.5
        wi, wo = np.concatenate([wi, at]), np.concatenate([wo, to])
    with jax.enable_x64(True):
        g: Any = _geometry(wi, wo)
    g = replace(g, stencil_i=PolarStencil.of(wi[:, 2], LIMIT), stencil_o=PolarStencil.of(wo[:, 2], LIMIT))
    signal = pq(np.concatenate([few.pixel, elsewhere]))
    parts: Any = (g, scale, signal, np.sqrt(weight), ambient)
    return Shown(*parts)


@program
def _geometry(wi: Any, wo: Any) -> Geometry:
    return from_directions(wi, wo)


def _cells(table: Table) -> tuple[Reals, Reals, Reals]:
    """Some cells of the whole table, every theta_h alike so that narrow spikes are seen, and their values ``[n, C]``."""
    grid = table.layout
    assert isinstance(grid, HalfDifferenceGrid)
    used = np.flatnonzero(table.within(np.radians(OUTERMOST)))
    if not len(used):
        raise InputError(
            f"{table.source or table.material}: no measured cell has both polar angles within {OUTERMOST:g} degrees"
        )
    h, d, p = np.unravel_index(np.random.default_rng(0).choice(used, ELSEWHERE), grid.shape)
    wi, wo = directions(grid.theta_h[h], grid.theta_d[d], grid.phi_d[p])
    return wi, wo, table.planes[:, h, d, p].T


def _ambient(here: Look, radiance: Reals) -> tuple[Ambient, Reals, Reals]:
    """Pixels that stand for equal numbers of them in the order of cos_o, with half of the weight, and their directions."""
    order = np.argsort(here.view.wo[:, 2], kind="stable")
    chosen = order[((np.arange(PIXELS) + 0.5) / PIXELS * len(order)).astype(int)]
    rules = [hemisphere(float(np.arccos(c)), RULE) for c in here.view.wo[chosen, 2]]
    wi, weight = np.stack([r[1] for r in rules]), np.stack([r[2] for r in rules])
    wo = np.broadcast_to(np.stack([r[0] for r in rules])[:, None], wi.shape)
    # Guard: directions of no weight may lie below the horizon, where models are not defined; the normal stands for them.
    wi = np.where(weight[..., None] > 0, wi, [0.0, 0.0, 1.0])
    pixel = here.reference.values[chosen] * here.exposure
    with jax.enable_x64(True):
        table = np.asarray(evaluated(*cast((measured(here.table)[0], wi, wo), "float64")))
    scale = radiance * here.exposure
    rest = np.maximum(pixel - (weight[..., None] * table).sum(1) * scale, 0)
    parts: Any = (weight, scale, rest, pq(pixel), np.full(PIXELS, np.sqrt(0.5 / PIXELS)))
    return Ambient(*parts), wi.reshape(-1, 3), wo.reshape(-1, 3)


__all__ = ["Ambient", "Shown", "shown"]
