"""Generalised Trowbridge-Reitz distribution (Burley 2012, appendix B.2; Hoffman 2013, eq. 25-28)."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...special import expm1_ratio


class GTR(eqx.Module):
    """D = k / ((n.m)^2 (alpha^2 - 1) + 1)^gamma, with k = (gamma-1)(alpha^2-1) / (pi (1 - alpha^(2 - 2 gamma))).

    ``alpha`` > 0 is the width, ``gamma`` > 0 the fall-off: 2 is Trowbridge-Reitz (GGX), 1 is Berry's distribution.

    Evaluated as  D = phi(M) / (pi phi((1-gamma) M)) / (1 + w u)^gamma,  phi(x) = (e^x - 1)/x,  M = |ln alpha^2|,
    w = e^M - 1, u = sin^2 for alpha <= 1 and cos^2 above: the same number, but without the singularities of k at gamma = 1
    and alpha = 1, without cancellation in the base, and in range from the power law (alpha -> 0) to the Gaussian
    exp(-K sin^2) that gamma -> infinity with K = gamma (1/alpha^2 - 1) fixed tends to. w is formed from alpha, since a
    rounding of M counts M times in e^M, and then gamma times.
    """

    alpha: Float[Array, ""]
    gamma: Float[Array, ""]

    def __call__(self, sin2: Float[Array, "..."], cos2: Float[Array, "..."]) -> Float[Array, "..."]:
        """D in 1/sr."""
        a, log_alpha2 = self.alpha, 2 * jnp.log(self.alpha)
        narrow = a <= 1
        m = jnp.where(narrow, -log_alpha2, log_alpha2)  # not abs: its derivative at alpha = 1 would be 0
        w = jnp.where(narrow, (1 - a) / a * ((1 + a) / a), (a - 1) * (a + 1))
        u = jnp.where(narrow, sin2, cos2)
        # Guard: a reciprocal, because the derivative of a quotient a/b forms a db, 1e43 here, beyond float32
        # (tests/test_stability.py::test_random_draws_are_finite).
        k = expm1_ratio(m) * (1 / (jnp.pi * expm1_ratio((1 - self.gamma) * m)))
        half = jnp.exp(-self.gamma / 2 * jnp.log1p(w * u))  # k may be 1e25 where exp is below float32
        return k * half * half
