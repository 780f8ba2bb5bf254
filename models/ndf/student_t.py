"""Student's t-distribution of slopes (Ribardière et al. 2017)."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...quadrature import gauss_legendre
from .power_cosine import log_cosine

_RATIO = (1, -1 / 8, 1 / 128, 5 / 1024, -21 / 32768, -399 / 262144, 869 / 4194304, 39325 / 33554432, -334477 / 2147483648)
"""Gamma(x + 1/2)/(Gamma(x) sqrt(x)) in powers of 1/x: from x = 24 on the first one left out is below 1e-15."""


def gamma_ratio(w: Float[Array, ""]) -> Float[Array, ""]:
    """Gamma(w + 1/2)/Gamma(w), w > 0, which the difference of their logarithms has not to all digits."""
    x = w + 24
    series = jnp.full_like(x, _RATIO[-1])
    for c in reversed(_RATIO[:-1]):
        series = series / x + c
    below = w + jnp.arange(24, dtype=x.dtype)
    return jnp.prod(below / (below + 0.5)) * jnp.sqrt(x) * series


class StudentT(eqx.Module):
    """D = 1/(pi alpha^2 (n.m)^4 (1 + tan^2(theta_m)/((gamma - 1) alpha^2))^gamma), ``alpha`` > 0, ``gamma`` > 3/2.

    gamma = 2 is GGX, gamma -> infinity Beckmann's distribution. Below 3/2 the mean slope is infinite, and so is Smith's
    integral. For gamma < 2 the density grows without bound towards the horizon, as (n.m)^(2 gamma - 4).
    """

    alpha: Float[Array, ""]
    gamma: Float[Array, ""]

    def __call__(self, sin2: Float[Array, "..."], cos2: Float[Array, "..."]) -> Float[Array, "..."]:
        """D in 1/sr."""
        # Guard: a power of 0 on the horizon (tests/test_ndf.py::test_finite_at_both_ends).
        cos2 = jnp.maximum(cos2, float(np.finfo(np.dtype(jnp.result_type(cos2))).tiny) ** 0.5)
        fall = jnp.log1p(sin2 / cos2 / ((self.gamma - 1) * self.alpha**2))
        log = -self.gamma * fall - 4 * log_cosine(sin2, cos2)
        half = jnp.exp(log / 2)  # the peak may be 1e8 where exp is below float32
        return half / (jnp.pi * self.alpha**2) * half

    def averted_area(self, cosine: Float[Array, "..."]) -> Float[Array, "..."]:
        """n.v Lambda(v) = k scale sin int_(z0)^inf (z - z0)(1 + z^2)^(1/2 - gamma) dz, z0 = cos/(scale sin).

        k = Gamma(gamma - 1/2)/(sqrt(pi) Gamma(gamma - 1)): Bourlier's form of Smith's integral over the density of slopes
        along one direction (Ribardière et al. 2017), whose tail is a power that a rule in angles does not reach.
        The integral is (1 + z0^2)^(3/2 - gamma)/(2 gamma - 3) - z0 T, T = int_(z0)^inf (1 + z^2)^(1/2 - gamma) dz: 1/(2 k)
        less a smooth integral over [0, z0] for z0 < 3, and for larger z0, with 1 + z^2 = (1 + z0^2) e^(u^2/w) and
        w = gamma - 1, (1 + z0^2)^-w/w int_0^inf u e^(-u^2) (1 - e^(-u^2/w)/(1 + z0^2))^(-1/2) du. 48 nodes each: 1e-14 of N;
        in float32 slopes next to normal incidence are good to 1e-3.
        """
        w = self.gamma - 1
        scale = self.alpha * jnp.sqrt(w)
        # Guard: 1/0 at normal incidence, where for gamma < 2 the slope is infinite: large there
        # (tests/test_microfacet_models.py::test_own_masking).
        sine = jnp.sqrt((1 - cosine) * (1 + cosine) + (1e-12 if cosine.dtype == jnp.float32 else 1e-30))
        z0 = cosine / (scale * sine)
        k = gamma_ratio(w) / jnp.sqrt(jnp.pi)
        steep = z0 < 3
        log = jnp.log1p(z0 * z0)
        x, weight = (jnp.asarray(a, jnp.result_type(z0)) for a in gauss_legendre(48))
        low = jnp.where(steep, z0, 1)[..., None]
        near = 0.5 / k - low[..., 0] * jnp.sum(weight * jnp.exp(-(w + 0.5) * jnp.log1p((x * low) ** 2)), -1)
        u = 40.0**0.5 * x
        weight = 40.0**0.5 * weight * u * jnp.exp(-u * u)
        high = 1 / (1 + jnp.where(steep, 3, z0)[..., None] ** 2)
        tail = jnp.exp(-w * log) / w * jnp.sum(weight / jnp.sqrt(1 - high * jnp.exp(-u * u / w)), -1)
        area = jnp.exp((0.5 - w) * log) / (2 * w - 1) - z0 * jnp.where(steep, near, tail)
        return k * scale * sine * area


__all__ = ["StudentT"]
