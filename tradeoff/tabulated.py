"""Masking from a table: Smith's integral made once for 1025 polar angles, and read off at each pair of directions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..geometry import Geometry, from_directions
from ..models import BRDF, parameters_of
from ..models.base import channel_axes, channels
from ..polar import INTERVALS, PolarStencil, PolarTables
from ..programs import program


class Tabulated(NamedTuple):
    """A model and its polar functions on the uniform table over [0, max_angle]."""

    model: BRDF
    tables: list[Array]
    """``[C, angles]``, or ``[angles]`` where all channels have the same lobe."""


def tabulate(model: BRDF, max_angle: float) -> Tabulated:
    """Make the tables of polar functions that a model asks for, in float64; ``max_angle`` in degrees."""
    with jax.enable_x64(True):
        made = _tables(jax.tree.map(np.asarray, model), float(np.radians(max_angle)))
        return Tabulated(model, made if _own_lobes(model) else [t[0] for t in made])


@program
def _tables(model: BRDF, limit: float) -> list[Array]:
    at = PolarStencil.of(np.ones(1), limit)
    one = jnp.ones(1)
    g = Geometry(one, one, one, 0 * one, one, 0 * one, 0 * one, 0 * one, at, at)

    def make(m: BRDF) -> list[Array]:
        tables = PolarTables()
        m.evaluate(replace(g, tables=tables))
        return tables.made

    made: list[Array] = jax.vmap(make, in_axes=(channel_axes(model),), axis_size=channels(model))(model)
    return made


def from_table(max_angle: float) -> Callable[[Tabulated, Array, Array], Array]:
    """A function of (:class:`Tabulated`, wi, wo) that gives BRDF values ``[n, C]`` within ``max_angle`` degrees."""
    limit = float(np.radians(max_angle))

    def stencil(cosine: Array) -> PolarStencil:
        position = jnp.arccos(cosine) * (INTERVALS / limit)
        index = jnp.clip(position.astype(jnp.int32), 1, INTERVALS - 2)
        return PolarStencil(index, position - index, limit)

    def values(what: Tabulated, wi: Array, wo: Array) -> Array:
        bare = from_directions(wi, wo)
        g = replace(bare, stencil_i=stencil(bare.cos_i), stencil_o=stencil(bare.cos_o))
        own = _own_lobes(what.model)

        def one(m: BRDF, tables: list[Array]) -> Array:
            return jnp.broadcast_to(m.evaluate(replace(g, tables=PolarTables(tables))), g.shape)

        axes = (channel_axes(what.model), 0 if own else None)
        out: Array = jax.vmap(one, axes, -1, axis_size=channels(what.model))(what.model, what.tables)
        return out

    return values


def _own_lobes(model: BRDF) -> bool:
    return any(p.per_channel and not p.linear for p in parameters_of(model))


__all__ = ["Tabulated", "from_table", "tabulate"]
