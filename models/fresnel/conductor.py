"""Unpolarised reflectance of a conductor, with and without Schlick's approximation."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...geometry import Geometry


def conductor(ior: Float[Array, ""], k: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """F = (Rs + Rp)/2 for the index n + ik, ``ior`` = n > 0, ``k`` >= 0 (Born & Wolf, section 14.2).

    Rs = ((a - c)^2 + b^2)/((a + c)^2 + b^2), Rp = Rs ((a c - s^2)^2 + b^2 c^2)/((a c + s^2)^2 + b^2 c^2) with c, s cosine
    and sine of theta_d and (a + ib)^2 = (n + ik)^2 - s^2. a - c is (a^2 - c^2)/(a + c), a^2 - c^2 = n^2 - 1 - k^2 + b^2.
    Slopes in float32 are good to 5e-5 at grazing.
    """
    c, s2 = g.cos_d, g.sin2_d
    real, cross = (ior - k) * (ior + k) - s2, ior * k
    # Guard: the slope of the root at 0, the critical angle of n < 1 without absorption
    # (tests/test_microfacet_models.py::test_conductors).
    size = jnp.sqrt(jnp.maximum(real * real + 4 * cross * cross, float(np.finfo(np.dtype(jnp.result_type(s2))).tiny)))
    large = jnp.sqrt((size + jnp.abs(real)) / 2)
    small = cross / large  # of a and b, without cancellation and, for k = 0, the root of a square
    a, b = jnp.where(real > 0, large, small), jnp.where(real > 0, small, large)
    b2 = b * b
    less = ((ior - 1) * (ior + 1) - k * k + b2) / (a + c)
    rs = (less * less + b2) / ((a + c) ** 2 + b2)
    ac, b2c2 = a * c, b2 * c * c
    return rs * (1 + ((ac - s2) ** 2 + b2c2) / ((ac + s2) ** 2 + b2c2)) / 2


def lazanyi(ior: Float[Array, ""], k: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """((n - 1)^2 + 4 n (1 - c_d)^5 + k^2)/((n + 1)^2 + k^2) (Lazányi & Szirmay-Kalos 2005)."""
    return ((ior - 1) ** 2 + 4 * ior * g.vers_d**5 + k * k) / ((ior + 1) ** 2 + k * k)


def schlick_ior(ior: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """((n - 1)^2 + 4 n (1 - c_d)^5)/(n + 1)^2: Schlick's approximation from the index (Schlick 1994)."""
    return ((ior - 1) ** 2 + 4 * ior * g.vers_d**5) / (ior + 1) ** 2
