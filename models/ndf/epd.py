"""Exponential power distribution of slopes (Holzschuch & Pacanowski 2017)."""

from __future__ import annotations

from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .power_cosine import log_cosine

_GONE = 7.0
"""ln of an exponent: exp(-e^7) is 0 in double precision."""


class EPD(eqx.Module):
    """D = exp(-(tan^2(theta_m)/alpha^2)^p) / (pi alpha^2 Gamma(1 + 1/p) (n.m)^4), ``alpha``, ``p`` > 0.

    p = 1 is Beckmann's distribution; p < 1 has a sharper peak and a longer tail, and a cusp at the pole for p <= 1/2.
    Gamma(1 + 1/p) alpha^2 is the integral of the exponential over tan^2: that is the normalisation. At the pole itself
    derivatives by the angle are 0, which is their mean over all sides of the cusp. In float32 a cusp is cut off within 1e-10
    alpha of the pole: 1e-3 of D for p = 0.15.
    """

    alpha: Float[Array, ""]
    p: Float[Array, ""]

    smith_nodes: ClassVar[int] = 300
    """See :func:`brdfit.models.masking.smith_lambda`: exp(-tan^(2 p)) is analytic within pi/(4 p) of the real axis only."""

    def __call__(self, sin2: Float[Array, "..."], cos2: Float[Array, "..."]) -> Float[Array, "..."]:
        """D in 1/sr."""
        single = jnp.result_type(sin2, self.alpha) == jnp.float32
        alpha, p = jax.lax.stop_gradient((self.alpha, self.p))
        # Guards: ln 0 at the pole, and towards the horizon 1/cos^4 beyond the largest number where exp is 0, 0 * inf = NaN
        # (tests/test_ndf.py::test_finite_at_both_ends).
        peak = sin2 <= (1e-20 if single else 1e-60) * alpha**2 * cos2
        reach = jnp.exp(jnp.minimum(_GONE / p, 80 if single else 600))
        lost = sin2 / reach > alpha**2 * cos2
        aside = peak | lost
        log = jnp.log(jnp.where(aside, 1, sin2)) - jnp.log(jnp.where(aside, 1, cos2)) - 2 * jnp.log(self.alpha)
        fall = jnp.where(peak, 0, jnp.exp(self.p * jnp.where(aside, 0, log)))
        # 1/cos^4 within the exponential: float32 cannot hold it where the tail goes on to the horizon
        half = jnp.exp(-fall / 2 - 2 * log_cosine(jnp.where(lost, 0.5, sin2), jnp.where(lost, 0.5, cos2)))
        k = jnp.exp(-jax.lax.lgamma(1 + 1 / self.p)) / (jnp.pi * self.alpha**2)
        return jnp.where(lost, 0, k * half * half)


__all__ = ["EPD"]
