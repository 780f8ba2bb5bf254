"""Closed stand-ins for masking, each as V = G/(4 (n.l)(n.v)); ``alpha`` is the width of GGX or Beckmann's lobe."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...geometry import Geometry


def kelemen(g: Geometry) -> Float[Array, "..."]:
    """1/(4 c_d^2): G = (n.l)(n.v)/c_d^2 (Kelemen & Szirmay-Kalos 2001; Hoffman 2013, eq. 31). G exceeds 1 at grazing."""
    return 0.25 / (g.cos_d * g.cos_d)


def half_vector(g: Geometry) -> Float[Array, "..."]:
    """1/(4 c_d max(n.l, n.v)): the divisor of Ashikhmin & Shirley (2000), eq. 4."""
    return 0.25 / (g.cos_d * jnp.maximum(g.cos_i, g.cos_o))


def hammon(alpha: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """G = 2 (n.l)(n.v)/mix(2 (n.l)(n.v), n.l + n.v, alpha), for GGX's correlated masking (Hammon 2017).

    The 2 of the numerator, which some printed forms lack, is what makes G = 1 for alpha = 0.
    """
    return 0.5 / (2 * (1 - alpha) * g.cos_i * g.cos_o + alpha * (g.cos_i + g.cos_o))


def schlick_smith(alpha: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """G = G1(l) G1(v), G1 = n.v/((n.v)(1 - k) + k), k = alpha/2, for GGX's separable masking.

    Schlick (1994), eq. 19, has k = alpha sqrt(2/pi), for Beckmann's; Karis (2013) k = alpha/2.
    """
    k = alpha / 2
    return 0.25 / ((k + (1 - k) * g.cos_i) * (k + (1 - k) * g.cos_o))


def _walter_area(alpha: Float[Array, ""], cosine: Float[Array, "..."]) -> Float[Array, "..."]:
    """n.v Lambda(v) of Walter's rational form, Lambda = (1 - 1.259 a + 0.396 a^2)/(3.535 a + 2.181 a^2) for a < 1.6."""
    across2 = alpha**2 * ((1 - cosine) * (1 + cosine))  # (cos/a)^2
    masked = cosine * cosine < 1.6**2 * across2
    across = jnp.sqrt(jnp.where(masked, across2, 1))
    a = jnp.where(masked, cosine, 1) / across
    return jnp.where(masked, across * (1 + a * (0.396 * a - 1.259)) / (3.535 + 2.181 * a), 0)


def walter_separable(alpha: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """G = G1(l) G1(v), G1 = (3.535 a + 2.181 a^2)/(1 + 2.276 a + 2.577 a^2), 1 for a >= 1.6, a = 1/(alpha tan(theta)).

    Walter et al. (2007), eq. 27: within 0.35 % of Beckmann's masking. G1 is 1.00006 just below a = 1.6, where it jumps.
    """
    return 0.25 / ((g.cos_i + _walter_area(alpha, g.cos_i)) * (g.cos_o + _walter_area(alpha, g.cos_o)))


def walter_correlated(alpha: Float[Array, ""], g: Geometry) -> Float[Array, "..."]:
    """G = 1/(1 + Lambda(l) + Lambda(v)) with the Lambda of :func:`walter_separable` (Heitz 2014, eq. 99)."""
    light, viewer = _walter_area(alpha, g.cos_i), _walter_area(alpha, g.cos_o)
    return 0.25 / (g.cos_i * (g.cos_o + viewer) + g.cos_o * light)
