"""Body term that trades energy with a Schlick lobe (Ashikhmin & Shirley 2000, eq. 5)."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...geometry import Geometry


def _rise(cosine: Float[Array, "..."]) -> Float[Array, "..."]:
    """1 - (1 - cos/2)^5 as cos times a polynomial, which does not cancel at grazing."""
    x = cosine / 2
    return x * (5 + x * (-10 + x * (10 + x * (-5 + x))))


def ashikhmin_shirley_body(albedo: Float[Array, ""], specular: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """28 albedo/(23 pi) (1 - specular)(1 - (1 - n.l/2)^5)(1 - (1 - n.v/2)^5), in 1/sr."""
    return 28 * albedo / (23 * jnp.pi) * (1 - specular) * (_rise(g.cos_i) * _rise(g.cos_o))
