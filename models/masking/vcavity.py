"""Masking-shadowing of V-shaped grooves (Torrance & Sparrow 1967; Cook & Torrance 1982, eq. 4)."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...geometry import Geometry


def vcavity(g: Geometry) -> Float[Array, "..."]:
    """G = min(1, 2 (n.h)(n.l)/(l.h), 2 (n.h)(n.v)/(l.h)). Has kinks: its derivative in the directions jumps there."""
    return jnp.minimum(1.0, 2 * g.cos_h * jnp.minimum(g.cos_i, g.cos_o) / g.cos_d)
