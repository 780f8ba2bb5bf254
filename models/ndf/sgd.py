"""Shifted gamma distribution (Bagher et al. 2012, eq. 11; Hoffman 2013, eq. 23-24)."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...quadrature import gauss_legendre


class SGD(eqx.Module):
    """D = exp(-x) / (x^p alpha Gamma(1 - p, alpha) pi (n.m)^4),  x = alpha + tan^2(theta_m)/alpha.

    ``alpha`` > 0 is the width (the mean square slope of the Gaussian it tends to for p = 0), any real ``p`` the shape of
    the tail. Gamma(s, x) is the upper incomplete gamma function, needed here for s = 1 - p <= 0 too. With t = alpha e^u,

        alpha Gamma(1 - p, alpha) x^p e^x = alpha^2 (1 + tan^2/alpha^2)^p e^(tan^2/alpha) I,
        I = int_0^inf exp((1 - p) u - alpha (e^u - 1)) du,

    which neither over- nor underflows; I takes 128 Gauss-Legendre nodes over the range where the integrand is above
    1e-17 of its peak.
    """

    alpha: Float[Array, ""]
    p: Float[Array, ""]

    def integral(self) -> Float[Array, ""]:
        """I = e^alpha alpha^(p-1) Gamma(1 - p, alpha)."""
        x, weight = (jnp.asarray(a, jnp.result_type(self.alpha)) for a in gauss_legendre(128))
        s = 1 - self.p
        # The end of the range is no part of the answer: no derivative goes through it.
        alpha, rate = jax.lax.stop_gradient((self.alpha, -s))
        growth = jnp.maximum(-rate, 0)
        end = jnp.log1p((45 + 3 * growth * jnp.log1p(growth + 1 / alpha)) / alpha)
        end = jnp.where(rate > 1, jnp.minimum(end, 45 / jnp.maximum(rate, 1)), end)
        u = x * end
        return end * jnp.sum(weight * jnp.exp(s * u - self.alpha * jnp.expm1(u)))

    def __call__(self, sin2: Float[Array, "..."], cos2: Float[Array, "..."]) -> Float[Array, "..."]:
        tan2 = sin2 / cos2
        log = -tan2 / self.alpha - self.p * jnp.log1p(tan2 / self.alpha**2) + 2 * jnp.log1p(tan2)
        return jnp.exp(log) / (jnp.pi * self.alpha**2 * self.integral())
