"""Lobes about the mirror direction: r.v without cancellation, and powers of a cosine that is nearly 1.

At fixed theta_h and theta_d, r.v varies with phi_d, and a narrow lobe about it faster than the polynomials do that rows of
a table are compressed to: fits of these models on glossy materials end with passes over all cells.
"""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..geometry import Geometry


def mirror_deficit(g: Geometry) -> Float[Array, "..."]:
    """1 - r.v, r the mirror direction of l: |r - v|^2/2 = 2 c_d^2 sin^2(theta_h) + (n.l - n.v)^2/2, a sum of squares.

    2 (n.l)(n.v) - l.v, of which it is 1 less, loses all digits next to the mirror direction. Symmetric in l and v.
    """
    return 2 * g.cos_d**2 * g.sin2_h + (g.cos_i - g.cos_o) ** 2 / 2


def cosine_power(deficit: Float[Array, "..."], exponent: Float[Array, ""]) -> Float[Array, "..."]:
    """x^exponent for the cosine x = 1 - deficit; 0, with zero derivative, where x <= 0."""
    positive = deficit < 1
    # Guard: the logarithm of what is not positive (tests/test_models.py::test_finite).
    x = jnp.log1p(-jnp.where(positive, deficit, 0))
    return jnp.where(positive, jnp.exp(exponent * x), 0)
