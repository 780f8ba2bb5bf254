"""Unpolarised reflectance of a dielectric boundary."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...geometry import Geometry


def dielectric(ior: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """F = 1/2 (g-c)^2/(g+c)^2 (1 + (c(g+c) - 1)^2/(c(g-c) + 1)^2), g^2 = ior^2 + c^2 - 1 (Cook & Torrance 1982, eq. 3).

    For ``ior`` >= 1. g - c cancels for ior near 1: it is written (ior^2 - 1)/(g + c). Where g > 2c the ratio is written
    1 - 2c/(g + c), because the derivative of the quotient cancels at grazing.
    """
    return dielectric_at(ior, g.cos_d)


def dielectric_at(ior: Float[Array, ""], c: Float[Array, "..."]) -> Float[Array, "..."]:
    """:func:`dielectric` at a cosine c of incidence."""
    n2m1 = (ior - 1) * (ior + 1)
    root = jnp.sqrt(n2m1 + c * c)
    difference = n2m1 / (root + c)
    ratio = jnp.where(root > 2 * c, 1 - 2 * c / (root + c), difference / (root + c))
    return 0.5 * ratio**2 * (1 + ((c * (root + c) - 1) / (c * difference + 1)) ** 2)


def dielectric_f0(ior: Float[Array, ""]) -> Float[Array, ""]:
    """Reflectance at normal incidence, ((ior - 1)/(ior + 1))^2."""
    return ((ior - 1) / (ior + 1)) ** 2
