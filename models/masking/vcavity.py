"""Masking-shadowing of V-shaped grooves (Torrance & Sparrow 1967; Cook & Torrance 1982, eq. 4)."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...geometry import Geometry


def vcavity(g: Geometry) -> Float[Array, "..."]:
    """G / (4 n.l n.v),  G = min(1, 2 (n.h)(n.l)/(l.h), 2 (n.h)(n.v)/(l.h)).

    The smaller cosine of G is not divided by itself. Has kinks: its derivative in the directions jumps there.
    """
    return jnp.minimum(1 / (4 * g.cos_i * g.cos_o), g.cos_h / (2 * g.cos_d * jnp.maximum(g.cos_i, g.cos_o)))
